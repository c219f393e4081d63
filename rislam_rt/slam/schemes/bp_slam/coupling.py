"""What an agent and a feature that it has seen have in common.

Belief propagation keeps one belief a variable. But the error of a feature is, to a large part, the agent's error when
it was seen; a filter that forgets so takes the feature for independent evidence of where the agent is, again and again,
and drifts off with it. Here a feature's belief is a cloud about a line, `a = r + (x - mean) slope`: the residual `r` is
independent of the agent's state `x` (position and velocity), the slope is the regression of `a` on `x`. With a slope of
zero this is the published form.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.schemes.bp_slam.features import Features

TRUST = 0.3
"""Spread of a feature [m] beyond which it is still a ring or an arc, and no line describes it."""


def carry(features: Features, before: Floats, after: Floats) -> Features:
    """The same beliefs about the agent's states (N, 2D) after a motion, particle by particle."""
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


def regress(states: Floats, cloud: Floats, weight: Floats, mean_after: Floats) -> tuple[Floats, Floats]:
    """Residual clouds (K, N, D) about an agent at `mean_after` (2D,), and slopes (K, 2D, D).

    Parameters
    ----------
    states
        (K, N, 2D) agent state that goes with each particle.
    cloud
        (K, N, D) the feature's position in that state.
    weight
        (K, N), every row summing to one.
    """
    middle = np.einsum("kn,knp->kp", weight, states)[:, None]
    centre = np.einsum("kn,knd->kd", weight, cloud)[:, None]
    off, lean = cloud - centre, states - middle
    scale = np.sqrt(np.einsum("kn,knp->kp", weight, lean**2))[:, None]
    lean = lean / np.maximum(scale, 1e-12)
    weighted = np.swapaxes(lean * weight[..., None], 1, 2)
    gram = weighted @ lean + _RIDGE * np.eye(states.shape[2])
    spread = np.einsum("kn,knd->k", weight, off**2) / cloud.shape[2]
    trust = 1.0 / (1.0 + (spread / TRUST**2) ** 2)
    trust = np.where(trust > 0.01, trust, 0.0)
    slope = np.linalg.solve(gram, weighted @ off) * trust[:, None, None] / np.maximum(np.swapaxes(scale, 1, 2), 1e-12)
    return cloud - (states - mean_after) @ slope, slope


_RIDGE = 1e-6
"""Keeps the regression solvable where the agent's cloud is flat, as with a known height."""
