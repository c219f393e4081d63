"""Update of features' Gaussian sums and the agent's trajectory by components, in BP-SLAM with angles.

Source: Leitinger, Grebien and Witrisal, "Multipath-based SLAM exploiting AoA and amplitude information" (2019), on the
factor graph of Leitinger et al., arXiv 1801.04463: delays, angles and amplitudes in the likelihood, a detection
probability that follows from each feature's amplitude (Marcum's Q). Messages are Gaussian sums, as in `bp_slam`.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.schemes.bp_slam_aoa.feature_association import View, log_density
from rislam_rt.slam.schemes.bp_slam_aoa.feature_birth import ComponentScan
from rislam_rt.slam.schemes.bp_slam_aoa.gaussian_features import GaussianFeatures, through
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory
from rislam_rt.slam.schemes.shared.loopy_association import Association

NO_VARIANCE = 1e12
"""Variance of a measurement that tells nothing, in units of the prediction's."""
LEAST_WEIGHT = 1e-3
"""Probability of a Gaussian below which it does not correct the agent's trajectory."""
SCATTER_RATE = 0.1
"""Weight of the latest residual in what is learnt of a feature's scatter."""
MOST_SCATTER = 9.0
"""Largest logarithm of a feature's scatter, the mean square of its residuals in reported deviations."""


def absorb(
    features: GaussianFeatures, view: View, course: AgentTrajectory, scan: ComponentScan, found: Association,
    fresh: Floats,
) -> tuple[GaussianFeatures, AgentTrajectory]:  # fmt: skip
    """Update features' Gaussian sums and the agent's trajectory by the components, one by one, the surest first."""
    ref, predicted = course.mean.copy(), view.predicted
    edges = np.searchsorted(features.owner, np.arange(len(features.ident) + 1))
    pair_edges = np.searchsorted(view.pairs.gaussian, np.arange(len(features.owner) + 1))
    existence = features.existence.copy()
    fields = {
        name: getattr(features, name).copy() for name in ("share", "strength", "strength_variance", "log_scatter")
    }
    pull, told = np.zeros((len(features.owner), 3)), np.zeros((len(features.owner), 3, 3))
    for row in np.argsort(-existence, kind="stable"):
        part = slice(int(edges[row]), int(edges[row + 1]))
        pairs = slice(int(pair_edges[part.start]), int(pair_edges[part.stop]))
        if pairs.start == pairs.stop:
            share = fields["share"][part] * (1.0 - view.detection[part])
            total = float(share.sum())
            existence[row] = existence[row] * total / (existence[row] * total + 1.0 - existence[row])
            fields["share"][part], told[part] = share / total, NO_VARIANCE * np.eye(3)
            continue
        by_course = predicted.by_course[part]
        gain = through(by_course, course.covariance)
        spread = predicted.own[part] + gain @ by_course.swapaxes(1, 2)
        seen = predicted.seen[part] + by_course @ (course.mean - ref)
        learnt = learn(view, scan, part, pairs, found.to_feature[row] / fresh, seen, spread, features)
        weight = fields["share"][part] * learnt.factor
        total = float(weight.sum())
        existence[row] = existence[row] * total / (existence[row] * total + 1.0 - existence[row])
        fields["share"][part] = weight / total
        for name in ("strength", "strength_variance", "log_scatter"):
            fields[name][part] = getattr(learnt, name)
        course = _mix(course, gain, spread, learnt, existence[row] * weight / total)
        # the same pull as seen from the mean that the features refer to
        pull[part], told[part] = learnt.miss + seen - predicted.seen[part], learnt.noise
    inner = features.covariance @ predicted.by_mean.swapaxes(1, 2)
    own = predicted.by_mean @ inner + told
    gain = inner @ np.linalg.inv(own)
    slope = features.slope - gain @ predicted.by_course
    change = course.mean - ref
    covariance = features.covariance - gain @ inner.swapaxes(1, 2)
    return features._replace(
        existence=existence,
        mean=features.mean + (gain @ pull[..., None])[..., 0] + slope @ change,
        slope=slope,
        covariance=0.5 * (covariance + covariance.swapaxes(1, 2)),
        **fields,
    ), course._replace(covariance=0.5 * (course.covariance + course.covariance.T))


class Learnt(NamedTuple):
    """Update of G Gaussians of a feature: one equivalent component in place of all that each may have made."""

    miss: Floats
    """Innovation (G, 3) of the equivalent component."""
    noise: Floats
    """Covariance (G, 3, 3) of the equivalent component."""
    factor: Floats
    """Factor (G,) on the Gaussian's share."""
    strength: Floats
    """Log amplitude (G,) above the law of the kind."""
    strength_variance: Floats
    """Variance (G,) of that log amplitude."""
    log_scatter: Floats
    """Logarithm (G,) of the feature's scatter."""


