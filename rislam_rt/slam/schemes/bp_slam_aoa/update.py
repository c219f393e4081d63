"""Loopy association of components to Gaussian sums, and the messages between features and the agent's course.

Source: Leitinger, Grebien and Witrisal, "Multipath-based SLAM exploiting AoA and amplitude information" (2019), on the
factor graph of Leitinger et al., arXiv 1801.04463: delays, angles and amplitudes in the likelihood, a detection
probability that follows from each feature's amplitude (Marcum's Q). Messages are Gaussian sums, as in `bp_slam`.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import SensorModel
from rislam_rt.model.sensor import merged_pull
from rislam_rt.slam.schemes.bp_slam_aoa.birth import ComponentScan, log_normal
from rislam_rt.slam.schemes.bp_slam_aoa.config import BpSlamAoaConfig
from rislam_rt.slam.schemes.bp_slam_aoa.features import GaussianFeatures, PredictedReturns, spread_over, through
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory
from rislam_rt.slam.schemes.shared.association import Association, associate

GATE = 40.0
"""Squared Mahalanobis distance beyond which nothing associates (chi^2, 3 dof: 1e-8)."""
SLACK = 0.1
"""How far the agent may turn out to be from where it was expected for a pair still to be looked at [m]."""
NO_VARIANCE = 1e12
"""Variance of a measurement that tells nothing, in units of what it is about."""
LEAST_WEIGHT = 1e-3
"""Probability of a Gaussian below which it moves nothing but itself."""
SCATTER_RATE = 0.1
"""Share of the latest residual in what is learnt of a feature's scatter."""
MOST_SCATTER = 9.0
"""Largest logarithm of a scatter."""
HERMITE = np.array([-np.sqrt(3.0), 0.0, np.sqrt(3.0)]), np.array([1.0, 4.0, 1.0]) / 6.0
"""Gauss-Hermite nodes and weights of a standard normal."""


class CandidatePairs(NamedTuple):
    """N pairs of a Gaussian and a component that it may have made."""

    gaussian: Integers
    """(N,)."""
    component: Integers
    """(N,)."""
    noise: Floats
    """(N, 3) variances of the component."""
    loudness: Floats
    """(N,) variance of its log amplitude about the feature's."""
    log_loudness: Floats
    """(N,) log density of its amplitude, times the detection probability."""


class View(NamedTuple):
    """What is expected of a cycle before its components are assigned."""

    predicted: PredictedReturns
    detection: Floats
    """(C,) probability that a Gaussian's return is reported by itself."""
    disturbance: Floats
    """(C, 3, 3) covariance of the pull of returns that cannot be resolved from it."""
    pairs: CandidatePairs


def expect_scan(
    features: GaussianFeatures,
    predicted: PredictedReturns,
    scan: ComponentScan,
    sensor: SensorModel,
    config: BpSlamAoaConfig,
) -> View:
    """Detection probabilities, pulls of neighbours, and the pairs worth weighing."""
    variance = features.strength_variance + config.fading**2
    loud = predicted.log_amplitude[:, None] + np.sqrt(variance)[:, None] * HERMITE[0]
    snr = sensor.radio.integrated_snr(np.exp(np.clip(loud, -60.0, 5.0)))
    detection = config.visible * predicted.in_view * (sensor.detection_probability(snr) @ HERMITE[1])
    inside = np.where(predicted.seen[:, 0] < sensor.window[1] * SPEED_OF_LIGHT, 1.0, 0.0)
    hidden, pull, disturbance = _neighbours(features, predicted, detection, sensor)
    seen = predicted._replace(seen=predicted.seen + pull)
    detection = np.clip(detection * inside * (1.0 - hidden), 1e-4, 1.0 - 1e-4)
    spread = seen.own[:, 0, 0] + disturbance[:, 0, 0]
    noise = np.exp(features.log_scatter)
    wide = np.sqrt(spread[:, None] + noise[:, None] * scan.std[:, 0] ** 2)
    near = np.abs(scan.seen[:, 0] - seen.seen[:, :1]) < SLACK + np.sqrt(GATE) * wide
    gaussian, component = near.nonzero()
    miss = scan.log_amplitude[component] - seen.log_amplitude[gaussian]
    loudness = config.fading**2 + scan.log_std[component] ** 2
    log_loudness = log_normal(miss, features.strength_variance[gaussian] + loudness) + np.log(detection[gaussian])
    pairs = CandidatePairs(
        gaussian, component, noise[gaussian, None] * scan.std[component] ** 2, loudness, log_loudness
    )
    return View(seen, detection, disturbance, pairs)


def _neighbours(
    features: GaussianFeatures, predicted: PredictedReturns, detection: Floats, sensor: SensorModel
) -> tuple[Floats, ...]:
    """Probability (C,) of coming out as part of a louder return; mean (C, 3) and covariance of the pull of others."""
    weight = features.existence[features.owner] * features.share * detection
    sure = np.flatnonzero(weight > 0.1)
    weight = weight[sure]
    gap = predicted.seen[sure] - predicted.seen[:, None]
    close = sensor.may_merge(gap / np.array([SPEED_OF_LIGHT, 1.0, 1.0]))
    close &= features.owner[:, None] != features.owner[sure]
    louder = predicted.log_amplitude[sure] - predicted.log_amplitude[:, None]
    held = np.where(close, weight, 0.0)
    hidden = 1.0 - np.prod(1.0 - np.where(louder > 0.0, held, 0.0), axis=1)
    mean, variance = merged_pull(np.exp(np.minimum(louder, 0.0)))
    fainter = np.where(louder > 0.0, 0.0, held)
    pull = np.einsum("co,coi->ci", fainter * mean, gap)
    second = fainter * (variance + (1.0 - fainter) * mean**2)
    return hidden, pull, np.einsum("co,coi,coj->cij", second, gap, gap)


