"""Loopy association of ranges to Gaussian sums, and the messages between the features and the agent's course.

Source: Leitinger et al., arXiv 1801.04463, section V, with messages as Gaussian sums. A feature's message to the agent
is a mixture over its Gaussians, over the ranges that it may have made, over "missed" and "does not exist"; it is
multiplied in and the product brought back to one Gaussian of the same mean and covariance.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.schemes.bp_slam.association import Association, associate
from rislam_rt.slam.schemes.bp_slam.config import BpSlamConfig
from rislam_rt.slam.schemes.bp_slam.course import Course
from rislam_rt.slam.schemes.bp_slam.features import Scan
from rislam_rt.slam.schemes.bp_slam.sums import Sight, Sums

NO_VARIANCE = 1e12
"""Variance [m^2] of a range that tells nothing."""


class Pull(NamedTuple):
    """One range in place of all that a Gaussian may have made: same mean and variance of the predicted range after."""

    miss: Floats
    """(C,) innovation [m]."""
    variance: Floats
    """(C,) [m^2]; `NO_VARIANCE` where ranges contradict each other, or there is none."""
    log_factor: Floats
    """(C,) logarithm of the factor on the Gaussian's share."""


def claims(sums: Sums, sight: Sight, course: Course, scan: Scan, fresh: Floats, config: BpSlamConfig) -> Association:
    """Marginals of the association of K features and M ranges."""
    pair = np.zeros((len(sums.ident), len(scan.length)))
    np.add.at(pair, sums.owner, sums.share[:, None] * _ratios(sight, _spread(sight, course), scan, config))
    missed = 1.0 - sums.existence * config.moving_detection
    return associate(missed, sums.existence[:, None] * pair, fresh, config.iterations, config.tolerance)


def _spread(sight: Sight, course: Course) -> Floats:
    """Variance (C,) of predicted ranges."""
    return sight.own + np.sum((sight.by_course @ course.covariance) * sight.by_course, axis=1)


def _ratios(sight: Sight, spread: Floats, scan: Scan, config: BpSlamConfig) -> Floats:
    """Likelihood ratios (C, M) `p_d f(z) / clutter`."""
    variance = spread[:, None] + scan.std**2
    square = (scan.length - sight.length[:, None]) ** 2 / variance
    peak = config.moving_detection / (config.clutter_density * np.sqrt(2.0 * np.pi * variance))
    return np.where(square < 60.0, np.exp(-0.5 * square), 0.0) * peak


def absorb(
    sums: Sums, sight: Sight, course: Course, scan: Scan, found: Association, config: BpSlamConfig
) -> tuple[Sums, Course]:
    """Features and course after the ranges, feature by feature, the surest first."""
    ref, edges = course.mean.copy(), np.searchsorted(sums.owner, np.arange(len(sums.ident) + 1))
    existence, share = sums.existence.copy(), sums.share.copy()
    pulls = np.zeros((2, len(sums.owner)))
    for row in np.argsort(-existence, kind="stable"):
        part = slice(edges[row], edges[row + 1])
        local = Sight(*(column[part] for column in sight))
        gain = local.by_course @ course.covariance
        spread = local.own + np.sum(gain * local.by_course, axis=1)
        seen = local._replace(length=local.length + local.by_course @ (course.mean - ref))
        near = np.flatnonzero(found.feature[row, :-1] > 1e-4)
        pull = _pull(seen, spread, Scan(scan.length[near], scan.std[near]), found.to_feature[row, near], config)
        weight = share[part] * np.exp(pull.log_factor)
        total = weight.sum()
        existence[row] = existence[row] * total / (existence[row] * total + 1.0 - existence[row])
        share[part] = weight / total
        course = _mix(course, gain, spread + pull.variance, pull.miss, existence[row] * share[part])
        pulls[:, part] = pull.miss + seen.length - local.length, pull.variance
    inner = np.einsum("cij,cj->ci", sums.covariance, sight.by_mean)
    gain = inner / (sight.own + pulls[1])[:, None]
    slope = sums.slope - gain[:, :, None] * sight.by_course[:, None]
    change = course.mean - ref
    moved = sums._replace(
        base=sums.base + sums.base_slope @ change,
        walk=sums.walk + sums.walk_slope @ change,
        existence=existence,
        mean=sums.mean + gain * pulls[0][:, None] + slope @ change,
        slope=slope,
        covariance=sums.covariance - gain[:, :, None] * inner[:, None],
        share=share,
    )
    return moved, course


def _pull(seen: Sight, spread: Floats, scan: Scan, message: Floats, config: BpSlamConfig) -> Pull:
    """What C Gaussians of one feature learn: moments over the ranges and "missed", as one range."""
    ratio = _ratios(seen, spread, scan, config) * message
    none = 1.0 - config.moving_detection
    total = none + ratio.sum(axis=1)
    belief = ratio / total[:, None]
    shrink = spread[:, None] / (spread[:, None] + scan.std**2)
    shift = shrink * (scan.length - seen.length[:, None])
    mean = np.sum(belief * shift, axis=1)
    after = (none / total) * spread + np.sum(belief * (spread[:, None] * (1.0 - shrink) + shift**2), axis=1) - mean**2
    told = after < (1.0 - 1e-9) * spread
    variance = np.where(told, 1.0 / np.where(told, 1.0 / np.maximum(after, 1e-18) - 1.0 / spread, 1.0), NO_VARIANCE)
    miss = np.where(told, mean * (spread + variance) / spread, 0.0)
    return Pull(miss, variance, np.log(total))


def _mix(course: Course, gain: Floats, variance: Floats, miss: Floats, weight: Floats) -> Course:
    """Course after one feature's message: moments over its Gaussians; the rest of the weight changes nothing."""
    rows = np.flatnonzero(weight > 1e-4)
    if not len(rows):
        return course
    part, weight = gain[rows] / variance[rows, None], weight[rows]
    shift = part * miss[rows, None]
    mean = weight @ shift
    covariance = course.covariance - (part * (weight * variance[rows])[:, None]).T @ part
    covariance += (shift * weight[:, None]).T @ shift - np.outer(mean, mean)
    return course._replace(mean=course.mean + mean, covariance=0.5 * (covariance + covariance.T))


def newborn(found: Association, fresh: Floats, config: BpSlamConfig) -> tuple[Integers, Floats]:
    """Rows of the ranges that start a feature, and its probability of existing."""
    alive = found.unclaimed * (fresh - 1.0) / fresh
    rows = np.flatnonzero(alive >= config.birth_threshold)
    return rows, alive[rows]


def is_strong(ratio: Floats, config: BpSlamConfig) -> Booleans:
    """(M,) whether a component is as strong as only a wall return is."""
    return ratio > (np.inf if config.specular_ratio is None else config.specular_ratio)
