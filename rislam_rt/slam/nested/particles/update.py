"""Measurement update: each return goes to the landmark that it speaks of; points first, then the walls they show in."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import Body
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.nested.belief_moments import POSE, Moments
from rislam_rt.slam.nested.particles.belief import Nested, absorb, gaussian, mean_covariances
from rislam_rt.slam.nested.particles.cloud import CloudEngine
from rislam_rt.slam.nested.particles.sightline import Sighting, trace_sightline
from rislam_rt.slam.nested_config import NestedConfig
from rislam_rt.slam.returns import NONE, Returns, linearise

TAIL = 4.0
"""Degrees of freedom of Student's t, by which a return far off its prediction counts for less."""
FLOOR = np.array([5e-4, 2e-4, 2e-4])
"""Standard deviation [m, 1, 1] added to length and cosines: what the model leaves out."""
FUSED = 3
"""Most returns in one kernel."""


class Seen(NamedTuple):
    """A returns that were seen."""

    returns: Returns
    twin: Returns
    """The return that each came out as one with; itself where it stands alone."""
    anchor: Floats
    """(F, 3) [m]."""
    body: Body
    seen: Floats
    """(A, 3)."""
    noise: Floats
    """(A, 3) variances."""


class LinearPrediction(NamedTuple):
    """Returns as the mean belief sees them."""

    gap: Floats
    """(A, 3) measured less predicted."""
    by_state: Floats
    """(A, 3, 7 + 3F)."""


def look(moments: Moments, seen: Seen) -> LinearPrediction:
    """Innovations and derivatives of the returns at the mean belief, for the update of the particles."""
    poses = poses_of(moments.position, np.asarray(moments.heading), seen.body)
    gap, by_state = seen.seen.copy(), np.zeros((*seen.seen.shape, len(moments.mean)))
    for side in (seen.returns, seen.twin):
        linear = linearise(side, moments.features, seen.anchor, poses)
        gap -= 0.5 * linear.seen
        by_state[..., :3] += 0.5 * linear.by_pose
        by_state[..., 6] += 0.5 * linear.by_heading(poses, moments.position)
        by_state[..., POSE:] += 0.5 * linear.by_feature.reshape(*seen.seen.shape, -1)
    return LinearPrediction(gap, by_state)


def whitened(moments: Moments, predicted: LinearPrediction, noise: Floats) -> tuple[Floats, float]:
    """Whitened innovation (A, 3) of each return by itself for the update, and the normalised square of all together."""
    gap, rows = predicted.gap, np.arange(len(predicted.gap))
    flat = predicted.by_state.reshape(-1, len(moments.mean))
    total = flat @ moments.covariance @ flat.T + np.diag(noise.ravel())
    blocks = total.reshape(len(gap), 3, len(gap), 3)[rows, :, rows, :]
    white = np.linalg.solve(np.linalg.cholesky(blocks), gap[..., None])[..., 0]
    return white, float(gap.ravel() @ np.linalg.solve(total, gap.ravel()))


def trusted(noise: Floats, white: Floats) -> Floats:
    """Variances (A, 3) that the update uses, larger where a return lies far off its prediction."""
    return noise * np.maximum(1.0, (TAIL + np.sum(white**2, axis=1)) / (TAIL + 3.0))[:, None]


def owners(returns: Returns) -> Integers:
    """(A,) landmark that a return updates: its point if it is direct, else the wall next to the point."""
    walls = returns.legs[:, 1]
    first = np.where(walls[returns.rx] != NONE, walls[returns.rx], walls[returns.tx])
    return np.where(first == NONE, returns.point, first)


def update(belief: Nested, seen: Seen, config: NestedConfig, engine: CloudEngine) -> tuple[Nested, float]:
    """Particles updated by all returns, and the log evidence of those that the belief could explain."""
    owner = owners(seen.returns)
    direct = seen.returns.legs[:, 1]
    over_wall = (direct[seen.returns.rx] != NONE) | (direct[seen.returns.tx] != NONE)
    strength = 1.0 / np.sqrt(seen.noise[:, 0])
    rho = strength / strength.mean() if len(strength) else strength
    total = 0.0
    for turn in (False, True):
        for feature in np.unique(owner[over_wall == turn]):
            rows = np.flatnonzero((owner == feature) & (over_wall == turn))
            for first in range(0, len(rows), FUSED):
                sightings = _sightings(belief, int(feature), rows[first : first + FUSED], seen, rho, config)
                belief, evidence = absorb(belief, int(feature), sightings, engine)
                total += evidence if np.isfinite(evidence) else 0.0
    return belief, total


def _sightings(
    belief: Nested, owner: int, rows: Integers, seen: Seen, rho: Floats, config: NestedConfig
) -> list[Sighting]:
    """Returns `rows` as the clouds of one landmark see them in the update, in the order of their kinds, so that kernels
    recur."""
    poses = poses_of(belief.position, belief.heading, seen.body)
    features = belief.mean.copy()
    features[:, owner] = belief.centre[:, owner]
    uncertainty = _uncertainties(belief, owner, seen)
    found = []
    for row in rows:
        lines = tuple(
            trace_sightline(side, int(row), owner, features, seen.anchor, poses) for side in _sides(seen, int(row))
        )
        common = np.array([config.common_length_std, *[config.common_cosine_std] * 2]) ** 2
        variance = seen.noise[row] if config.weighting == "crlb" else common
        covariance = np.diag(variance) + uncertainty[row]
        power = float(rho[row]) if config.weighting == "power" else 1.0
        factor = float(np.log(rho[row])) if config.weighting == "paper" else 0.0
        found.append(Sighting(lines, seen.seen[row], covariance, power, factor))
    return sorted(found, key=lambda sighting: sighting.kind)


def _sides(seen: Seen, row: int) -> list[Returns]:
    """The return that updates, and its twin if it has one."""
    legs = [(side.legs[side.tx[row]].tolist(), side.legs[side.rx[row]].tolist()) for side in (seen.returns, seen.twin)]
    return [seen.returns] if legs[0] == legs[1] else [seen.returns, seen.twin]


def _uncertainties(belief: Nested, owner: int, seen: Seen) -> Floats:
    """(A, 3, 3) covariance that other features' errors, given the trajectory, add to each return of the update.

    They err the same way every cycle, and their share must not average out: what the n-th measurement of the owner
    carries of it counts n times.
    """
    linear = look(gaussian(belief), seen).by_state[..., POSE:].reshape(len(seen.seen), 3, -1, 3)
    linear[:, :, owner] = 0.0
    times = float(belief.updates[owner] + 1)
    return times * np.einsum("aifj,fjk,alfk->ail", linear, mean_covariances(belief), linear)
