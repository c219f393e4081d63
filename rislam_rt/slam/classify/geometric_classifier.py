"""Geometric baseline classifier of tracks: is it a static point, or an image that moves with the agent?

Rate of delay and turning of the arrival against the agent's own motion, by least squares; nothing learnt, no amplitude.
A corner of two walls at right angles moves as a point does, and is taken for one.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.classify.sighting_features import FEATURES, stillness

TURN, TURN_STD = FEATURES.index("turn"), FEATURES.index("turn_std")
"""Columns of `track_features` that hold the turn and the logarithm of its deviation."""
APPROACH, APPROACH_STD = FEATURES.index("approach"), FEATURES.index("approach_std")
"""Columns of `track_features` that hold the approach and the logarithm of its deviation."""


def classify_geometric(features: Floats) -> Floats:
    """Probability (M,) that a track is a landmark's by its motion alone, from features (M, F): see `stillness`."""
    turn, approach = features[:, TURN], features[:, APPROACH]
    return stillness(turn, np.exp(features[:, TURN_STD]), approach, np.exp(features[:, APPROACH_STD]))
