"""Coupling: what an agent and a feature that it has seen have in common.

Belief propagation keeps one belief a variable. But the error of a feature is, to a large part, the agent's error when
it was seen; a filter that forgets so takes the feature for independent evidence of where the agent is, again and again,
and drifts off with it. Here a feature's belief is a cloud about a line, `a = r + (x - mean) slope`: the residual `r` is
independent of the agent's state `x` (position and velocity), the slope is the regression of `a` on `x`. With a slope of
zero this is the published form.
"""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.schemes.bp_slam_static.features import Features
from rislam_rt.slam.schemes.shared.resampling import cell_levels

FLOOR_STD = 1e-3
"""Thinnest a cell is taken for [m]."""


def carry(features: Features, before: Floats, after: Floats) -> Features:
    """Beliefs of features coupled to the agent's new states (N, 2D) after a motion, particle by particle."""
    rows = np.flatnonzero(features.slope.any(axis=(1, 2)))
    if not len(rows):
        return features
    old, new = before - before.mean(axis=0), after - after.mean(axis=0)
    scale = np.maximum(new.std(axis=0), 1e-12)
    gram = (new / scale).T @ (new / scale) + _RIDGE * len(new) * np.eye(len(scale))
    transfer = np.linalg.solve(gram, (new / scale).T @ old) / scale[:, None]
    slope, cloud = features.slope.copy(), features.cloud.copy()
    slope[rows] = transfer @ slope[rows]
    cloud[rows] += old @ features.slope[rows] - new @ slope[rows]
    return features._replace(slope=slope, cloud=cloud)


def correct_slopes(features: Features, gains: Floats, state: Floats, shifts: Integers, thickness: float) -> Floats:
    """Slopes (K, 2D, D) that couple features to the agent, after every pair of particles had its factor.

    Before, residual and agent are independent; what the factors make of that is added to the slope. It is taken cell by
    cell of the residual's cloud, each with the inverse of its covariance: along an arc a feature is unknown, across it
    it is known well, and it is there that the agent's error shows. The covariance of the same pairs without factors,
    which is chance alone, is taken off.

    Parameters
    ----------
    gains
        (K, S, N) factor of feature particle n with agent particle n + shift.
    state
        (N, 2D) of the agent.
    thickness
        What a ring is thick [m]: a cell is made so short that its bend does not exceed this.
    """
    lean = state - state.mean(axis=0)
    scale = np.maximum(lean.std(axis=0), 1e-12)
    lean = lean / scale
    factor, chance = _met_states(gains, lean, shifts), _met_states(np.ones((1, *gains.shape[1:])), lean, shifts)
    weight = features.weight
    levels = _cell_count(features.cloud, weight, thickness)
    change = np.zeros(features.slope.shape)
    for level in np.unique(levels):
        rows = np.flatnonzero(levels == level)
        change[rows] = _cell_change(
            features.cloud[rows], weight[rows], gains[rows].mean(axis=1), factor[rows], chance, 1 << int(level)
        )
    gram = _agent_moments(gains, weight, lean, shifts)
    return features.slope + np.linalg.solve(gram, change) / scale[:, None]


def _met_states(gains: Floats, lean: Floats, shifts: Integers) -> Floats:
    """Mean (K, N, 2D) of factor times state over the agents that each coupled particle met."""
    twice, count = np.concatenate([lean, lean]), len(lean)
    total = np.zeros((len(gains), count, lean.shape[1]))
    for row, shift in enumerate(shifts):
        total += gains[:, row, :, None] * twice[shift : shift + count]
    return total / len(shifts)


def _agent_moments(gains: Floats, weight: Floats, lean: Floats, shifts: Integers) -> Floats:
    """Covariance (K, 2D, 2D) of the agent's scaled state under the factors of each coupled feature."""
    count, width = lean.shape
    products = np.concatenate(
        [np.ones((count, 1)), lean, (lean[:, :, None] * lean[:, None]).reshape(count, -1)], axis=1
    )
    twice = np.concatenate([products, products])
    total = np.zeros((len(gains), products.shape[1]))
    for row, shift in enumerate(shifts):
        total += (weight * gains[:, row]) @ twice[shift : shift + count]
    total /= total[:, :1]
    mean = total[:, 1 : 1 + width]
    return total[:, 1 + width :].reshape(-1, width, width) - mean[:, :, None] * mean[:, None] + _RIDGE * np.eye(width)


def _cell_count(cloud: Floats, weight: Floats, thickness: float) -> Integers:
    """Levels (K,) of the split that make a cell of each cloud as straight as it is thick, for its slope."""
    dims, most = cloud.shape[2], cell_levels(cloud.shape[1])
    centre = np.einsum("kn,knd->kd", weight, cloud)
    spread = np.sqrt(np.einsum("kn,knd->k", weight, (cloud - centre[:, None]) ** 2))
    pieces = 2.0 * spread / np.sqrt(2.0 * np.maximum(np.maximum(spread, 3.0) * thickness, 1e-12))
    levels = np.ceil((dims - 1) * np.log2(np.maximum(pieces, 1.0)))
    return np.minimum(levels, most).astype(np.int64)


def _cell_change(cloud: Floats, weight: Floats, gain: Floats, factor: Floats, chance: Floats, cells: int) -> Floats:
    """Covariance (K, 2D, D) of agent's state and feature's residual, over cells weighted by their precision."""
    count, dims, width = len(cloud), cloud.shape[2], factor.shape[2]
    r = cloud.reshape(count, cells, -1, dims)
    before, after = (x.reshape(count, cells, -1, 1) for x in (weight, weight * gain))
    factor, chance = (weight[..., None] * x for x in (factor, chance))
    factor, chance = (x.reshape(count, cells, -1, width) for x in (factor, chance))
    mass = np.maximum(before.sum(axis=2, keepdims=True), 1e-300)
    mean = np.sum(before * r, axis=2, keepdims=True) / mass
    r = r - mean
    precision = np.linalg.inv(np.swapaxes(before * r, 2, 3) @ r / mass + FLOOR_STD**2 * np.eye(dims))
    share = after.sum(axis=2)[..., None]
    share = share / np.maximum(share.sum(axis=1, keepdims=True), 1e-300)
    cross = share * (_cross(factor, after, r) - _cross(chance, before, r))
    return np.sum(cross @ precision, axis=1) @ np.linalg.inv(np.sum(share * precision, axis=1))


def _cross(state: Floats, weight: Floats, r: Floats) -> Floats:
    """Covariance (K, C, 2D, D) of state and residual in every cell, from weighted sums of states (K, C, N, 2D)."""
    mass = np.maximum(weight.sum(axis=2, keepdims=True), 1e-300)
    mean = np.sum(weight * r, axis=2, keepdims=True) / mass
    return np.swapaxes(state, 2, 3) @ (r - mean) / mass


_RIDGE = 1e-6
"""Keeps the regression solvable where the agent's cloud is flat, as with a known height."""
