"""Loopy association of components to features' Gaussian sums, in BP-SLAM with angles: which may have made which.

Source: Leitinger, Grebien and Witrisal, "Multipath-based SLAM exploiting AoA and amplitude information" (2019): delays,
angles and amplitudes in the likelihood, a detection probability that follows from each feature's amplitude.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import SensorModel
from rislam_rt.model.sensor_model import merged_pull
from rislam_rt.slam.schemes.bp_slam_aoa.config import BpSlamAoaConfig
from rislam_rt.slam.schemes.bp_slam_aoa.feature_birth import ComponentScan, log_normal
from rislam_rt.slam.schemes.bp_slam_aoa.gaussian_features import GaussianFeatures, PredictedReturns, spread_over
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory
from rislam_rt.slam.schemes.shared.loopy_association import Association, associate

GATE = 40.0
"""Squared Mahalanobis distance beyond which nothing associates (chi^2, 3 dof: 1e-8)."""
SLACK = 0.1
"""Distance [m] of the agent from where it was expected up to which a pair is still weighed."""
HERMITE = np.array([-np.sqrt(3.0), 0.0, np.sqrt(3.0)]), np.array([1.0, 4.0, 1.0]) / 6.0
"""Gauss-Hermite nodes and weights of a standard normal."""


class CandidatePairs(NamedTuple):
    """N pairs of a feature's Gaussian and a component that it may have made."""

    gaussian: Integers
    """Row (N,) of the Gaussian."""
    component: Integers
    """Row (N,) of the component."""
    noise: Floats
    """Variances (N, 3) of the component."""
    loudness: Floats
    """Variance (N,) of the component's log amplitude about the feature's."""
    log_loudness: Floats
    """Log density (N,) of the component's amplitude, times the detection probability."""


class View(NamedTuple):
    """Predicted returns of a cycle, their detection probabilities and candidate pairs, before the association."""

    predicted: PredictedReturns
    """Predicted returns, moved by the mean pull of neighbours."""
    detection: Floats
    """Probability (C,) that a Gaussian's return is reported by itself."""
    disturbance: Floats
    """Covariance (C, 3, 3) of the pull of returns that cannot be resolved from it."""
    pairs: CandidatePairs
    """Candidate pairs of a Gaussian and a component."""


def expect_scan(
    features: GaussianFeatures, predicted: PredictedReturns, scan: ComponentScan, sensor: SensorModel,
    config: BpSlamAoaConfig,
) -> View:  # fmt: skip
    """Predicted returns of features' Gaussians for association: detection probabilities, pulls of neighbours, pairs."""
    variance = features.strength_variance + config.fading**2
    loud = predicted.log_amplitude[:, None] + np.sqrt(variance)[:, None] * HERMITE[0]
    snr = sensor.radio.integrated_snr(np.exp(np.clip(loud, -60.0, 5.0)))
    detection = config.visible * predicted.in_view * (sensor.detection_probability(snr) @ HERMITE[1])
    inside = np.where(predicted.seen[:, 0] < sensor.window[1] * SPEED_OF_LIGHT, 1.0, 0.0)
    hidden, pull, disturbance = unresolved_neighbours(features, predicted, detection, sensor)
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


def spread_of(predicted: PredictedReturns, course: AgentTrajectory) -> Floats:
    """Covariance (C, 3, 3) of the features' returns predicted for association, in BP-SLAM with angles."""
    return predicted.own + spread_over(predicted.by_course, course)


def likelihoods(view: View, spread: Floats, scan: ComponentScan, more: Floats | None = None) -> Floats:
    """Likelihoods (N,) of candidate pairs of association, times detection; `more` (3, 3) [m^2] is added to the agent's
    covariance."""
    gaussian, component, noise, _, log_loudness = view.pairs
    total = (spread + view.disturbance)[gaussian]
    if more is not None:
        by_place = view.predicted.by_place[gaussian]
        total = total + by_place @ more @ by_place.swapaxes(1, 2)
    total[:, range(3), range(3)] += noise
    precision = np.asarray(np.linalg.inv(total), dtype=np.float64)
    return np.exp(log_density(scan.seen[component] - view.predicted.seen[gaussian], precision) + log_loudness)


def log_density(miss: Floats, precision: Floats) -> Floats:
    """Log normal densities (N,) of association pairs' innovations (N, 3), precisions (N, 3, 3); -inf beyond the
    gate."""
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


def unresolved_neighbours(
    features: GaussianFeatures, predicted: PredictedReturns, detection: Floats, sensor: SensorModel
) -> tuple[Floats, ...]:
    """For the association of BP-SLAM's features: probability (C,) that a return merges into a louder one; mean (C, 3)
    and covariance of neighbours' pull."""
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
