"""Virtual transmitters inside agent particles: Gaussian sums, updated by one range at a time.

Source: Gentner et al., "Multipath assisted positioning with simultaneous localization and mapping", IEEE TWC 2016 (a
virtual transmitter a path, inside every agent particle); the Gaussian sum in place of particles is that of
Ulmschneider, Gentner, Jost and Dammann, "Rao-Blackwellized Gaussian sum particle filter for multipath assisted
positioning", 2018.

Every agent particle linearises where it is itself: ranges alone do not tell how the whole map is turned about the
agent, and derivatives shared by particles of different courses would make such knowledge up.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.schemes.bp_slam.ranges import Bistatic, length_of

LOG_TWO_PI = float(np.log(2.0 * np.pi))
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
"""Angle from one direction to the next on a spiral that covers the sphere evenly."""


class Transmitters(NamedTuple):
    """C Gaussians of all virtual transmitters, those of one transmitter side by side, in N agent particles."""

    base: Floats
    """(N, C, 3) where the particle was at the birth [m]."""
    frame: Floats
    """(C, 3, 3) rows: direction of the Gaussian from there, and two directions across."""
    mean: Floats
    """(N, C, 3) distance from the base [m], and tangents of the two angles off the direction."""
    covariance: Floats
    """(N, C, 3, 3) of these three."""
    log_share: Floats
    """(N, C); the shares of one transmitter sum to one in every particle."""
    label: Integers
    """(C,) label of the path."""

    @property
    def starts(self) -> Integers:
        """(V,) first Gaussian of every virtual transmitter."""
        return np.flatnonzero(np.diff(self.label, prepend=self.label[:1] - 1)) if len(self.label) else self.label

    @property
    def owner(self) -> Integers:
        """(C,) number of the virtual transmitter that a Gaussian belongs to."""
        return np.repeat(np.arange(len(self.starts)), np.diff(self.starts, append=len(self.label)))

    def keep(self, rows: Booleans) -> "Transmitters":
        """Some of the Gaussians."""
        per_particle = (self.base, self.mean, self.covariance, self.log_share)
        base, mean, covariance, log_share = (column[:, rows] for column in per_particle)
        return Transmitters(base, self.frame[rows], mean, covariance, log_share, self.label[rows])


class Points(NamedTuple):
    """Gaussians in the room."""

    position: Floats
    """(N, C, 3) [m]."""
    jacobian: Floats
    """(N, C, 3, 3) derivatives; rows: by distance, by either tangent; columns: x, y, z."""


def no_transmitters(num_particles: int) -> Transmitters:
    """None yet."""
    three = np.zeros((num_particles, 0, 3))
    square = np.zeros((num_particles, 0, 3, 3))
    empty = np.zeros(0, dtype=np.int64)
    return Transmitters(three, square[0], three, square, np.zeros((num_particles, 0)), empty)


def join(parts: list[Transmitters]) -> Transmitters:
    """All of them in one."""
    columns = zip(*parts, strict=True)
    return Transmitters(*(np.concatenate(c, axis=axis) for c, axis in zip(columns, (1, 0, 1, 1, 1, 0), strict=True)))


def points_of(known: Transmitters) -> Points:
    """Where the means lie, `base + distance u` with `u` along `direction + p e + q f`, and how they move."""
    distance, tangents = known.mean[..., 0, None], known.mean[..., 1:]
    reach = np.sqrt(1.0 + np.sum(tangents**2, axis=-1, keepdims=True))
    unit = (known.frame[:, 0] + tangents[..., :1] * known.frame[:, 1] + tangents[..., 1:] * known.frame[:, 2]) / reach
    across = [
        distance / reach * (known.frame[:, axis] - tangents[..., axis - 1, None] / reach * unit) for axis in (1, 2)
    ]
    return Points(known.base + distance * unit, np.stack([unit, *across], axis=-2))


def even_directions(count: int, upper_half: bool) -> Floats:
    """Unit vectors (count, 3), evenly over the sphere or its upper half, on a spiral."""
    step = (np.arange(count) + 0.5) / count
    height = step if upper_half else 1.0 - 2.0 * step
    across, angle = np.sqrt(1.0 - height**2), GOLDEN * np.arange(count)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=-1)


def born(label: int, position: Floats, length: float, std: float, model: Bistatic, count: int) -> Transmitters:
    """A virtual transmitter somewhere at range `length` [m] from agents (N, 3): `count` Gaussians over all directions.

    They are Gaussian in distance and angles, so that they lie along the sphere and do not stick out of it.
    """
    direction = even_directions(count, model.upper_half)
    area = (2.0 if model.upper_half else 4.0) * np.pi
    distance = length_of(model.invert(np.zeros(3), direction, np.full(count, length)))
    side = np.where(np.abs(direction[:, 2:]) < 0.9, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    first = np.cross(direction, side)
    first /= np.maximum(length_of(first), 1e-12)[:, None]
    frame = np.stack([direction, first, np.cross(direction, first)], axis=1)
    across = 0.5 * np.sqrt(area / count)
    shape = (len(position), count)
    mean = np.stack([distance, np.zeros(count), np.zeros(count)], axis=1)
    covariance = np.diag([(0.5 * std) ** 2, across**2, across**2])
    return Transmitters(
        np.broadcast_to(position[:, None], (*shape, 3)),
        frame,
        np.broadcast_to(mean, (*shape, 3)),
        np.broadcast_to(covariance, (*shape, 3, 3)),
        np.full(shape, -np.log(count)),
        np.full(count, label),
    )


class Update(NamedTuple):
    """After one cycle's ranges."""

    transmitters: Transmitters
    log_likelihood: Floats
    """(N,) of all ranges, given each agent particle."""
    square: Floats
    """(V,) squared normalised innovation of every virtual transmitter in the mean belief."""


