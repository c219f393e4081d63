"""Assignment of measurements to what is expected, to tracks, or to neither: what pairs cost, and the best of all."""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.observations import Observations, same_side

DIAGONAL = np.arange(3)


class Candidates(NamedTuple):
    """C predicted returns, of landmarks or tracks, that a measurement may be assigned to."""

    seen: Floats
    """(C, 3) predicted length [m] and cosines."""
    covariance: Floats
    """(C, 3, 3) of the prediction."""
    log_amplitude: Floats
    """(C,)."""
    log_amplitude_std: Floats
    """(C,)."""
    log_odds: Floats
    """(C,) logarithm of the probability that it shows at all."""
    side: Integers
    """(C,) (see `slam.observations`)."""


def cheapest(cost: Floats) -> tuple[Integers, Integers]:
    """Rows and columns of the one assignment of least cost (R, C), of those pairs that lower it."""
    rows, columns = scipy.optimize.linear_sum_assignment(cost)
    good = cost[rows, columns] < 0.0
    return rows[good], columns[good]


def pair_costs(candidates: Candidates, observations: Observations, gate: float, strangers: Floats | float) -> Floats:
    """(C, M): -2 log of the likelihood ratio of each pair against a stranger, 0 where it cannot be.

    A pair competes against "the candidate is missed and the measurement is new or false", of which `strangers` (M,) are
    to be expected per metre, unit of each cosine and e-fold of amplitude; pairs beyond the gate (on
    delay and cosines) do not compete at all.
    """
    noise = np.zeros((len(observations.seen), 3, 3))
    noise[:, DIAGONAL, DIAGONAL] = observations.std**2
    variance = candidates.log_amplitude_std[:, None] ** 2 + observations.log_amplitude_std**2
    fade = (observations.log_amplitude - candidates.log_amplitude[:, None]) ** 2 / variance
    allowed = (fade < gate) & same_side(candidates.side, observations.sides)
    pairs = near_pairs(candidates.seen, candidates.covariance, observations.seen, noise, allowed, gate)
    at = pairs.row, pairs.column
    cost = pairs.distance + fade[at] + pairs.log_det + np.log(variance[at]) + 4.0 * np.log(2.0 * np.pi)
    cost += (
        2.0 * np.log(np.broadcast_to(strangers, fade.shape[1:])[pairs.column]) - 2.0 * candidates.log_odds[pairs.row]
    )
    costs = np.zeros(fade.shape)
    costs[at] = np.minimum(cost, 0.0)
    return costs


class Pairs(NamedTuple):
    """P pairs of predictions whose gap lies within the gate."""

    row: Integers
    """(P,) among the first."""
    column: Integers
    """(P,) among the second."""
    distance: Floats
    """(P,) squared Mahalanobis distance."""
    log_det: Floats
    """(P,) of the gap's covariance."""


def near_pairs(
    first: Floats, first_spread: Floats, second: Floats, second_spread: Floats, allowed: Booleans, gate: float
) -> Pairs:
    """Pairs of (A, 3) and (B, 3), with covariances (A, 3, 3) and (B, 3, 3), that are `allowed` (A, B) and in the gate.

    No distance is less than that along one axis alone, so that few pairs need a matrix.
    """
    own, other = (np.diagonal(spread, axis1=1, axis2=2) for spread in (first_spread, second_spread))
    row, column = (allowed & within(first[:, 0], own[:, 0], second[:, 0], other[:, 0], gate)).nonzero()
    close = ((first[row] - second[column]) ** 2 <= gate * (own[row] + other[column])).all(axis=1)
    row, column = row[close], column[close]
    distance, log_det = squared_distance(first[row] - second[column], first_spread[row] + second_spread[column])
    inside = distance < gate
    return Pairs(row[inside], column[inside], distance[inside], log_det[inside])


def within(first: Floats, variance: Floats, second: Floats, other: Floats, gate: float) -> Booleans:
    """(A, B) whether the gaps between (A,) and (B,), with these variances, lie in the gate."""
    return np.asarray((first[:, None] - second) ** 2 <= gate * (variance[:, None] + other))


def squared_distance(gap: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Squared Mahalanobis lengths (...,) of gaps (..., 3), and log determinants of their covariances (..., 3, 3)."""
    inverse, log_det = inverse_3x3(covariance)
    return np.vecdot(gap, (inverse @ gap[..., None])[..., 0]), log_det


def inverse_3x3(matrix: Floats) -> tuple[Floats, Floats]:
    """Inverses (..., 3, 3) and log determinants (...,) of symmetric positive matrices, in closed form."""
    a, b, c = matrix[..., 0, 0], matrix[..., 0, 1], matrix[..., 0, 2]
    d, e, f = matrix[..., 1, 1], matrix[..., 1, 2], matrix[..., 2, 2]
    ca, cb, cc = d * f - e * e, c * e - b * f, b * e - c * d
    det = np.maximum(a * ca + b * cb + c * cc, 1e-300)
    inverse = np.empty(matrix.shape)
    inverse[..., 0, 0], inverse[..., 1, 1], inverse[..., 2, 2] = ca, a * f - c * c, a * d - b * b
    inverse[..., 0, 1] = inverse[..., 1, 0] = cb
    inverse[..., 0, 2] = inverse[..., 2, 0] = cc
    inverse[..., 1, 2] = inverse[..., 2, 1] = b * c - a * e
    inverse /= det[..., None, None]
    return inverse, np.log(det)
