"""NEES and NIS against published bounds, and on filters that are right or overconfident by construction."""

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.evaluate import chi_square_bounds, consistency, normalised_squares


def test_bounds_published_for_fifty_runs_of_two_states():
    """Bar-Shalom, Li and Kirubarajan, example in 5.4.2: the sum of 50 runs lies within [74.2, 129.6] (95 %)."""
    lower, upper = chi_square_bounds(2, 50, level=0.95)
    assert (100.0 * lower, 100.0 * upper) == pytest.approx((74.2, 129.6), abs=0.05)


def test_squares_are_the_mahalanobis_distance():
    covariance = np.array([[4.0, 0.0], [0.0, 0.25]])
    np.testing.assert_allclose(normalised_squares(np.array([2.0, 1.0]), covariance), 1.0 + 4.0)
    stack = np.stack([covariance, np.array([[1.0, 1.0], [1.0, 1.0]])])
    np.testing.assert_array_equal(normalised_squares(np.array([[2.0, 1.0], [1.0, 1.0]]), stack), [5.0, np.inf])


@pytest.mark.parametrize(("claimed", "verdict"), [(1.0, "right"), (0.7, "overconfident"), (1.4, "timid")])
def test_verdict_on_filters_of_known_honesty(claimed, verdict):
    rng = np.random.default_rng(3)
    runs, cycles = 50, 200
    covariance = np.array([[2.0, 0.6, 0.0], [0.6, 1.0, 0.2], [0.0, 0.2, 0.5]])
    errors = rng.standard_normal((runs, cycles, 3)) @ np.linalg.cholesky(covariance).T
    score = consistency(normalised_squares(errors, claimed**2 * covariance), 3)
    if verdict == "right":
        # binomial of 200 averages at 95 %: three standard deviations are 4.6 %
        assert score.inside == pytest.approx(0.95, abs=0.05)
    else:
        assert score.inside < 0.05
        assert (score.average.mean() > score.upper) == (verdict == "overconfident")


def test_senseless_counts_are_refused():
    with pytest.raises(ConfigError, match="dof"):
        chi_square_bounds(0)