def update(
    known: Transmitters, position: Floats, weight: Floats, length: Floats, std: Floats, model: Bistatic, outlier: float
) -> Update:
    """Every virtual transmitter updated by its range: a Kalman update of every Gaussian, of second order in the angles.

    Parameters
    ----------
    position, weight
        Agent particles (N, 3) [m] and their weights (N,).
    length, std
        (V,) range of every virtual transmitter and its standard deviation [m], in the order of `known.starts`.
    outlier
        Probability that a range is uniform over a metre instead.
    """
    starts, owner, points = known.starts, known.owner, points_of(known)
    predicted, slope = _range(model, position, points)
    drift = np.sum((position[:, None] - known.base) * points.jacobian[..., 0, :], axis=-1)
    curve = 4.0 * drift * known.mean[..., 0] / predicted * (known.covariance[..., 1, 1] + known.covariance[..., 2, 2])
    spread = _apply(known.covariance, slope)
    variance = np.sum(slope * spread, axis=-1) + 0.5 * curve**2 + std[owner] ** 2
    miss = length[owner] - predicted - 0.5 * curve
    gain = spread / variance[..., None]
    log_joint = known.log_share - 0.5 * (miss**2 / variance + np.log(variance) + LOG_TWO_PI)
    log_path = _log_sums(log_joint, starts)
    moved = known._replace(
        mean=known.mean + miss[..., None] * gain,
        covariance=known.covariance - gain[..., :, None] * spread[..., None, :],
        log_share=log_joint - log_path[:, owner],
    )
    robust = np.logaddexp(np.log1p(-outlier) + log_path, np.log(outlier)).sum(axis=1)
    return Update(moved, robust, _squares(known, weight, miss, variance, starts))


def prune(known: Transmitters, weight: Floats, least: float) -> Transmitters:
    """Without Gaussians whose share, over all agents, is below `least`; every transmitter keeps its best."""
    if not len(known.label):
        return known
    share = weight @ np.exp(known.log_share)
    kept = known.keep((share >= least) | (share >= np.maximum.reduceat(share, known.starts)[known.owner]))
    return kept._replace(log_share=kept.log_share - _log_sums(kept.log_share, kept.starts)[:, kept.owner])


def moments(known: Transmitters, weight: Floats) -> tuple[Floats, Floats]:
    """Mean (V, 3) [m] and covariance (V, 3, 3) [m^2] of every virtual transmitter over agents and Gaussians.

    The covariance of a Gaussian and its derivatives enter as their means over the agents, which differ little in them.
    """
    starts = known.starts
    if not len(starts):
        return np.zeros((0, 3)), np.zeros((0, 3, 3))
    share, points = weight[:, None] * np.exp(known.log_share), points_of(known)
    total = share.sum(axis=0)
    part = share / np.maximum(total, 1e-300)
    first = np.einsum("nc,nci->ci", share, points.position)
    second = np.einsum("nci,ncj->cij", share[..., None] * points.position, points.position)
    jacobian = np.einsum("nc,ncij->cij", part, points.jacobian)
    covariance = np.einsum("nc,ncij->cij", share, known.covariance)
    second += jacobian.swapaxes(1, 2) @ covariance @ jacobian
    mean = np.add.reduceat(first, starts)
    return mean, np.add.reduceat(second, starts) - mean[:, :, None] * mean[:, None]


def _range(model: Bistatic, agent: Floats, points: Points) -> tuple[Floats, Floats]:
    """Ranges (N, C) [m] from agents (N, 3), and slopes (N, C, 3) by distance and tangents."""
    offset = points.position - agent[:, None]
    to_tx, to_rx = offset - model.tx, offset - model.rx
    tx, rx = np.maximum(length_of(to_tx), 1e-3), np.maximum(length_of(to_rx), 1e-3)
    return tx + rx, _apply(points.jacobian.swapaxes(2, 3), to_tx / tx[..., None] + to_rx / rx[..., None])


def _apply(matrix: Floats, vector: Floats) -> Floats:
    """Products (N, C, 3) of transposed (or symmetric) matrices (N, C, 3, 3) with vectors (N, C, 3)."""
    total = matrix[..., 0, :] * vector[..., 0:1]
    for axis in (1, 2):
        total = total + matrix[..., axis, :] * vector[..., axis : axis + 1]
    return total


def _log_sums(values: Floats, starts: Integers) -> Floats:
    """Logarithm (N, V) of the sums of exponentials of (N, C), transmitter by transmitter."""
    if not len(starts):
        return np.zeros((len(values), 0))
    top = np.maximum.reduceat(values, starts, axis=1)
    count = np.diff(starts, append=values.shape[1])
    sums = np.add.reduceat(np.exp(values - np.repeat(top, count, axis=1)), starts, axis=1)
    return top + np.log(sums)


def _squares(known: Transmitters, weight: Floats, miss: Floats, variance: Floats, starts: Integers) -> Floats:
    """(V,) squared innovation over its variance, both of the whole mixture over agents and Gaussians."""
    if not len(starts):
        return np.zeros(0)
    share = weight[:, None] * np.exp(known.log_share)
    mean = np.add.reduceat((share * miss).sum(axis=0), starts)
    second = np.add.reduceat((share * (miss**2 + variance)).sum(axis=0), starts)
    return mean**2 / np.maximum(second - mean**2, 1e-300)
