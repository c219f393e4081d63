"""Horizon detection: whether a return arrives above the plane of an array that looks up, while the body sways.

An array that looks up is blind below its own plane. Returns of upright walls are level: a body that sways turns some of
them below that plane, those of one side at a time. Which returns are heard in a cycle and which are not tells how the
body is tilted in it; and over the cycles, whether a return comes in level or from a little above, of which direction
cosines know next to nothing.
"""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.smoother import attitude
from rislam_rt.slam.window.smoother.attitude import Tilts

GRAZING = 1e-3
"""Sine of the depth below its own plane down to which an array that looks up still hears: level returns come in
level."""
RISES = 1e-3 * np.array(
    [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 18.0, 22.0, 27.0, 33.0, 40.0]
)
"""Sines (Z,) of elevation at which a density of it is held, up to twice the largest deviation of the tilt."""
WIDTHS = np.gradient(RISES)
"""Width (Z,) that each stands for."""


class Elevations(NamedTuple):
    """Predicted elevations of R returns for a level body, by the map alone."""

    rise: Floats
    """(R,) sine of the elevation..."""
    std: Floats
    """(R,) ...and its standard deviation."""
    slopes: Floats
    """(R, 2) derivatives by roll and pitch."""


def elevations(rise: Floats, std: Floats, cosines: Floats) -> Elevations:
    """Predicted elevations over the horizon of returns of sines (R,), standard deviations (R,) and direction cosines
    (R, 2)."""
    return Elevations(rise, std, cosines[:, ::-1] * [-1.0, 1.0])


def nothing_heard(count: int) -> Floats:
    """Log likelihoods (R, Z) of the elevations of so many returns that were not looked for so far."""
    return np.zeros((count, len(RISES)))


class _Near(NamedTuple):
    """Those returns whose detection a tilt may change."""

    row: Floats
    share: Floats
    """(N, Z) probabilities of their elevations."""
    slopes: Floats


def _near(returns: Elevations, log_like: Floats) -> _Near:
    """Returns near the horizon, by the map and by the log likelihoods (R, Z) of what was heard of them.

    A level body hears them: their elevation is at the plane at least.
    """
    row = (returns.rise < RISES[-1] + 3.0 * returns.std).nonzero()[0]
    off = (RISES - returns.rise[row, None]) / np.maximum(returns.std[row], WIDTHS[0])[:, None]
    log_share = log_like[row] - 0.5 * off**2
    share = WIDTHS * np.exp(log_share - log_share.max(axis=1, keepdims=True))
    return _Near(row, share / share.sum(axis=1, keepdims=True), returns.slopes[row])


def _above(near: _Near, tilts: Tilts) -> tuple[Floats, Integers]:
    """Probability (L, N, R) that near returns arrive above the plane of the array under each tilt, and the lowest of
    the elevations (L, N, R) at which they do so, as an index; `len(RISES)` for none."""
    lowest = np.searchsorted(GRAZING + RISES, -(tilts.point @ near.slopes.T))
    beyond = np.zeros((len(near.row), len(RISES) + 1))
    beyond[:, :-1] = near.share[:, ::-1].cumsum(axis=1)[:, ::-1]
    return beyond[np.arange(len(beyond)), lowest], lowest


def expected_above(returns: Elevations, log_like: Floats, tilts: Tilts) -> Floats:
    """Probability (R,) that returns arrive above the plane of the array, averaged over its tilts."""
    near, found = _near(returns, log_like), np.ones(len(returns.rise))
    found[near.row] = _averaged(tilts.weight, _above(near, tilts)[0])
    return found


def _averaged(weight: Floats, value: Floats) -> Floats:
    """Means (R,) of values (L, N, R) of near returns over the tilts, by weights (L, N)."""
    return np.asarray(weight.ravel() @ value.reshape(weight.size, -1))


def above_within(returns: Elevations, lift: Floats, variance: Floats) -> Floats:
    """Probability (R,) that returns of which nothing was heard arrive above the plane of an array whose tilt lifts each
    by a sine of mean `lift` (R,) and that `variance` (R,)."""
    near, found = _near(returns, nothing_heard(len(returns.rise))), np.ones(len(returns.rise))
    margin = lift[near.row, None] + GRAZING + RISES
    found[near.row] = (near.share * scipy.special.ndtr(margin / np.sqrt(variance[near.row, None]))).sum(axis=1)
    return found


def level_above(returns: Elevations, log_like: Floats, tilts: Tilts) -> Floats:
    """Probability (L, R) that returns arrive above the plane of the array, under each level of the tilt's deviation,
    before anything is heard in the cycle."""
    near, found = _near(returns, log_like), np.ones((len(tilts.weight), len(returns.rise)))
    found[:, near.row] = _above(near, tilts)[0].mean(axis=1)
    return found


class HorizonEvidence(NamedTuple):
    """What the returns that were heard in a cycle, and those that were not, tell of the tilt, and the tilt of them."""

    tilts: Tilts
    """The tilts with the weights that this leaves them."""
    above: Floats
    """(R,) probability that each return arrives above the plane, given what is heard of the other ones."""
    log_like: Floats
    """(R, Z) log likelihoods of the returns' elevations by all that was heard of them."""
    gain: float
    """Log likelihood of what is heard and what is not, all under one tilt, over that of each under a tilt of its
    own."""


def weigh_tilts(
    returns: Elevations, log_like: Floats, shows: Floats, asked: Booleans, heard: Booleans, tilts: Tilts
) -> HorizonEvidence:
    """Weigh the tilts of a cycle by which of the returns that are `asked` (R,), and detected with probabilities
    `shows` (R,) were they above the plane, are `heard` (R,)."""
    near, above = _near(returns, log_like), np.ones(len(returns.rise))
    if not len(near.row):
        return HorizonEvidence(tilts, above, log_like, 0.0)
    (each, lowest), row, fresh = _above(near, tilts), near.row, log_like.copy()
    chance = _chance(each, shows[row], asked[row], heard[row])
    joint = np.log(chance).sum(axis=2)
    weight = tilts.weight * np.exp(joint - joint.max())
    total = weight.sum()
    # each return by what the others tell
    others = weight[..., None] / chance
    others /= others.sum(axis=(0, 1))
    above[row] = (others * each).sum(axis=(0, 1))
    size = len(RISES) + 1
    first = np.bincount((lowest + size * np.arange(len(row))).ravel(), others.ravel(), size * len(row))
    by_rise = first.reshape(-1, size)[:, :-1].cumsum(axis=1).T
    fresh[row] += np.log(_chance(by_rise, shows[row], asked[row], heard[row])).T
    apart = np.log(_averaged(tilts.weight, chance)).sum()
    gain = float(np.log(total) + joint.max() - apart)
    return HorizonEvidence(tilts._replace(weight=weight / total), above, fresh, gain)


def _chance(above: Floats, shows: Floats, asked: Booleans, heard: Booleans) -> Floats:
    """Probability (..., R) of what was heard of returns above the horizon with probabilities `above`; what is heard
    where a return should be may be something else."""
    below = np.where(asked & heard, CONSTANTS.rare, 1.0)
    return below + above * np.where(asked, np.where(heard, 1.0 - CONSTANTS.rare, -shows), 0.0)


def prior_tilts(probability: Floats) -> Tilts:
    """Tilts of the horizon in a cycle before it is heard, from probabilities (C, L) of the levels of its deviations."""
    return attitude.tilts(attitude.foreseen(probability), None)