def learn(
    view: View, scan: ComponentScan, part: slice, pairs: slice, message: Floats, seen: Floats, spread: Floats,
    features: GaussianFeatures,
) -> Learnt:  # fmt: skip
    """Update of each Gaussian of one feature, rows `part`: moments over the components of `pairs` and "missed".

    `message` (M,) are those of the components to the feature, over the density of anything else.
    """
    gaussian, component, noise, loudness, log_loudness = (column[pairs] for column in view.pairs)
    mine = gaussian - part.start
    wide = spread + view.disturbance[part]
    total = wide[mine] + noise[:, None] * np.eye(3)
    inverse = np.linalg.inv(total)
    miss = scan.seen[component] - seen[mine]
    pulled = (inverse @ miss[..., None])[..., 0]
    weight = np.exp(log_density(miss, inverse) + log_loudness) * message[component]
    count = len(seen)
    none = 1.0 - view.detection[part]
    factor = none + np.bincount(mine, weight, minlength=count)
    belief = weight / factor[mine]
    shift = (spread[mine] @ pulled[..., None])[..., 0]
    mean = _sum(mine, belief[:, None] * shift, count)
    drop = belief[:, None, None] * (shift[:, :, None] * shift[:, None] - spread[mine] @ inverse @ spread[mine])
    after = spread + _sum(mine, drop, count) - mean[:, :, None] * mean[:, None]
    strength, variance = features.strength[part].copy(), features.strength_variance[part].copy()
    off = scan.log_amplitude[component] - view.predicted.log_amplitude[part][mine]
    gain = variance[mine] / (variance[mine] + loudness)
    strength += np.bincount(mine, belief * gain * off, minlength=count)
    variance *= 1.0 - np.bincount(mine, belief * gain, minlength=count)
    score = np.einsum("ni,ni,ni->n", pulled, noise, pulled) - np.einsum("nii,ni->n", inverse, noise)
    step = np.bincount(mine, belief * np.clip(score, -3.0, 6.0), minlength=count)
    scatter = np.clip(features.log_scatter[part] + SCATTER_RATE * step, 0.0, MOST_SCATTER)
    return Learnt(*_as_one(mean, after, spread), factor, strength, np.maximum(variance, 1e-4), scatter)


def _sum(row: Integers, values: Floats, count: int) -> Floats:
    """Sums (count, ...) for an update of features of the values (N, ...) of each row (N,)."""
    total = np.zeros((count, *values.shape[1:]))
    np.add.at(total, row, values)
    return total


def _as_one(mean: Floats, after: Floats, before: Floats) -> tuple[Floats, Floats]:
    """Equivalent component, innovation (G, 3) and covariance (G, 3, 3), whose update takes `before` to these moments.

    Along axes in which components contradict each other, so that nothing is learnt, its variance is `NO_VARIANCE`.
    """
    root = np.linalg.cholesky(before + 1e-12 * np.eye(3))
    back = np.linalg.inv(root)
    value, vector = np.linalg.eigh(back @ after @ back.swapaxes(1, 2))
    told = value < 1.0 - 1e-9
    left = np.where(told, np.maximum(value, 1e-9), 0.5)
    noise = np.where(told, left / (1.0 - left), NO_VARIANCE)
    along = (vector.swapaxes(1, 2) @ (back @ mean[..., None]))[..., 0]
    along = np.where(told, along / (1.0 - left), 0.0)
    axes = root @ vector
    return (axes @ along[..., None])[..., 0], (axes * noise[:, None]) @ axes.swapaxes(1, 2)


def _mix(course: AgentTrajectory, gain: Floats, spread: Floats, learnt: Learnt, weight: Floats) -> AgentTrajectory:
    """Agent's trajectory updated by one feature's message: moments over its Gaussians, the rest changing nothing."""
    rows = np.flatnonzero(weight > LEAST_WEIGHT)
    if not len(rows):
        return course
    gain, weight = gain[rows], weight[rows]
    back = np.linalg.inv(spread[rows] + learnt.noise[rows]) @ gain
    shift = np.einsum("gin,gi->gn", back, learnt.miss[rows])
    mean = weight @ shift
    flat = (np.sqrt(weight)[:, None, None] * back).reshape(-1, gain.shape[2])
    drop = flat.T @ (np.sqrt(weight)[:, None, None] * gain).reshape(-1, gain.shape[2])
    spreading = (shift.T * weight) @ shift - np.outer(mean, mean)
    return course._replace(mean=course.mean + mean, covariance=course.covariance - drop + spreading)
