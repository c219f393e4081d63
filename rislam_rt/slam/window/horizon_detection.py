"""Horizon detection: whether a return arrives above the plane of an array that looks up, while the body sways.

An array that looks up is blind below its own plane. Returns of upright walls are level: a body that sways turns some of
them below that plane, those of one side at a time. A return whose elevation is known within a normal deviation, and
that a level body hears, arrives above the plane of a tilted one with a probability in closed form. Which returns are
heard in a cycle and which are not tells, the other way round, how the body is tilted in it.
"""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.smoother import attitude
from rislam_rt.slam.window.smoother.attitude import Tilts

FARTHEST = 6.0
"""Standard deviations of elevation beyond which a return stays above the plane: a limit of computation (1e-9)."""


class Elevations(NamedTuple):
    """Predicted elevations of returns for a level body."""

    rise: Floats
    """(R,) sine of the elevation..."""
    std: Floats
    """(R,) ...and its standard deviation."""
    slopes: Floats
    """(R, 2) derivatives by roll and pitch."""

    def near(self, largest: float) -> Booleans:
        """Which returns (R,) a tilt of up to `largest` [rad] may turn below the plane of the array."""
        return np.asarray(self.rise < largest + FARTHEST * self.std)


def elevations(rise: Floats, std: Floats, cosines: Floats) -> Elevations:
    """Predicted elevations of returns of sines (R,), standard deviations (R,) and direction cosines (R, 2)."""
    return Elevations(rise, std, np.stack([-cosines[:, 1], cosines[:, 0]], axis=1))


def above(returns: Elevations, lift: Floats, variance: Floats | float = 0.0) -> Floats:
    """Probability (..., R) that returns which a level body hears arrive above the plane of one whose tilt lifts them by
    sines `lift` (..., R), of that `variance`.

    That a level body hears them cuts the normal density of their elevation off at the plane.
    """
    std = np.maximum(returns.std, ROUNDING)
    margin = returns.rise + CONSTANTS.grazing
    heard = scipy.special.log_ndtr(margin / std)
    return np.exp(np.minimum(scipy.special.log_ndtr((margin + lift) / np.sqrt(std**2 + variance)) - heard, 0.0))


ROUNDING = 1e-5
"""Least standard deviation of an elevation: a tenth of a millimetre at ten metres."""


def above_under(returns: Elevations, tilts: Tilts) -> Floats:
    """Probability (L, N, R) that returns arrive above the plane of the array under each of some tilts."""
    found = np.ones((*tilts.point.shape[:2], len(returns.rise)))
    near = returns.near(float(np.abs(tilts.point).max())).nonzero()[0]
    some = Elevations._make(field[near] for field in returns)
    found[..., near] = above(some, tilts.point @ some.slopes.T)
    return found


def expected_above(returns: Elevations, tilts: Tilts) -> Floats:
    """Probability (R,) that returns arrive above the plane of the array, averaged over its tilts."""
    return np.tensordot(tilts.weight, above_under(returns, tilts), 2)


class HorizonEvidence(NamedTuple):
    """What the returns that were heard in a cycle, and those that were not, tell of the tilt, and the tilt of them."""

    level: Floats
    """(L,) probabilities of the levels of the tilt's deviation."""
    above: Floats
    """(R,) probability that each return arrives above the plane, given what is heard of the other ones."""
    gain: float
    """Log likelihood of what is heard and what is not, all under one tilt, over that of each under a tilt of its
    own."""


def weigh_tilts(returns: Elevations, shows: Floats, asked: Booleans, heard: Booleans, tilts: Tilts) -> HorizonEvidence:
    """Weigh the tilts of a cycle by which of the returns that are `asked` (R,), and detected with probabilities
    `shows` (R,) were they above the plane, are `heard` (R,)."""
    over = above_under(returns, tilts)
    show, hit = shows * over, asked & heard
    # what is heard may be something else there
    chance = np.where(hit, CONSTANTS.rare + (1.0 - CONSTANTS.rare) * over, np.where(asked, 1.0 - show, 1.0))
    apart = np.log(np.tensordot(tilts.weight, chance, 2)).sum()
    log_like = np.log(chance).sum(axis=2)
    weight = tilts.weight * np.exp(log_like - log_like.max())
    total = weight.sum()
    weight /= total
    silent = 1.0 / np.tensordot(weight, 1.0 / np.where(asked & ~heard, 1.0 - show, 1.0), 2)
    rest = (1.0 - silent) / np.maximum(shows, CONSTANTS.rare)
    found = np.where(asked & ~heard, np.minimum(rest, 1.0), np.tensordot(weight, over, 2))
    return HorizonEvidence(weight.sum(axis=1), found, float(np.log(total) + log_like.max() - apart))


def prior_tilts(probability: Floats) -> Tilts:
    """Tilts of a cycle before it is heard, from probabilities (C, L) of the levels of its deviations."""
    return attitude.tilts(attitude.foreseen(probability), None)
