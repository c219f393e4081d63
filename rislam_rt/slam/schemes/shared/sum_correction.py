"""Correction of features' Gaussian sums and the agent's trajectory by ranges, after their loopy association.

Source: Leitinger et al., arXiv 1801.04463, section V, with messages as Gaussian sums. A feature's message to the agent
is a mixture over its Gaussians, over the ranges that it may have made, over "missed" and "does not exist"; it is
multiplied in and the product brought back to one Gaussian of the same mean and covariance.
"""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory
from rislam_rt.slam.schemes.shared.gaussian_sums import PredictedRanges, Sums, spread_of
from rislam_rt.slam.schemes.shared.loopy_association import Association, associate
from rislam_rt.slam.schemes.shared.ranges import Odds, Scan

NO_VARIANCE = 1e12
"""Variance [m^2] of a range that tells nothing."""
ROUNDS, TOLERANCE = 30, 1e-3
"""Largest number of rounds of loopy association, and the change of messages at which it ends: finer than the sums."""


def claims(
    sums: Sums, sight: PredictedRanges, course: AgentTrajectory, scan: Scan, fresh: Floats, odds: Odds
) -> Association:
    """Probabilities with which K features' Gaussian sums claim M ranges, for their correction: by loopy association."""
    pair = np.zeros((len(sums.ident), len(scan.length)))
    np.add.at(pair, sums.owner, sums.share[:, None] * _ratios(sight.length, spread_of(sight, course), scan, odds))
    missed = 1.0 - sums.existence * odds.detection_probability
    return associate(missed, sums.existence[:, None] * pair, fresh, ROUNDS, TOLERANCE)


def _ratios(length: Floats, spread: Floats, scan: Scan, odds: Odds) -> Floats:
    """Likelihood ratios (C, M) of features and ranges for the correction, `p_d f(z) / clutter`."""
    variance = spread[:, None] + scan.std**2
    square = (scan.length - length[:, None]) ** 2 / variance
    peak = odds.detection_probability / (odds.clutter_density * np.sqrt(2.0 * np.pi * variance))
    return np.where(square < 60.0, np.exp(-0.5 * square), 0.0) * peak


def absorb(
    sums: Sums, sight: PredictedRanges, course: AgentTrajectory, scan: Scan, found: Association, odds: Odds
) -> tuple[Sums, AgentTrajectory]:
    """Correct features' Gaussian sums and the agent's trajectory by a scan of ranges, one by one, the surest first."""
    ref, edges = course.mean.copy(), np.searchsorted(sums.owner, np.arange(len(sums.ident) + 1))
    existence, share = sums.existence.copy(), sums.share.copy()
    pulls = np.stack([np.zeros(len(sums.owner)), np.full(len(sums.owner), NO_VARIANCE)])
    missed = 1.0 - odds.detection_probability
    claimed = found.feature[:, :-1] > 1e-4
    for row in np.argsort(-existence, kind="stable"):
        near = claimed[row].nonzero()[0]
        if not len(near):  # all its Gaussians missed alike, and the agent learns nothing of it
            existence[row] *= missed / (existence[row] * missed + 1.0 - existence[row])
            continue
        part = slice(edges[row], edges[row + 1])
        by_course, own = sight.by_course[part], sight.own[part]
        gain = by_course @ course.covariance
        spread = own + np.einsum("cn,cn->c", gain, by_course)
        seen = sight.length[part] + by_course @ (course.mean - ref)
        ranges = Scan(scan.length[near], scan.std[near])
        miss, variance, log_factor = _pull(seen, spread, ranges, found.to_feature[row, near], odds)
        weight = share[part] * np.exp(log_factor)
        total = weight.sum()
        existence[row] = existence[row] * total / (existence[row] * total + 1.0 - existence[row])
        share[part] = weight / total
        course = _mix(course, gain, spread + variance, miss, existence[row] * share[part])
        pulls[:, part] = miss + seen - sight.length[part], variance
    inner = np.einsum("cij,cj->ci", sums.covariance, sight.by_mean)
    # products of the messages are symmetric but for rounding
    course = course._replace(covariance=0.5 * (course.covariance + course.covariance.T))
    gain = inner / (sight.own + pulls[1])[:, None]
    slope = sums.slope - gain[:, :, None] * sight.by_course[:, None]
    change = course.mean - ref
    moved = sums._replace(
        base=sums.base + sums.base_slope @ change, walk=sums.walk + sums.walk_slope @ change, existence=existence,
        mean=sums.mean + gain * pulls[0][:, None] + slope @ change, slope=slope,
        covariance=sums.covariance - gain[:, :, None] * inner[:, None], share=share,
    )  # fmt: skip
    return moved, course


def _pull(seen: Floats, spread: Floats, scan: Scan, message: Floats, odds: Odds) -> tuple[Floats, ...]:
    """Equivalent single range of C Gaussians of one feature, for the correction: moments over the ranges and "missed".

    Innovation (C,) [m]; variance (C,) [m^2], `NO_VARIANCE` where ranges contradict each other, or none is; logarithm
    (C,) of the factor on the Gaussian's share.
    """
    ratio = _ratios(seen, spread, scan, odds) * message
    none = 1.0 - odds.detection_probability
    total = none + ratio.sum(axis=1)
    belief = ratio / total[:, None]
    shrink = spread[:, None] / (spread[:, None] + scan.std**2)
    shift = shrink * (scan.length - seen[:, None])
    mean = (belief * shift).sum(axis=1)
    after = (none / total) * spread + (belief * (spread[:, None] * (1.0 - shrink) + shift**2)).sum(axis=1) - mean**2
    told = after < (1.0 - 1e-9) * spread
    lost = np.where(told, 1.0 - after / spread, 1.0)
    variance = np.where(told, np.maximum(after, 1e-18) / lost, NO_VARIANCE)
    miss = np.where(told, mean * (spread + variance) / spread, 0.0)
    return miss, variance, np.log(total)


def _mix(course: AgentTrajectory, gain: Floats, variance: Floats, miss: Floats, weight: Floats) -> AgentTrajectory:
    """Correction of the agent's trajectory by one feature's message: moments over Gaussians, the rest as before."""
    rows = np.flatnonzero(weight > 1e-4)
    if not len(rows):
        return course
    weight, miss, variance = weight[rows], miss[rows], variance[rows]
    part = gain[rows] / variance[:, None]
    mean = (weight * miss) @ part
    parts = np.concatenate([part, mean[None]])
    scale = np.concatenate([weight * (miss**2 - variance), [-1.0]])
    return course._replace(mean=course.mean + mean, covariance=course.covariance + (parts.T * scale) @ parts)


def newborn(found: Association, fresh: Floats, birth_threshold: float) -> tuple[Integers, Floats]:
    """Rows of a scan's ranges that no feature's sum claims and that start new ones, and existence probabilities."""
    alive = found.unclaimed * (fresh - 1.0) / fresh
    rows = np.flatnonzero(alive >= birth_threshold)
    return rows, alive[rows]


def is_strong(ratio: Floats, specular_ratio: float | None) -> Booleans:
    """Whether a component (M,) that corrects sums is as strong as only a wall return is, by its amplitude over that of
    free space."""
    return ratio > (np.inf if specular_ratio is None else specular_ratio)
