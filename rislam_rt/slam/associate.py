"""Data association: one assignment a cycle of measurements to expected returns, tracks, or neither."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.tracks import Glance


class Candidates(NamedTuple):
    """C things that a measurement may belong to."""

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


def associate(candidates: Candidates, glance: Glance, gate: float, clutter_density: float) -> Integers:
    """Measurement (C,) of each candidate, -1 for none: the assignment of the highest likelihood.

    A pair competes against "the candidate is missed and the measurement is new or clutter"; pairs beyond the gate (on
    delay and cosines) do not compete at all.
    """
    chosen = np.full(len(candidates.seen), -1)
    if not len(candidates.seen) or not len(glance.seen):
        return chosen
    cost = pair_costs(candidates, glance, gate, clutter_density)
    rows, columns = linear_sum_assignment(cost)
    good = cost[rows, columns] < 0.0
    chosen[rows[good]] = columns[good]
    return chosen


def pair_costs(candidates: Candidates, glance: Glance, gate: float, clutter_density: float) -> Floats:
    """(C, M): -2 log of the likelihood ratio of each pair against clutter, 0 where it cannot be."""
    count, shown = len(candidates.seen), len(glance.seen)
    noise = np.zeros((shown, 3, 3))
    noise[:, [0, 1, 2], [0, 1, 2]] = glance.std**2
    total = candidates.covariance[:, None] + noise[None]
    miss = glance.seen[None] - candidates.seen[:, None]
    inverse, log_det = inverse_3x3(total)
    distance = np.einsum("cmi,cmij,cmj->cm", miss, inverse, miss)
    variance = candidates.log_amplitude_std[:, None] ** 2 + glance.log_amplitude_std[None] ** 2
    fade = (glance.log_amplitude[None] - candidates.log_amplitude[:, None]) ** 2 / variance
    cost = distance + fade + log_det + np.log(variance) + 4.0 * np.log(2.0 * np.pi)
    cost += 2.0 * np.log(clutter_density) - 2.0 * candidates.log_odds[:, None]
    return np.where((distance < gate) & (fade < gate), np.minimum(cost, 0.0), 0.0).reshape(count, shown)


def inverse_3x3(matrix: Floats) -> tuple[Floats, Floats]:
    """Inverses (..., 3, 3) and log determinants (...,) of symmetric positive matrices, in closed form."""
    a, b, c = matrix[..., 0, 0], matrix[..., 0, 1], matrix[..., 0, 2]
    d, e, f = matrix[..., 1, 1], matrix[..., 1, 2], matrix[..., 2, 2]
    ca, cb, cc = d * f - e * e, c * e - b * f, b * e - c * d
    det = np.maximum(a * ca + b * cb + c * cc, 1e-300)
    inverse = np.stack(
        [ca, cb, cc, cb, a * f - c * c, b * c - a * e, cc, b * c - a * e, a * d - b * b], axis=-1
    ).reshape(*matrix.shape)
    return inverse / det[..., None, None], np.log(det)
