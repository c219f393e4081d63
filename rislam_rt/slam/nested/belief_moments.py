"""Moments (mean, covariance) of the nested filter's belief: all that births, association and map ask of it."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers

POSE = 7
"""Numbers of the pose: position, velocity, heading. The features, three numbers each, follow them."""


class Moments(NamedTuple):
    """The belief's first two moments over pose and F features."""

    mean: Floats
    """(7 + 3F,) position [m], velocity [m/s], heading [rad], features [m]."""
    covariance: Floats
    """(7 + 3F, 7 + 3F)."""

    @property
    def position(self) -> Floats:
        """(3,) [m] mean position of the belief's moments."""
        return self.mean[:3]

    @property
    def velocity(self) -> Floats:
        """(3,) [m/s] mean velocity of the belief's moments."""
        return self.mean[3:6]

    @property
    def heading(self) -> float:
        """[rad] mean heading of the belief's moments."""
        return float(self.mean[6])

    @property
    def features(self) -> Floats:
        """(F, 3) [m] mean places of features by the belief's moments."""
        return self.mean[POSE:].reshape(-1, 3)

    def block(self, feature: int) -> Floats:
        """(3, 3) [m^2] covariance of one feature in the belief's moments."""
        return self.covariance[where(feature), where(feature)]

    def columns(self, features: Integers) -> Integers:
        """Columns (3P,) of some features in the belief's moments."""
        return np.asarray((POSE + 3 * np.asarray(features, dtype=np.int64)[:, None] + np.arange(3)).ravel())


def where(feature: int) -> slice:
    """Columns of one feature in the moments."""
    return slice(POSE + 3 * feature, POSE + 3 * feature + 3)


def normalised(log_weight: Floats) -> tuple[Floats, float]:
    """Log weights that sum to one, and the logarithm of what they summed to; hopeless weights become equal ones."""
    top = float(np.max(log_weight))
    if not np.isfinite(top):
        return np.full(len(log_weight), -np.log(len(log_weight))), -np.inf
    total = top + float(np.log(np.sum(np.exp(log_weight - top))))
    return log_weight - total, total
