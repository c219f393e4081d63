"""Unresolved partners: whether the second path of a cluster is heard in its component, by where and how loud that is.

A wall that is not there, or a path that is blocked, would otherwise spoil for good what shares its cell: every such
component would be expected anywhere between the two, and tell nothing of the path that is there.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.assignment import squared_distance
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.window.cycle_association import CycleAssociation


def partner_presence(view: CycleAssociation, observed: Observations) -> tuple[Floats, Floats]:
    """Probabilities (A,) that the partner of each associated cluster is heard in its component: given this cycle's
    component, and as one of `memory` components that err alike, for cycles to come. 0 without a partner."""
    groups, expected, row, pick = view.groups, view.expected, view.row, view.pick
    presence = groups.presence[row].copy()
    later = presence.copy()
    both = ((groups.partner[row] >= 0) & (presence < 1.0)).nonzero()[0]
    if not len(both):
        return presence, later
    row, pick = row[both], pick[both]
    lead, mate, share = groups.leader[row], groups.partner[row], groups.share[row]
    alone = groups.disturbance[row] + np.maximum(view.scatter[lead], 1.0)[:, None] * observed.std[pick] ** 2
    merged = alone + groups.share_variance[row][:, None] * groups.gap[row] ** 2
    left = observed.seen[pick] - expected.seen[lead]
    slope = expected.jacobian[lead]
    other = slope + share[:, None, None] * (expected.jacobian[mate] - slope)
    level = observed.log_amplitude[pick]
    noise = observed.log_amplitude_std[pick] ** 2 + (0.5 * CONSTANTS.fading) ** 2
    ratio = _log_density(left - share[:, None] * groups.gap[row], other, view.covariance, merged)
    ratio += _log_normal(level - groups.log_amplitude[row], noise + groups.log_amplitude_std[row] ** 2)
    ratio -= _log_density(left, slope, view.covariance, alone)
    ratio -= _log_normal(level - expected.log_amplitude[lead], noise + expected.log_amplitude_std[lead] ** 2)
    odds = np.log(presence[both] / (1.0 - presence[both]))
    presence[both] = 1.0 / (1.0 + np.exp(-np.clip(odds + ratio, -50.0, 50.0)))
    slow = np.clip(ratio / CONSTANTS.memory, -CONSTANTS.max_log_ratio, CONSTANTS.max_log_ratio)
    later[both] = 1.0 / (1.0 + np.exp(-(odds + slow)))
    return presence, later


def _log_density(left: Floats, slope: Floats, covariance: Floats, extra: Floats) -> Floats:
    """Log densities (A,) of residuals (A, 3) with slopes (A, 3, N) by unknowns of a covariance (N, N), and variances
    (A, 3) besides."""
    spread = slope @ covariance @ np.swapaxes(slope, 1, 2)
    spread[:, [0, 1, 2], [0, 1, 2]] += extra
    square, log_det = squared_distance(left, spread)
    return -0.5 * (square + log_det)


def _log_normal(left: Floats, variance: Floats) -> Floats:
    """Log densities (A,) of residuals (A,) of so much variance (A,), but for a constant."""
    return -0.5 * (left**2 / variance + np.log(variance))