def spread_of(predicted: PredictedReturns, course: AgentTrajectory) -> Floats:
    """Covariance (C, 3, 3) of predicted returns."""
    return predicted.own + spread_over(predicted.by_course, course)


def likelihoods(view: View, spread: Floats, scan: ComponentScan, more: Floats | None = None) -> Floats:
    """Densities (N,) of the pairs times detection; `more` (3, 3) is added to the covariance of the agent's position."""
    gaussian, component, noise, _, log_loudness = view.pairs
    total = (spread + view.disturbance)[gaussian]
    if more is not None:
        by_place = view.predicted.by_place[gaussian]
        total = total + by_place @ more @ by_place.swapaxes(1, 2)
    total[:, range(3), range(3)] += noise
    precision = np.asarray(np.linalg.inv(total), dtype=np.float64)
    return np.exp(_log_density(scan.seen[component] - view.predicted.seen[gaussian], precision) + log_loudness)


def _log_density(miss: Floats, precision: Floats) -> Floats:
    """Log normal densities (N,) of innovations (N, 3) with precisions (N, 3, 3); none beyond the gate."""
    square = np.einsum("ni,nij,nj->n", miss, precision, miss)
    log = 0.5 * (np.log(np.maximum(np.linalg.det(precision), 1e-300)) - square - 3.0 * np.log(2.0 * np.pi))
    return np.asarray(np.where(square < GATE, log, -np.inf), dtype=np.float64)


def claims(features: GaussianFeatures, view: View, density: Floats, fresh: Floats) -> tuple[Association, float]:
    """Marginals of the association of K features and M components, and the log evidence (Bethe's) of the cycle.

    `fresh` (M,) is the density of false components and first sights where each lies.
    """
    count, shown = len(features.ident), len(fresh)
    owner = features.owner[view.pairs.gaussian]
    pair = np.zeros((count, shown))
    np.add.at(pair, (owner, view.pairs.component), features.share[view.pairs.gaussian] * density)
    pair *= features.existence[:, None] / fresh
    seen = np.bincount(features.owner, features.share * view.detection, minlength=count)
    missed = 1.0 - features.existence * seen
    found = associate(missed, pair, np.ones(shown), 50, 1e-4)
    ratio = pair / missed[:, None]
    to_component = ratio / (1.0 + (ratio * found.to_feature) @ (1.0 - np.eye(shown)))
    evidence = np.log(missed).sum() + np.log1p((ratio * found.to_feature).sum(axis=1)).sum()
    evidence += np.log1p(to_component.sum(axis=0)).sum() - np.log1p(to_component * found.to_feature).sum()
    return found, float(evidence)


def absorb(
    features: GaussianFeatures,
    view: View,
    course: AgentTrajectory,
    scan: ComponentScan,
    found: Association,
    fresh: Floats,
) -> tuple[GaussianFeatures, AgentTrajectory]:
    """GaussianFeatures and course after the components, feature by feature, the surest first."""
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
        heard = Heard(view, scan, part, pairs, found.to_feature[row] / fresh)
        learnt = learn(heard, seen, spread, features)
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


class Heard(NamedTuple):
    """What one feature may have made."""

    view: View
    scan: ComponentScan
    part: slice
    """Its Gaussians."""
    pairs: slice
    """Their pairs."""
    message: Floats
    """(M,) of the components, over the density of anything else."""


class Learnt(NamedTuple):
    """What G Gaussians of a feature learn: one component in place of all that each may have made."""

    miss: Floats
    """(G, 3) innovation."""
    noise: Floats
    """(G, 3, 3) its covariance."""
    factor: Floats
    """(G,) on the share."""
    strength: Floats
    strength_variance: Floats
    log_scatter: Floats


def learn(heard: Heard, seen: Floats, spread: Floats, features: GaussianFeatures) -> Learnt:
    """Moments over the components and "missed", for each Gaussian."""
    view, scan, part = heard.view, heard.scan, heard.part
    gaussian, component, noise, loudness, log_loudness = (column[heard.pairs] for column in view.pairs)
    mine = gaussian - part.start
    wide = spread + view.disturbance[part]
    total = wide[mine] + noise[:, None] * np.eye(3)
    inverse = np.linalg.inv(total)
    miss = scan.seen[component] - seen[mine]
    pulled = (inverse @ miss[..., None])[..., 0]
    weight = np.exp(_log_density(miss, inverse) + log_loudness) * heard.message[component]
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
    total = np.zeros((count, *values.shape[1:]))
    np.add.at(total, row, values)
    return total


def _as_one(mean: Floats, after: Floats, before: Floats) -> tuple[Floats, Floats]:
    """Innovation (G, 3) and covariance (G, 3, 3) of one component that takes `before` to these moments.

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
    """Course after one feature's message: moments over its Gaussians; the rest of the weight changes nothing."""
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
