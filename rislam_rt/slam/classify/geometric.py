"""The baseline: which of two geometries explains a track, a static point or an image that moves with the agent?

Rate of delay and turning of the arrival against the agent's own motion, by least squares; nothing learnt, no amplitude.
A corner of two walls at right angles moves as a point does, and is taken for one.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.classify.features import FEATURES

TURN, TURN_STD = FEATURES.index("turn"), FEATURES.index("turn_std")
APPROACH, APPROACH_STD = FEATURES.index("approach"), FEATURES.index("approach_std")


def classify_geometric(features: Floats) -> Floats:
    """Probability (M,) of keep from rows of features (M, F): static point against one wall, equal priors.

    Each likelihood is Gaussian in the fitted turn and approach. A wall has turn 0 and approach 2 (0 for a pair of
    opposite walls); a landmark's path, images included, a turn of 1 with a spread of 0.35 and an approach of 1.8 with
    a spread of 0.3.
    """
    turn, approach = features[:, TURN], features[:, APPROACH]
    turn_std, approach_std = np.exp(features[:, TURN_STD]), np.exp(features[:, APPROACH_STD])
    static = _log_normal(turn - 1.0, np.hypot(turn_std, 0.35)) + _log_normal(
        approach - 1.8, np.hypot(approach_std, 0.3)
    )
    wall = _log_normal(turn, np.hypot(turn_std, 0.1))
    wall += np.logaddexp(*(_log_normal(approach - a, np.hypot(approach_std, 0.1)) for a in (2.0, 0.0))) - np.log(2.0)
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * (static - wall))))


def _log_normal(miss: Floats, std: Floats) -> Floats:
    return np.asarray(-0.5 * (miss / std) ** 2 - np.log(std))
