"""Direction priors: walls are believed to be upright, level, or at right angles to another, or are not."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers


class DirectionPriors(NamedTuple):
    """N beliefs about single directions of features: a wall is upright, level, at right angles to another, or not."""

    feature: Integers
    """(N,)."""
    axis: Floats
    """(N, 3) unit vectors."""
    aim: Floats
    """(N,) [m] where the feature lies along the axis, if the belief is right..."""
    std: Floats
    """(N,) [m] ...within so much."""
    log_odds: Floats
    """(N,) beforehand: of "right" against a place anywhere along the axis, times its width [m]."""
    probability: Floats
    """(N,) that it is right, at the last look: the weight with which it counts."""

    def pulls(self, places: Floats) -> tuple[Floats, Floats]:
        """Gradients (N, 3) and information (N, 3, 3) of what is held of features at `places` (N, 3)."""
        weight = self.probability / self.std**2
        off = np.vecdot(self.axis, places) - self.aim
        along = weight[:, None] * self.axis
        return off[:, None] * along, along[:, :, None] * self.axis[:, None, :]

    def weighed(self, places: Floats, covariance: Floats) -> "DirectionPriors":
        """Each by what all else tells of it (its cavity), the features being at `places` (N, 3) within `covariance`
        (N, 3, 3): is it right?"""
        variance = np.vecdot(self.axis, (covariance @ self.axis[..., None])[..., 0])
        middle, own = np.vecdot(self.axis, places), self.probability / self.std**2
        left = np.maximum(1.0 / variance - own, 1e-3)
        cavity = (middle / variance - own * self.aim) / left
        spread = 1.0 / left + self.std**2
        log_right = -0.5 * (cavity - self.aim) ** 2 / spread - 0.5 * np.log(2.0 * np.pi * spread)
        odds = np.clip(self.log_odds + log_right, -30.0, 30.0)
        return self._replace(probability=1.0 / (1.0 + np.exp(-odds)))


def no_holds() -> DirectionPriors:
    """Nothing believed beforehand."""
    none = np.zeros(0)
    return DirectionPriors(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), none, none, none, none)
