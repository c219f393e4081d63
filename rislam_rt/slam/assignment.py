"""Assignment of measured components to predicted returns or tracks: what each pair costs, and the least cost of all."""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.observations import UNTOLD, Observations

DIAGONAL = np.arange(3)
"""Index of the diagonal of a 3 x 3 matrix."""


class Candidates(NamedTuple):
    """C predicted returns, of landmarks or tracks, to which measurements may be assigned."""

    seen: Floats
    """Predicted lengths [m] and cosines (C, 3)."""
    covariance: Floats
    """Covariances (C, 3, 3) of the predicted lengths and cosines."""
    log_amplitude: Floats
    """Predicted log amplitudes (C,)."""
    log_amplitude_std: Floats
    """Standard deviations (C,) of the predicted log amplitudes."""
    log_odds: Floats
    """Log odds (C,) that the return is detected in this cycle."""
    side: Integers
    """Side of the panels (C,): `OTHER`, `PANEL` + q or `UNTOLD` (see `slam.observations`)."""
    fades: Booleans
    """Whether the amplitude (C,) is that of a Rayleigh variable about the predicted log amplitude, as a panel's whose
    phases are not known; else it is log-normal."""


def cheapest(cost: Floats) -> tuple[Integers, Integers]:
    """Rows and columns of the pairs of the one-to-one assignment of least cost (R, C), those of negative cost alone."""
    rows, columns = scipy.optimize.linear_sum_assignment(cost)
    good = cost[rows, columns] < 0.0
    return rows[good], columns[good]


def pair_costs(
    candidates: Candidates, observations: Observations, gate: float, strangers: Floats | float,
    pairs: tuple[Integers, Integers] | None = None,
) -> Floats:  # fmt: skip
    """Costs (C, M) of assigning measurements to candidates: -2 log likelihood ratio against a new or false component,
    at most 0.

    A pair competes against "the candidate is missed and the measurement is new or false", of which `strangers` (M,) are
    to be expected per metre, unit of each cosine and e-fold of amplitude; pairs beyond the gate (on
    delay and cosines) do not compete at all. `pairs` (P,), (P,) are those that may, where that is known.
    """
    wide = candidates.covariance[:, DIAGONAL, DIAGONAL]
    row, column = pairs or within_reach(candidates.seen, wide, candidates, observations, gate)
    spread = candidates.covariance[row]
    spread[:, DIAGONAL, DIAGONAL] += observations.std[column] ** 2
    distance, log_det = squared_distance(candidates.seen[row] - observations.seen[column], spread)
    variance = candidates.log_amplitude_std[row] ** 2 + observations.log_amplitude_std[column] ** 2
    surplus = observations.log_amplitude[column] - candidates.log_amplitude[row]
    loudness = surplus**2 / variance + np.log(variance) + np.log(2.0 * np.pi)
    fades = candidates.fades[row]
    loudness[fades] = -2.0 * log_rayleigh(surplus[fades])
    cost = distance + log_det + 3.0 * np.log(2.0 * np.pi) + loudness
    costs = np.zeros((len(candidates.seen), len(observations.seen)))
    density = strangers + np.zeros(costs.shape[1])
    cost += 2.0 * np.log(density[column]) - 2.0 * candidates.log_odds[row]
    costs[row, column] = np.where(distance < gate, np.minimum(cost, 0.0), 0.0)
    return costs


def log_rayleigh(surplus: Floats) -> Floats:
    """Log density (...,) for assignment of a log amplitude `surplus` (...,) above its mean, of a Rayleigh variable."""
    twice = 2.0 * surplus - np.euler_gamma
    return np.asarray(np.log(2.0) + twice - np.exp(np.minimum(twice, 50.0)))


def within_reach(
    seen: Floats, variance: Floats, candidates: Candidates, observations: Observations, gate: float
) -> tuple[Integers, Integers]:
    """Pairs (P,), (P,) that assignment looks at: each axis and the amplitude may be in the gate, and the sides agree.

    Candidates are taken at `seen` (C, 3), with at most `variance` (C, 3) along each axis: no Mahalanobis distance is
    less than that along one axis alone.
    """
    reach = gate * (variance[:, :1] + observations.std[:, 0] ** 2)
    row, column = ((seen[:, :1] - observations.seen[:, 0]) ** 2 <= reach).nonzero()
    gap, loudness = seen[row] - observations.seen[column], candidates.log_amplitude[row]
    inside = gap**2 <= gate * (variance[row] + observations.std[column] ** 2)
    doubt = candidates.log_amplitude_std[row] ** 2 + observations.log_amplitude_std[column] ** 2
    near = inside[:, 1] & inside[:, 2] & ((loudness - observations.log_amplitude[column]) ** 2 < gate * doubt)
    if observations.side is not None:
        side, other = candidates.side[row], observations.side[column]
        near &= (side == other) | (side == UNTOLD) | (other == UNTOLD)
    return row[near], column[near]


def squared_distance(gap: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Squared Mahalanobis lengths (...,) of gaps (..., 3) for assignment, and log determinants of their covariances
    (..., 3, 3), in closed form."""
    x, y, z = gap[..., 0], gap[..., 1], gap[..., 2]
    a, b, c = covariance[..., 0, 0], covariance[..., 0, 1], covariance[..., 0, 2]
    d, e, f = covariance[..., 1, 1], covariance[..., 1, 2], covariance[..., 2, 2]
    ca, cb, cc, ce = d * f - e * e, c * e - b * f, b * e - c * d, b * c - a * e
    det = np.maximum(a * ca + b * cb + c * cc, 1e-300)
    # adjugate times gap
    one, two, three = (
        ca * x + cb * y + cc * z,
        cb * x + (a * f - c * c) * y + ce * z,
        cc * x + ce * y + (a * d - b * b) * z,
    )
    return np.asarray((x * one + y * two + z * three) / det), np.log(det)
