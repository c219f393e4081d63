"""Bootstrap intervals cover what they should."""

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.evaluate import bootstrap, median_over_runs, rms_over_runs


def test_interval_of_a_normal_mean_is_the_textbook_one():
    samples = np.random.default_rng(1).standard_normal(200)
    interval = bootstrap(samples, rng=np.random.default_rng(2), resamples=5000)
    half = 1.96 * samples.std() / np.sqrt(200)
    assert interval.value == pytest.approx(samples.mean())
    # quantiles of 5000 resamples err by about 3 % of the half-width
    assert interval.upper - interval.value == pytest.approx(half, rel=0.1)
    assert interval.value - interval.lower == pytest.approx(half, rel=0.1)


def test_coverage_of_a_skewed_rms():
    """Rayleigh errors, 20 seeds: the true RMS, sqrt 2, lies inside about as often as the level says."""
    rng = np.random.default_rng(4)
    trials = 200
    hits = 0
    for _ in range(trials):
        interval = bootstrap(rng.rayleigh(size=20), rng=rng, statistic=rms_over_runs, level=0.9, resamples=400)
        hits += interval.lower <= np.sqrt(2.0) <= interval.upper
    # three binomial standard deviations are 6 %; twenty samples cost the bootstrap a few more
    assert 0.8 < hits / trials < 0.96


def test_equal_samples_have_no_width_and_one_is_no_sample():
    assert bootstrap(np.full(5, 0.3), rng=np.random.default_rng(0)) == pytest.approx((0.3, 0.3, 0.3))
    with pytest.raises(ConfigError, match="at least 2"):
        bootstrap(np.ones(1), rng=np.random.default_rng(0))


def test_a_median_that_no_single_run_moves_still_has_a_width():
    interval = bootstrap(
        np.array([1.0, 1.0, 1.0, 1.0, 5.0, 6.0, 7.0]), rng=np.random.default_rng(0), statistic=median_over_runs
    )
    assert interval.value == interval.lower == 1.0
    assert 5.0 <= interval.upper <= 7.0
