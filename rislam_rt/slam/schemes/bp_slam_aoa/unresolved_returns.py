"""Unresolved returns of features: the probability that one merges into a louder one, and how neighbours pull it."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import SensorModel
from rislam_rt.model.sensor import merged_pull
from rislam_rt.slam.schemes.bp_slam_aoa.gaussian_features import GaussianFeatures, PredictedReturns


def unresolved_neighbours(
    features: GaussianFeatures, predicted: PredictedReturns, detection: Floats, sensor: SensorModel
) -> tuple[Floats, ...]:
    """Probability (C,) that a return merges into a louder one; mean (C, 3) and covariance of neighbours' pull."""
    weight = features.existence[features.owner] * features.share * detection
    sure = np.flatnonzero(weight > 0.1)
    weight = weight[sure]
    gap = predicted.seen[sure] - predicted.seen[:, None]
    close = sensor.may_merge(gap / np.array([SPEED_OF_LIGHT, 1.0, 1.0]))
    close &= features.owner[:, None] != features.owner[sure]
    louder = predicted.log_amplitude[sure] - predicted.log_amplitude[:, None]
    held = np.where(close, weight, 0.0)
    hidden = 1.0 - np.prod(1.0 - np.where(louder > 0.0, held, 0.0), axis=1)
    mean, variance = merged_pull(np.exp(np.minimum(louder, 0.0)))
    fainter = np.where(louder > 0.0, 0.0, held)
    pull = np.einsum("co,coi->ci", fainter * mean, gap)
    second = fainter * (variance + (1.0 - fainter) * mean**2)
    return hidden, pull, np.einsum("co,coi,coj->cij", second, gap, gap)
