"""Excess of motion, how much farther off the agent may be than when calm, where nothing measures how lively it is.

The window's estimate takes each step by its expected precision: that of the calmest motion mode that may be. It is
the better estimate, but the covariance of its error hangs on the expected variance, that of the liveliest. What the
second has over the first is carried along as the error of a Kalman filter with a wrong model is: grown by each step,
and taken in by what is measured (Gelb 1974, chapter 7: suboptimal filter design and sensitivity analysis).
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.returns import AXES


def grow(excess: Floats, dt: float, surplus: Floats) -> Floats:
    """(6, 6) of position and velocity after a step of `dt` [s] whose accelerations (3,) have so much more variance."""
    move = np.eye(6)
    move[:3, 3:] = dt * AXES
    push = np.concatenate([0.5 * dt**2 * AXES, dt * AXES])
    return np.asarray(move @ excess @ move.T + (push * np.maximum(surplus, 0.0)) @ push.T)


def take_in(excess: Floats, before: Floats, after: Floats) -> Floats:
    """(6, 6) what measurements leave that took the calm covariance from `before` to `after` (6, 6 each).

    They leave of any error `after before^-1`; never more than there was.
    """
    scale = np.sqrt(np.maximum(np.diag(before), 1e-18))
    scaled = before / scale / scale[:, None] + 1e-9 * np.eye(6)
    share = np.linalg.solve(scaled, (after / scale).T).T / scale
    left = share @ excess @ share.T
    growth = np.max(np.diag(left) / np.maximum(np.diag(excess), 1e-18))
    return np.asarray(left / max(1.0, growth))
