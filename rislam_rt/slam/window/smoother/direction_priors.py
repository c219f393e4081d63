"""Direction priors, mixtures by which a wall is upright, level or at right angles to another wall, or stands in any
direction."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.window.solver_limits import CERTAIN


class DirectionPriors(NamedTuple):
    """Priors on N single directions of wall features, each a mixture: the wall is upright, level or at right angles to
    another, or stands anyhow."""

    feature: Integers
    """(N,) index of the feature."""
    axis: Floats
    """(N, 3) unit vectors along which the prior tells where the feature lies."""
    aim: Floats
    """(N,) [m] place of the feature along the axis, if the prior holds..."""
    std: Floats
    """(N,) [m] ...and the standard deviation of that."""
    log_odds: Floats
    """(N,) prior log odds that it holds, against a place anywhere along the axis, times the width [m] of that
    alternative."""
    probability: Floats
    """(N,) posterior probability that it holds, at the last evaluation: the weight with which it counts."""

    def pulls(self, places: Floats) -> tuple[Floats, Floats]:
        """Gradients (N, 3) and information (N, 3, 3) that the priors add to the cost of features at `places` (N, 3)."""
        weight = self.probability / self.std**2
        off = np.vecdot(self.axis, places) - self.aim
        along = weight[:, None] * self.axis
        return off[:, None] * along, along[:, :, None] * self.axis[:, None, :]

    def weighed(self, places: Floats, covariance: Floats) -> "DirectionPriors":
        """Priors with the posterior probability that each holds, from what all else tells of the features (the cavity),
        which are at `places` (N, 3) within `covariance` (N, 3, 3)."""
        variance = np.vecdot(self.axis, (covariance @ self.axis[..., None])[..., 0])
        middle, own = np.vecdot(self.axis, places), self.probability / self.std**2
        left = np.maximum(1.0 / variance - own, 1e-3)
        cavity = (middle / variance - own * self.aim) / left
        spread = 1.0 / left + self.std**2
        log_right = -0.5 * (cavity - self.aim) ** 2 / spread - 0.5 * np.log(2.0 * np.pi * spread)
        odds = np.clip(self.log_odds + log_right, -CERTAIN, CERTAIN)
        return self._replace(probability=1.0 / (1.0 + np.exp(-odds)))


def no_holds() -> DirectionPriors:
    """Empty set of direction priors."""
    none = np.zeros(0)
    return DirectionPriors(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), none, none, none, none)
