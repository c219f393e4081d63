"""Agent particles keep exact moments; numbers of particles follow the published rule."""

import numpy as np
import pytest
from scipy.stats import chi2

from rislam_rt.errors import ConfigError
from rislam_rt.slam.nested.particles import agents
from rislam_rt.slam.nested.particles.kld_sampling import kld_count, num_agents, num_points, occupied_cells
from rislam_rt.slam.nested_config import NestedConfig


def weighted(rng: np.random.Generator, count: int = 300) -> tuple[np.ndarray, np.ndarray]:
    """Weights and values whose fourth column is a constant and whose last is a copy of the first."""
    values = rng.standard_normal((count, 5)) @ np.diag([1e-2, 1.0, 10.0, 0.0, 1.0])
    values[:, 4] = values[:, 0]
    weight = rng.random(count)
    return weight / weight.sum(), values + 3.0


@pytest.mark.parametrize("count", [200, 300, 700])
def test_resampling_gives_the_mean_and_covariance_it_promises(count: int, rng: np.random.Generator) -> None:
    weight, values = weighted(rng)
    mean, covariance = agents.posterior(np.log(weight), values)
    _, moved = agents.resample(np.log(weight), values, count, rng=rng)
    scale = np.sqrt(np.diag(covariance)) + 1e-9
    np.testing.assert_allclose((moved.mean(axis=0) - mean) / scale, 0.0, atol=1e-5)
    found = agents.moments(np.full(count, 1.0 / count), moved)[1]
    np.testing.assert_allclose(found / np.outer(scale, scale), covariance / np.outer(scale, scale), atol=1e-6)
    np.testing.assert_allclose(moved[:, 4], moved[:, 0], atol=1e-6)


def test_posterior_is_exact_for_a_gaussian_and_untouched_where_nothing_was_measured(rng: np.random.Generator) -> None:
    """Bayes' rule in closed form; the sample's own moments err by 1 / sqrt(N) = 4 % of a standard deviation."""
    count = 600
    values = agents.standardise(np.full(count, 1.0 / count), rng.standard_normal((count, 5)))
    log_weight = -0.5 * (values[:, 0] - 1.0) ** 2 / 0.5
    log_weight -= np.logaddexp.reduce(log_weight)
    mean, covariance = agents.posterior(log_weight, values)
    np.testing.assert_allclose(mean, [2.0 / 3.0, 0.0, 0.0, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(covariance, np.diag([1.0 / 3.0, 1.0, 1.0, 1.0, 1.0]), atol=1e-9)
    plain = agents.moments(np.exp(log_weight), values)[0]
    assert np.abs(plain[1:]).max() > 0.02


def test_posterior_of_other_weights_stays_near_the_samples_own(rng: np.random.Generator) -> None:
    """Two humps, which no quadratic fits: within 5 / sqrt(N) standard deviations of the weighted sample."""
    count = 600
    values = agents.standardise(np.full(count, 1.0 / count), rng.standard_normal((count, 4)))
    log_weight = np.logaddexp(-8.0 * (values[:, 0] - 1.0) ** 2, -8.0 * (values[:, 0] + 0.8) ** 2)
    log_weight -= np.logaddexp.reduce(log_weight)
    (mean, covariance), plain = agents.posterior(log_weight, values), agents.moments(np.exp(log_weight), values)
    np.testing.assert_allclose(mean, plain[0], atol=5.0 / np.sqrt(count))
    np.testing.assert_allclose(covariance, plain[1], atol=10.0 / np.sqrt(count))


def test_noise_has_exact_moments_and_knows_nothing_of_the_state(rng: np.random.Generator) -> None:
    _, values = weighted(rng)
    noise = agents.exact_noise(values, 3, rng=rng)
    weight = np.full(len(values), 1.0 / len(values))
    both = np.concatenate([noise, values], axis=1)
    mean, covariance = agents.moments(weight, both)
    np.testing.assert_allclose(mean[:3], 0.0, atol=1e-12)
    np.testing.assert_allclose(covariance[:3, :3], np.eye(3), atol=1e-9)
    np.testing.assert_allclose(covariance[:3, 3:], 0.0, atol=1e-8)


@pytest.mark.parametrize("cells", [2, 10, 300, 5000])
def test_kld_count_is_that_of_the_chi_square_quantile(cells: int) -> None:
    """Fox's formula is the Wilson-Hilferty approximation of this quantile, which errs by 2 % at worst here."""
    assert kld_count(cells) == pytest.approx(chi2.ppf(0.99, cells - 1) / (2 * 0.05), rel=0.02)


def test_a_tight_belief_needs_few_particles_and_a_wide_one_many() -> None:
    config = NestedConfig()
    tight, wide = 1e-6 * np.eye(3), np.eye(3)
    assert occupied_cells(tight, 0.05) == 1.0
    assert num_points(tight, 1000, 1, config) == config.min_points
    assert num_points(wide, 1000, 1, config) == config.num_points
    assert num_agents(tight, config) == config.min_agents
    assert num_agents(wide, config) == config.num_agents
    paper = NestedConfig(adaptive=False)
    assert (num_agents(tight, paper), num_points(tight, 2000, 10, paper)) == (2000, 6000)


def test_capacity_bounds_the_particles() -> None:
    config = NestedConfig(adaptive=False, capacity=1_000_000)
    for features in (1, 3, 10, 40, 400):
        size = num_points(np.eye(3), 2000, features, config)
        assert size % 4 == 0
        assert size == 4 or size * 2000 * features <= 1_000_000


@pytest.mark.parametrize(
    "wrong",
    [{"weighting": "loud"}, {"engine": "abacus"}, {"num_agents": 0}, {"point_cell": 0.0}, {"resample_below": 1.5}],
)
def test_settings_out_of_range_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        NestedConfig(**wrong)  # type: ignore[arg-type]
