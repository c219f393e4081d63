"""Stillness of a track: whether a static point or an image that moves with the agent explains its motion."""

import numpy as np

from rislam_rt.arrays import Floats


def stillness(turn: Floats, turn_std: Floats, approach: Floats, approach_std: Floats) -> Floats:
    """Probability (M,) that a track is a static point's, not a wall's, from fitted turn and approach; equal priors.

    Each likelihood is Gaussian in the fitted turn and approach. A wall has turn 0 and approach 2 (0 for a pair of
    opposite walls); a landmark's path, images included, a turn of 1 with a spread of 0.35 and an approach of 1.8 with
    a spread of 0.3.
    """
    static = _log_normal(turn - 1.0, np.hypot(turn_std, 0.35)) + _log_normal(
        approach - 1.8, np.hypot(approach_std, 0.3)
    )
    wall = _log_normal(turn, np.hypot(turn_std, 0.1))
    wall += np.logaddexp(*(_log_normal(approach - a, np.hypot(approach_std, 0.1)) for a in (2.0, 0.0))) - np.log(2.0)
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * (static - wall))))


def _log_normal(miss: Floats, std: Floats) -> Floats:
    """Log density of a normal, without its constant."""
    return np.asarray(-0.5 * (miss / std) ** 2 - np.log(std))
