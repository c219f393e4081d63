"""Attitude of the body in each cycle: a rotation beyond the heading that is told, common to all that the array hears.

An array that sways, or a compass that errs from cycle to cycle, turns all arrivals of a cycle alike. The rotation
vector of a cycle is white, of zero mean, with one deviation for tilt (roll and pitch) and one for yaw. It is a nuisance
of its cycle alone, and is marginalised there (Schur complement); what stays is its estimate, by which the cycle's
cosines are levelled. The deviations are learnt: each is one of a ladder of levels, whose probabilities follow from the
marginal likelihood of each cycle's innovations, as those of the motion modes do.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.solver_limits import SWAYS

AXES = np.array([0, 0, 1])
"""Index of the chain of levels of each axis: roll and pitch share one, yaw has another."""


def levels() -> Floats:
    """Standard deviations (L,) [rad] of the attitude's levels, half a decade apart up to the largest."""
    return _levels(CONSTANTS.sway)


@lru_cache(maxsize=4)
def _levels(largest: float) -> Floats:
    """Levels of attitude up to a given one [rad], cached."""
    return np.asarray(largest * 10.0 ** (-0.5 * np.arange(SWAYS)[::-1]))


def first_levels(*, compass: bool) -> Floats:
    """Initial probabilities (2, L) of the levels of attitude, tilt and yaw; without a `compass` in use there is no yaw
    beside the heading's random walk: (1, L)."""
    weight = 3.0 ** -np.arange(SWAYS, dtype=np.float64)
    return np.tile(weight / weight.sum(), (1 + compass, 1))


def held_level(probability: Floats) -> Floats:
    """Level probabilities (C, L) of a body that is known not to sway."""
    return np.tile(np.eye(SWAYS)[0], (len(probability), 1))


def variance(probability: Floats) -> Floats:
    """Expected variance (A,) [rad^2] of the attitude's roll, pitch and, where there is a compass, yaw, from level
    probabilities."""
    return np.asarray((probability @ levels() ** 2)[AXES[: len(probability) + 1]])


def jacobian(cosines: Floats, axes: int) -> Floats:
    """Derivatives (..., 3, A) of length and measured cosines (..., 2) by the rotation vector of the body: `u x theta`,
    of which the length knows nothing."""
    x, y = cosines[..., 0], cosines[..., 1]
    up = np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))
    found = np.zeros((*x.shape, 3, 3))
    found[..., 1, 1], found[..., 1, 2] = -up, y
    found[..., 2, 0], found[..., 2, 2] = up, -x
    return found[..., :axes]


def levelled(cosines: Floats, rotation: Floats) -> Floats:
    """Cosines (N, 2) turned by rotation vectors (N, 3) [rad] into the axes of a body without these rotations."""
    x, y = cosines.T
    up = np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))
    one, two, three = rotation.T
    # the first two numbers of r + w x r + w x (w x r) / 2
    along, across, rise = two * up - three * y, three * x - one * up, one * y - two * x
    found = x + along + 0.5 * (two * rise - three * across), y + across + 0.5 * (three * along - one * rise)
    return np.array(found).T


def spread(cosines: Floats, covariance: Floats) -> Floats:
    """Variance (N, 3) of length and cosines (N, 2) by an attitude of covariance (A, A)."""
    slopes = jacobian(cosines, len(covariance))
    return np.asarray(((slopes @ covariance) * slopes).sum(axis=-1))


class Attitude(NamedTuple):
    """Gaussian information about the rotation vectors of K cycles, before their prior."""

    information: Floats
    """(K, A, A) [1/rad^2]."""
    slope: Floats
    """(K, A) [1/rad] information times value."""


def foreseen(before: Floats) -> Floats:
    """Level probabilities (C, L) of the attitude one cycle on, before it is heard."""
    return np.asarray(before @ _transition(CONSTANTS.stay, CONSTANTS.rare))


@lru_cache(maxsize=4)
def _transition(stay: float, rare: float) -> Floats:
    """Transition probabilities (L, L) between the levels of attitude: `stay` in one, and `rare` to any other."""
    move = np.full((SWAYS, SWAYS), rare / (SWAYS - 1.0))
    np.fill_diagonal(move, stay)
    return move


def next_levels(before: Floats, told: Attitude) -> Floats:
    """Level probabilities (C, L) after one more cycle, of which `told` (K = 1) knows the rotation with poses and map
    uncertain.

    The marginal likelihood of a level is that of N(0, its variance) under the cycle's likelihood; of the other chain
    it takes the expected variance.
    """
    found = foreseen(before)
    every = _variances(found)
    slope, inner = told.slope[0], _precision(every, told)
    gain = slope @ np.linalg.solve(inner, slope[:, None])
    log_like = 0.5 * gain[..., 0] - 0.5 * np.linalg.slogdet(inner)[1] - 0.5 * np.log(every).sum(axis=-1)
    found = found * np.exp(log_like - log_like.max(axis=1, keepdims=True))
    return np.asarray(found / found.sum(axis=1, keepdims=True))


def _variances(probability: Floats) -> Floats:
    """Variances (C, L, A) [rad^2] of the attitude with one chain at one of its levels, the other as expected."""
    own = AXES[: len(probability) + 1] == np.arange(len(probability))[:, None, None]
    return np.where(own, levels()[:, None] ** 2, variance(probability))


def _precision(every: Floats, told: Attitude) -> Floats:
    """Precisions (..., A, A) of a cycle's rotation with prior variances (..., A)."""
    return np.asarray(told.information[0] + np.eye(every.shape[-1]) / every[..., None, :])


