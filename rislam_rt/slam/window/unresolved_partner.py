"""Unresolved partners: whether the second path of a cluster is heard in its component, by where and how loud that is.

A wall that is not there, or a path that is blocked, would otherwise spoil for good what shares its cell: every such
component would be expected anywhere between the two, and tell nothing of the path that is there.
"""

import numpy as np
import scipy

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.assignment import squared_distance
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.window.cycle_association import CycleAssociation


def partner_presence(view: CycleAssociation, observed: Observations) -> Floats:
    """Probabilities (A,) that the unresolved partner of each associated cluster is heard in this cycle's component; 0
    without a partner."""
    presence = view.groups.presence[view.row].copy()
    both = _asked(view)
    presence[both] = scipy.special.expit(scipy.special.logit(_open(presence[both])) + _log_ratio(view, observed, both))
    return presence


def partner_clear(view: CycleAssociation, observed: Observations) -> Floats:
    """Probabilities (A,) that nothing occludes the unresolved partner of each associated cluster, for cycles to come:
    of `memory` components that err alike one counts. 0 without a partner.

    What is not heard may be below the plane of an array that sways, and tells so much less of occlusion.
    """
    clear = view.groups.presence[view.row].copy()
    both, most = _asked(view), CONSTANTS.max_log_ratio
    before = clear[both]
    ratio = np.clip(_log_ratio(view, observed, both) / CONSTANTS.memory, -most, most)
    heard = scipy.special.expit(scipy.special.logit(_open(before)) + ratio)
    mate = view.groups.partner[view.row[both]]
    clear[both] = heard + (1.0 - heard) * (view.clear[mate] - before) / (1.0 - before)
    return clear


def _asked(view: CycleAssociation) -> Integers:
    """Unresolved partners that may be silent while the leading path is heard: rows of their associated clusters."""
    presence = view.groups.presence[view.row]
    return ((view.groups.partner[view.row] >= 0) & (presence < 1.0)).nonzero()[0]


def _open(probability: Floats) -> Floats:
    """Probabilities of an unresolved partner within the open interval of finite log odds."""
    return np.clip(probability, 1e-12, 1.0 - 1e-12)


def _log_ratio(view: CycleAssociation, observed: Observations, both: Integers) -> Floats:
    """Log likelihood ratios of the components of associated clusters `both`: with their unresolved partners, against
    the leading paths alone."""
    if not len(both):
        return np.zeros(0)
    groups, expected = view.groups, view.expected
    row, pick = view.row[both], view.pick[both]
    lead, mate, share = groups.leader[row], groups.partner[row], groups.share[row, None]
    left, level = observed.seen[pick] - expected.seen[lead], observed.log_amplitude[pick]
    slope = expected.jacobian[lead]
    merged_slope = slope + share[..., None] * (expected.jacobian[mate] - slope)
    alone = groups.disturbance[row] + np.maximum(view.scatter[lead], 1.0)[:, None] * observed.std[pick] ** 2
    merged = alone + groups.share_variance[row][:, None] * groups.gap[row] ** 2
    noise = observed.log_amplitude_std[pick] ** 2 + (0.5 * CONSTANTS.fading) ** 2
    with_mate, by_itself = _log_density(
        np.stack([left - share * groups.gap[row], left]), np.stack([merged_slope, slope]), view.covariance,
        np.stack([merged, alone]),
    )  # fmt: skip
    with_mate += _log_normal(level - groups.log_amplitude[row], noise + groups.log_amplitude_std[row] ** 2)
    by_itself += _log_normal(level - expected.log_amplitude[lead], noise + expected.log_amplitude_std[lead] ** 2)
    return np.asarray(with_mate - by_itself)


def _log_density(left: Floats, slope: Floats, covariance: Floats, extra: Floats) -> Floats:
    """Log densities (..., A) of residuals (..., A, 3) with slopes (..., A, 3, N) by unknowns of a covariance (N, N),
    and variances (..., A, 3) besides."""
    flat = slope.reshape(-1, slope.shape[-1])
    spread = (flat @ covariance).reshape(slope.shape) @ np.swapaxes(slope, -1, -2)
    spread[..., [0, 1, 2], [0, 1, 2]] += extra
    square, log_det = squared_distance(left, spread)
    return np.asarray(-0.5 * (square + log_det))


def _log_normal(left: Floats, variance: Floats) -> Floats:
    """Log densities (A,), with or without an unresolved partner, of residuals (A,) of so much variance (A,), but for a
    constant."""
    return np.asarray(-0.5 * (left**2 / variance + np.log(variance)))
