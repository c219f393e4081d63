"""Unresolved partners: whether the second path of a cluster is heard in its component, by where and how loud that is.

A wall that is not there, or a path that is blocked, would otherwise spoil for good what shares its cell: every such
component would be expected anywhere between the two, and tell nothing of the path that is there.
"""

import numpy as np
import scipy

from rislam_rt.arrays import Floats
from rislam_rt.slam.assignment import squared_distance
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.window.cycle_association import CycleAssociation


def partner_presence(view: CycleAssociation, observed: Observations) -> tuple[Floats, Floats]:
    """Probabilities (A,) that the unresolved partner of each associated cluster is heard in this cycle's component, and
    that nothing occludes it in cycles to come, for which one of `memory` components that err alike counts. 0 without a
    partner.

    What is not heard may be below the plane of an array that sways, and tells so much less of occlusion.
    """
    groups, expected = view.groups, view.expected
    now = groups.presence[view.row].copy()
    later = now.copy()
    both = ((groups.partner[view.row] >= 0) & (now < 1.0)).nonzero()[0]
    if not len(both):
        return now, later
    row, pick = view.row[both], view.pick[both]
    lead, mate, share = groups.leader[row], groups.partner[row], groups.share[row, None]
    left, level = observed.seen[pick] - expected.seen[lead], observed.log_amplitude[pick]
    slope = expected.jacobian[lead]
    merged_slope = slope + share[..., None] * (expected.jacobian[mate] - slope)
    alone = groups.disturbance[row] + np.maximum(view.scatter[lead], 1.0)[:, None] * observed.std[pick] ** 2
    merged = alone + groups.share_variance[row][:, None] * groups.gap[row] ** 2
    noise = observed.log_amplitude_std[pick] ** 2 + (0.5 * CONSTANTS.fading) ** 2
    ratio = _log_density(left - share * groups.gap[row], merged_slope, view.covariance, merged)
    ratio += _log_normal(level - groups.log_amplitude[row], noise + groups.log_amplitude_std[row] ** 2)
    ratio -= _log_density(left, slope, view.covariance, alone)
    ratio -= _log_normal(level - expected.log_amplitude[lead], noise + expected.log_amplitude_std[lead] ** 2)
    odds = scipy.special.logit(np.clip(now[both], 1e-12, 1.0 - 1e-12))
    now[both] = scipy.special.expit(odds + ratio)
    most = CONSTANTS.max_log_ratio
    heard, before = scipy.special.expit(odds + np.clip(ratio / CONSTANTS.memory, -most, most)), later[both]
    later[both] = heard + (1.0 - heard) * (view.clear[mate] - before) / (1.0 - before)
    return now, later


def _log_density(left: Floats, slope: Floats, covariance: Floats, extra: Floats) -> Floats:
    """Log densities (A,) of residuals (A, 3) with slopes (A, 3, N) by unknowns of a covariance (N, N), and variances
    (A, 3) besides."""
    spread = slope @ covariance @ np.swapaxes(slope, 1, 2)
    spread[:, [0, 1, 2], [0, 1, 2]] += extra
    square, log_det = squared_distance(left, spread)
    return np.asarray(-0.5 * (square + log_det))


def _log_normal(left: Floats, variance: Floats) -> Floats:
    """Log densities (A,) of residuals (A,) of so much variance (A,), but for a constant."""
    return np.asarray(-0.5 * (left**2 / variance + np.log(variance)))
