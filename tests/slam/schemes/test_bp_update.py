"""One step of BP-SLAM against closed forms: existence, a linear feature, and the order of measurements."""

import numpy as np
import pytest

from rislam_rt.arrays import Floats
from rislam_rt.slam.schemes.bp_slam_static import BpSlamStaticConfig
from rislam_rt.slam.schemes.bp_slam_static.features import Features, make_features, no_features
from rislam_rt.slam.schemes.bp_slam_static.update import FactorGraphBelief, predict_belief, update_belief
from rislam_rt.slam.schemes.shared.ranges import Bistatic, Direct, length_of, random_directions
from rislam_rt.slam.schemes.shared.scan import Scan, birth_ratio

COUNT = 64
CONFIG = BpSlamStaticConfig(num_particles=COUNT, coupled=False)
STD = np.array([0.1])


def feature_at(place: list[float], existence: float, count: int = COUNT) -> Features:
    cloud = np.broadcast_to(np.array(place), (1, count, 2)).copy()
    return make_features(cloud, np.array([existence]), np.array([0]), np.array([5]))


def belief_of(features: Features, undetected: float, count: int = COUNT) -> FactorGraphBelief:
    """An agent that is certain to stand at the origin."""
    return FactorGraphBelief(np.zeros((count, 4)), features, np.array([undetected]), 6)


def existence_after(length: Floats, existence: float, undetected: float) -> float:
    scan = Scan(length, np.full(len(length), 0.1))
    belief = belief_of(feature_at([3.0, 4.0], existence), undetected)
    after, _ = update_belief(belief, (scan,), Direct(), CONFIG, rng=np.random.default_rng(1))
    return float(after.features.existence[after.features.ident == 5][0])


@pytest.mark.parametrize("existence", [0.1, 0.5, 0.99])
def test_existence_after_a_miss(existence: float) -> None:
    """Bayes: `e (1 - p_d) / (1 - e p_d)`, up to rounding."""
    missed = 1.0 - CONFIG.detection_probability
    wanted = existence * missed / (1.0 - existence * CONFIG.detection_probability)
    assert existence_after(np.zeros(0), existence, 6.0) == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("miss", [0.0, 0.15, 0.3])
def test_existence_after_a_range(miss: float) -> None:
    """One feature, one range: clutter, a new feature or this one; the sum over the three, up to rounding."""
    e, scan = 0.3, Scan(np.array([5.0 + miss]), STD)
    likelihood = np.exp(-0.5 * (miss / 0.1) ** 2) / (0.1 * np.sqrt(2.0 * np.pi))
    ratio = CONFIG.detection_probability * likelihood / CONFIG.clutter_density
    fresh = 1.0 + birth_ratio(scan, 6.0, Direct(), 2, CONFIG.odds)[0]
    there = e * ((1.0 - CONFIG.detection_probability) * fresh + ratio)
    assert existence_after(scan.length, e, 6.0) == pytest.approx(there / (there + (1.0 - e) * fresh), rel=1e-9)


def test_birth_ratio_integrates_to_the_undetected() -> None:
    """Over all ranges the density of first detections holds `p_d` times the undetected; trapezoids, to 1e-4."""
    length = np.linspace(1e-6, CONFIG.max_range, 4001)
    scan = Scan(length, np.full(len(length), 0.1))
    for dims in (2, 3):
        density = birth_ratio(scan, 6.0, Direct(), dims, CONFIG.odds) * CONFIG.clutter_density
        assert np.trapezoid(density, length) == pytest.approx(6.0 * CONFIG.detection_probability, rel=1e-4)


def test_a_far_feature_is_linear() -> None:
    """A cloud far away, wide along the line of sight: mean and variance are Kalman's, to four standard errors."""
    count, config = 8192, BpSlamStaticConfig(num_particles=8192, coupled=False, detection_probability=0.999)
    rng = np.random.default_rng(2)
    cloud = np.array([[1000.0, 0.0]]) + np.array([0.3, 0.01]) * rng.standard_normal((1, count, 2))
    features = make_features(cloud, np.array([0.999]), np.array([0]), np.array([5]))
    scan = Scan(np.array([1000.2]), STD)
    wide = BpSlamStaticConfig(
        num_particles=count, coupled=False, detection_probability=config.detection_probability, max_range=2000.0
    )
    after, info = update_belief(belief_of(features, 1e-9, count), (scan,), Direct(), wide, rng=rng)
    mean, covariance = after.features.moments(np.zeros((4, 4)))
    gain = 0.09 / (0.09 + 0.01)
    # About a third of the particles carry the posterior; a mean over them, and the prior cloud's own mean, vary so.
    tolerance = 4.0 * (np.sqrt(0.009) / np.sqrt(count / 3.0) + (1.0 - gain) * 0.3 / np.sqrt(count))
    assert mean[0, 0] == pytest.approx(1000.0 + gain * 0.2, abs=tolerance)
    assert covariance[0, 0, 0] == pytest.approx(0.009, rel=4.0 * np.sqrt(2.0 * 3.0 / count))
    assert info.claimed[0][0, 0] > 0.99


def test_order_of_ranges_does_not_matter() -> None:
    """The same features, existence and evidence, to the tolerance of the messages."""
    results = []
    for order in ([0, 1, 2, 3], [2, 0, 3, 1]):
        rng = np.random.default_rng(3)
        features = no_features(COUNT, 2)
        cloud = np.array([[[3.0, 4.0]], [[-6.0, 1.0]]]) + 0.1 * rng.standard_normal((2, COUNT, 2))
        features = make_features(cloud, np.array([0.9, 0.4]), np.zeros(2, dtype=np.int64), np.array([3, 4]))
        scan = Scan(np.array([5.05, 6.0, 5.2, 11.0])[order], np.full(4, 0.1))
        after, info = update_belief(belief_of(features, 6.0), (scan,), Direct(), CONFIG, rng=rng)
        old = after.features.existence[after.features.ident < 6]
        new = np.sort(after.features.existence[after.features.ident >= 6])
        results.append((old, new, info.log_evidence))
    for first, second in zip(*results, strict=True):
        assert np.allclose(first, second, rtol=1e-5)


def test_undetected_features_thin_out() -> None:
    """The mean number of those never seen tends to `birth / (1 - p_s (1 - p_d))`."""
    belief, rng = belief_of(no_features(COUNT, 2), 6.0), np.random.default_rng(4)
    for _ in range(20):
        belief = predict_belief(belief, 1.0, np.zeros(2), CONFIG, rng=rng)
    limit = CONFIG.birth_mean / (1.0 - CONFIG.survival_probability * (1.0 - CONFIG.detection_probability))
    assert belief.undetected[0] == pytest.approx(limit, rel=1e-12)


@pytest.mark.parametrize("model", [Direct(), Bistatic(np.array([-0.3, 0.1, 0.0]), np.array([0.3, -0.1, 0.1]))])
def test_new_features_lie_at_the_range(model: Direct | Bistatic) -> None:
    """What `invert` places, `ranges` finds there, up to rounding."""
    rng = np.random.default_rng(5)
    agent, length = rng.standard_normal((20, 3)), rng.uniform(1.0, 10.0, (1, 20))
    direction = random_directions((1, 20), 3, False, rng=rng)
    assert np.allclose(length_of(direction), 1.0, rtol=1e-12)
    assert np.allclose(model.ranges(agent, model.invert(agent, direction, length)), length, rtol=1e-9)
