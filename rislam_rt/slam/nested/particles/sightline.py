"""Sightline of a return: length and cosines as functions of one landmark's particles, a formula that engines share.

An agent particle sees a return over a Tx leg and an Rx leg. Of all features on these legs one, the owner, is a cloud;
the others stand at the agent particle's own mean. Whatever lies before the owner on a leg is a fixed base, and whatever
lies behind it mirrors the device instead, so that every leg is one of three kinds: it misses the owner (`FIXED`), ends
in it (`POINT`), or is mirrored by it (`WALL`). The last two need a handful of constants for each agent particle.
"""

from collections.abc import Callable, Iterator, Sequence
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.slam.predicted_returns import NONE, TX, Poses, Returns, reflect


class Leg(IntEnum):
    """How a leg of a path depends on the landmark whose particles are weighed (the owner)."""

    FIXED = 0
    """The leg misses the owner."""
    POINT = 1
    """The leg ends in the owner, a point."""
    WALL = 2
    """The leg is mirrored by the owner, a wall."""
    LINEAR = 3
    """The measurement is the offset owner minus agent itself: no room has it, but a Kalman filter is exact with it."""


class Kind(NamedTuple):
    """Kinds of a path's Tx leg and Rx leg; engines compile one kernel for each tuple of returns."""

    tx: Leg
    """Kind of the Tx leg."""
    rx: Leg
    """Kind of the Rx leg."""


Kinds = tuple[Kind, ...]
"""Kinds of the legs of several returns."""


class Sightline(NamedTuple):
    """A return's path as constants of each of N agent particles, which give a landmark particle's predicted return."""

    kind: Kind
    """Kinds of the two legs."""
    tx: Floats
    """Constants [m] of the Tx leg: (N, 1) length if fixed, (N, 3) the cloud's centre off the Tx, (N, 9) of a wall."""
    rx: Floats
    """Constants of the Rx leg: (N, 3) length [m] and cosines if fixed, else as `tx`."""
    axes: Floats
    """The array's two axes (N, 6), mirrored along with the device."""


class Sighting(NamedTuple):
    """A measured return, the path that made it, and the error that is expected of it."""

    line: Sightline
    """Path that made the measurement."""
    seen: Floats
    """Measured length [m] and two cosines (3,)."""
    covariance: Floats
    """Covariance (3, 3) of the measurement's expected error."""
    power: float = 1.0
    """Exponent of the likelihood."""
    log_factor: float = 0.0
    """Logarithm of a factor on the likelihood."""


NUM_LEG = {Leg.FIXED: (1, 3), Leg.POINT: (3, 3), Leg.WALL: (9, 9), Leg.LINEAR: (0, 3)}
"""Number of constants of a Tx leg and of an Rx leg, by kind."""
NUM_AXES = 6
"""Number of constants of the array's two axes."""
NUM_NOISE = 10
"""Number of constants of a measurement: value (3), lower triangle of the whitening matrix (6), log peak density (1)."""


def num_constants(kinds: Kinds) -> int:
    """Number of constants of a sightline that returns of these kinds need for each agent particle."""
    return sum(NUM_NOISE + NUM_LEG[kind.tx][0] + NUM_LEG[kind.rx][1] + NUM_AXES for kind in kinds)


def pack(sightings: Sequence[Sighting], count: int) -> Floats:
    """Constants (K, N) float32 of the sightlines of several returns over one landmark, for `count` agent particles."""
    columns = [np.zeros((count, 0))]
    for sighting in sightings:
        columns += [sighting.line.tx, sighting.line.rx, sighting.line.axes]
        columns.append(np.broadcast_to(_noise_constants(sighting), (count, NUM_NOISE)))
    return np.ascontiguousarray(np.concatenate(columns, axis=1).T, dtype=np.float32)


def _noise_constants(sighting: Sighting) -> Floats:
    """Constants (10,) of a measurement along a sightline: value, whitening matrix and peak; `power` and `log_factor`
    are in these."""
    lower = np.linalg.cholesky(sighting.covariance)
    white = np.sqrt(sighting.power) * np.linalg.inv(lower)
    peak = -sighting.power * (np.sum(np.log(np.diag(lower))) + 1.5 * np.log(2.0 * np.pi)) + sighting.log_factor
    return np.concatenate([sighting.seen, white[np.tril_indices(3)], [peak]])


def log_likelihood(
    kinds: Kinds, constant: Callable[[int], Any], x: Any, y: Any, z: Any, rsqrt: Callable[[Any], Any]
) -> Any:
    """Log likelihood of returns along their sightlines, summed, for a landmark's particles at offsets (x, y, z) [m]
    from the cloud's centre.

    Written in plain arithmetic, so that it runs on numpy arrays and inside a Dr.Jit kernel alike.

    Parameters
    ----------
    constant
        Gives the k-th constant of the agent particle in question.
    """
    take = (constant(k) for k in range(num_constants(kinds)))
    total: Any = None
    for kind in kinds:
        seen = _predict(kind, take, x, y, z, rsqrt)
        gap = [s - next(take) for s in seen]
        white = [next(take) for _ in range(6)]
        first = white[0] * gap[0]
        second = white[1] * gap[0] + white[2] * gap[1]
        third = white[3] * gap[0] + white[4] * gap[1] + white[5] * gap[2]
        one = next(take) - 0.5 * (first * first + second * second + third * third)
        total = one if total is None else total + one
    return total