def posterior(variance: Floats, told: Attitude) -> tuple[Floats, Floats]:
    """Means (..., A) [rad] and covariances (..., A, A) of a cycle's rotation with prior variances (..., A) after what
    is `told` of it (K = 1)."""
    covariance = np.asarray(np.linalg.inv(_precision(variance, told)), dtype=np.float64)
    return covariance @ told.slope[0], covariance


class Tilts(NamedTuple):
    """Roll and pitch of one cycle: N equally likely ones for each of the L levels of their deviation."""

    point: Floats
    """(L, N, 2) [rad]."""
    weight: Floats
    """(L, N) probabilities."""


LEVEL_BODY = Tilts(np.zeros((SWAYS, 1, 2)), np.full((SWAYS, 1), 1.0 / SWAYS))
"""The one tilt of a body that is known to be level, whatever the level of its deviation."""


def tilts(probability: Floats, told: Attitude | None) -> Tilts:
    """Tilts (attitude) of a cycle under level probabilities (C, L), and after what is `told` of it (K = 1), if any."""
    weight = np.repeat(probability[0][:, None] / len(UNIT_TILTS), len(UNIT_TILTS), axis=1)
    if told is None:
        return Tilts(UNIT_TILTS * levels()[:, None, None], weight)
    mean, covariance = posterior(_variances(probability)[0], told)
    root = np.linalg.cholesky(covariance[:, :2, :2])
    return Tilts(mean[:, None, :2] + UNIT_TILTS @ np.swapaxes(root, 1, 2), weight)


def _unit_tilts(rings: int, spokes: int) -> Floats:
    """Pairs (N, 2) for attitudes that stand for two independent standard normal numbers: rings of equal probability,
    turned against each other."""
    radius = np.sqrt(-2.0 * np.log1p(-(np.arange(rings) + 0.5) / rings))
    angle = 2.0 * np.pi / spokes * (np.arange(spokes) + np.arange(rings)[:, None] / rings)
    return np.stack([radius[:, None] * np.cos(angle), radius[:, None] * np.sin(angle)], axis=2).reshape(-1, 2)


UNIT_TILTS = _unit_tilts(4, 8)
"""Pairs (N, 2) of standard normal numbers by which tilts are averaged over: a limit of computation."""


class Marginal(NamedTuple):
    """Normal equations of K cycles without their attitudes, and the change of each attitude that these equations ask
    for."""

    hessian: Floats
    """(K, S, S) by pose and features."""
    slope: Floats
    """(K, S)."""
    change: Floats
    """(K, A) [rad]."""


def marginalise(product: Floats, nuisance: Floats, variance: Floats) -> Marginal:
    """Marginalise the attitudes (and heave) of K cycles, whose estimates are `nuisance` (K, Z) and whose prior
    variances are (K, Z), from products (K, S + Z + 1, S + Z + 1) of the slopes by pose and features, those by attitude,
    and residuals."""
    axes = variance.shape[1]
    own, by, out = slice(-1 - axes, -1), slice(0, product.shape[-1] - 1 - axes), -1
    right, cross = product[:, own].copy(), product[:, by, own]
    right[..., out] -= nuisance / variance
    found = np.asarray(np.linalg.solve(right[..., own] + _diagonal(1.0 / variance), right), dtype=np.float64)
    gain, change = found[..., by], found[..., out]
    slope = product[:, by, out] - (cross @ change[..., None])[..., 0]
    return Marginal(product[:, by, by] - cross @ gain, slope, change)


def change(product: Floats, nuisance: Floats, variance: Floats) -> Floats:
    """Changes (K, Z) of the attitudes (and heave) of K cycles, whose estimates are `nuisance` (K, Z) and whose prior
    variances are (K, Z), with poses and features as they are, from products (K, Z + 1, Z + 1) of the slopes by attitude
    and residuals."""
    information = product[:, :-1, :-1] + _diagonal(1.0 / variance)
    pull = product[:, :-1, -1] - nuisance / variance
    return np.asarray(np.linalg.solve(information, pull[..., None])[..., 0])


def _diagonal(values: Floats) -> Floats:
    """Diagonal matrices (K, Z, Z) for attitudes, of values (K, Z)."""
    return np.asarray(values[:, :, None] * np.eye(values.shape[1]))


def likelihood(left: Floats, jacobian: Floats, covariance: Floats, slopes: Floats, prior: Floats) -> Attitude:
    """What innovations `left` (N, 3) tell of the rotation vector of their cycle by slopes (N, 3, A), all in standard
    deviations, while pose and map are uncertain by `covariance` (D, D) through `jacobian` (N, 3, D).

    Weights of Student's t, given the expected variance `prior` (A,), keep single outliers from speaking for all.
    """
    flat, by = jacobian.reshape(-1, jacobian.shape[-1]), slopes.reshape(-1, slopes.shape[-1])
    through = flat @ covariance
    total = 1.0 + np.vecdot(through, flat).reshape(left.shape) + (slopes**2 * prior).sum(axis=-1)
    trust = np.minimum((CONSTANTS.tail + 3.0) / (CONSTANTS.tail + (left**2 / total).sum(axis=1)), 1.0)
    weight = np.repeat(trust, 3)[:, None]
    heard = weight * np.concatenate([by, left.reshape(-1, 1)], axis=1)
    # Woodbury's identity: what pose and map may move is taken out
    inner = np.eye(len(covariance)) + (weight * through).T @ flat
    heard -= weight * (flat @ np.linalg.solve(inner, through.T @ heard))
    return Attitude((by.T @ heard[:, :-1])[None], (by.T @ heard[:, -1])[None])
