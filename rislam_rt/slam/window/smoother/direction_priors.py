"""Direction priors, mixtures by which a wall is upright, level or at right angles to another wall, or stands in any
direction."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.window.solver_limits import CERTAIN


class DirectionPriors(NamedTuple):
    """Priors on N single directions of wall features, each a mixture: the wall is upright, level or at right angles to
    another, or stands anyhow.

    Gravity tells what is upright. What is at right angles only the other wall tells, with which it turns where the
    heading is estimated, as nothing but the start tells then how the room is turned. With a compass it is the other
    wall as it stood at the birth, which the new one then leaves alone.
    """

    feature: Integers
    """(N,) index of the feature."""
    other: Integers
    """(N,) index of the wall with which it turns, to which it is at right angles or parallel; -1 for none."""
    axis: Floats
    """(N, 3) unit vectors across which the feature lies from its anchor, if the prior holds; of right angles, at the
    last evaluation."""
    anchor: Floats
    """(N, 3) [m] anchors, of which the features are mirror images..."""
    base: Floats
    """(N, 3) [m] ...and those of the other walls."""
    std: Floats
    """(N,) [m] standard deviation of the offset along the axis, if the prior holds."""
    log_odds: Floats
    """(N,) prior log odds that it holds, against a place anywhere along the axis, times the width [m] of that
    alternative."""
    probability: Floats
    """(N,) posterior probability that it holds, at the last evaluation: the weight with which it counts."""

    @property
    def aim(self) -> Floats:
        """Places (N,) [m] of the features along their axes, if the direction priors hold."""
        return np.vecdot(self.axis, self.anchor)

    @property
    def pair(self) -> Integers:
        """Features (N, 2) that the direction priors are about: the own one twice where there is no other wall."""
        return np.stack([self.feature, np.where(self.other < 0, self.feature, self.other)], axis=1)

    def linearised(self, features: Floats) -> tuple["DirectionPriors", Floats]:
        """Direction priors with their axes at `features` (F, 3), and derivatives (N, 2, 3) of the offsets along these
        by each `pair` of features."""
        span, flat = self.offset(features), (features[self.pair[:, 1]] - self.base)[:, :2]
        facing, out = flat @ [1.0, 1j], span[:, :2] @ [1.0, 1j]
        tied, reach = self.other >= 0, np.maximum(np.abs(facing), 1e-6)
        # the nearest of the four directions in which it may lie
        facing = facing / reach * 1j ** np.round(np.angle(out * np.conj(facing)) / (0.5 * np.pi))
        across = np.stack([-facing.imag, facing.real, np.zeros(len(facing))], axis=1)
        axis = np.where(tied[:, None], across, self.axis)
        turn = np.stack([-flat[:, 1], flat[:, 0], np.zeros(len(flat))], axis=1) / reach[:, None] ** 2
        lever = np.where(tied, -(np.conj(facing) * out).real, 0.0)[:, None] * turn
        return self._replace(axis=axis), np.stack([axis, lever], axis=1)

    def offset(self, features: Floats) -> Floats:
        """Places (N, 3) [m] of the features (F, 3) from their anchors."""
        return features[self.feature] - self.anchor

    def pulls(self, features: Floats) -> tuple[Floats, Floats]:
        """Gradients (N, 6) and information (N, 6, 6) that the direction priors add to the cost of each `pair` of the
        features (F, 3)."""
        priors, slopes = self.linearised(features)
        flat = slopes.reshape(-1, 6)
        pull = self.probability / self.std**2 * np.vecdot(priors.axis, self.offset(features))
        weighed = (self.probability / self.std**2)[:, None] * flat
        return pull[:, None] * flat, weighed[:, :, None] * flat[:, None, :]

    def weighed(self, features: Floats, covariance: Floats) -> "DirectionPriors":
        """Direction priors with the posterior probability that each holds, from what all else tells of the features
        (F, 3) (the cavity), each `pair` of which has a covariance (N, 6, 6)."""
        priors, slopes = self.linearised(features)
        flat = slopes.reshape(-1, 6)
        variance = np.vecdot(flat, (covariance @ flat[..., None])[..., 0])
        middle, own = np.vecdot(priors.axis, self.offset(features)), self.probability / self.std**2
        left = np.maximum(1.0 / variance - own, 1e-3)
        cavity, spread = middle / variance / left, 1.0 / left + self.std**2
        log_right = -0.5 * cavity**2 / spread - 0.5 * np.log(2.0 * np.pi * spread)
        odds = np.clip(self.log_odds + log_right, -CERTAIN, CERTAIN)
        return priors._replace(probability=1.0 / (1.0 + np.exp(-odds)))


def no_holds() -> DirectionPriors:
    """Empty set of direction priors."""
    none, nobody, nowhere = np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 3))
    return DirectionPriors(nobody, nobody, nowhere, nowhere, nowhere, none, none, none)