def _predict(kind: Kind, take: Iterator[Any], x: Any, y: Any, z: Any, rsqrt: Callable[[Any], Any]) -> list[Any]:
    """Length [m] and two cosines of a return over a landmark particle along its sightline."""
    if kind.tx == Leg.LINEAR:
        offset = [next(take) for _ in range(3)]
        for _ in range(NUM_AXES):
            next(take)
        return [x + offset[0], y + offset[1], z + offset[2]]
    if kind.tx == Leg.FIXED:
        tx_length = next(take)
    else:
        dx, dy, dz = _offset(kind.tx, take, x, y, z)
        square = _square(dx, dy, dz)
        tx_length = square * rsqrt(square)
    if kind.rx == Leg.FIXED:
        seen = [next(take) for _ in range(3)]
        for _ in range(NUM_AXES):
            next(take)
        return [tx_length + seen[0], seen[1], seen[2]]
    dx, dy, dz = _offset(kind.rx, take, x, y, z)
    square = _square(dx, dy, dz)
    inverse = rsqrt(square)
    axes = [next(take) for _ in range(NUM_AXES)]
    forward = (axes[0] * dx + axes[1] * dy + axes[2] * dz) * inverse
    left = (axes[3] * dx + axes[4] * dy + axes[5] * dz) * inverse
    return [tx_length + square * inverse, forward, left]


def _square(dx: Any, dy: Any, dz: Any) -> Any:
    """Squared length of a sightline, kept off zero: a landmark on the device is improbable, not undefined."""
    return dx * dx + dy * dy + dz * dz + 1e-12


def _offset(leg: Leg, take: Iterator[Any], x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
    """Vector of a sightline from the device to the far end of a particle's leg: its point, or the device mirrored."""
    if leg == Leg.POINT:
        return x + next(take), y + next(take), z + next(take)
    sx, sy, sz = x + next(take), y + next(take), z + next(take)
    qx, qy, qz = next(take), next(take), next(take)
    scale = 1.0 - 2.0 * (sx * qx + sy * qy + sz * qz) / _square(sx, sy, sz)
    return next(take) + scale * sx, next(take) + scale * sy, next(take) + scale * sz


def trace_sightline(
    returns: Returns, row: int, owner: int, features: Floats, anchor: Floats, poses: Poses
) -> Sightline:
    """Sightline of one return for the cloud of feature `owner`, all other features at their means.

    Parameters
    ----------
    features
        (N, F, 3) mean of every cloud, of every agent particle [m].
    anchor
        (F, 3) of walls [m].
    poses
        Ends (N, 3) of every agent particle.
    """
    axes = np.broadcast_to(rotation_z(poses.heading)[..., :, :2], (len(features), 3, 2))
    still = np.zeros_like(axes)
    tx_kind, tx, _ = _trace_leg(returns.legs[returns.tx[row]], owner, features, anchor, poses.tx, poses.tx, still)
    rx_kind, rx, turned = _trace_leg(returns.legs[returns.rx[row]], owner, features, anchor, poses.tx, poses.rx, axes)
    if tx_kind == Leg.FIXED:
        tx = np.linalg.norm(tx, axis=1, keepdims=True)
    if rx_kind == Leg.FIXED:
        length = np.maximum(np.linalg.norm(rx, axis=1, keepdims=True), 1e-9)
        rx = np.concatenate([length, np.einsum("nik,ni->nk", turned, rx / length)], axis=1)
    return Sightline(Kind(tx_kind, rx_kind), tx, rx, np.swapaxes(turned, 1, 2).reshape(len(features), 6))


def _trace_leg(
    leg: Sequence[int], owner: int, features: Floats, anchor: Floats, source: Floats, device: Floats, axes: Floats
) -> tuple[Leg, Floats, Floats]:
    """Kind of a sightline's leg, its constants (the whole offset where fixed), and the axes as mirrored along it."""
    base, walls = int(leg[0]), [int(wall) for wall in leg[1:] if wall != NONE]
    start = source if base == TX else features[:, base]
    place = 0 if base == owner and base != TX else walls.index(owner) + 1 if owner in walls else None
    behind = walls if place is None else walls[place:]
    for wall in reversed(behind):
        device = reflect(device, features[:, wall], anchor[wall])
        axes = _mirror(axes, features[:, wall] - anchor[wall])
    if place is None or place == 0:
        return Leg.FIXED if place is None else Leg.POINT, start - device, axes
    for wall in walls[: place - 1]:
        start = reflect(start, features[:, wall], anchor[wall])
    span = features[:, owner] - anchor[owner]
    return Leg.WALL, np.concatenate([span, start - anchor[owner], start - device], axis=1), axes


def _mirror(axes: Floats, normal: Floats) -> Floats:
    """Directions (N, 3, 2) of sightlines mirrored in planes through the origin with normals (N, 3) of any length."""
    along = np.einsum("ni,nik->nk", normal, axes) / np.sum(normal**2, axis=1)[:, None]
    return axes - 2.0 * normal[..., None] * along[:, None]


def linear_sightline(centre: Floats, agent: Floats) -> Sightline:
    """Sightline whose measurement is the offset (N, 3) [m] from agent to landmark itself, for priors and for checks."""
    return Sightline(
        Kind(Leg.LINEAR, Leg.LINEAR), np.zeros((len(centre), 0)), centre - agent, np.zeros((len(centre), 6))
    )
