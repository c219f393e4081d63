"""What lively steps add to a calm filter's covariance, against the error of a Kalman filter with a wrong model."""

import numpy as np
import pytest

from rislam_rt.slam.window.smoother import motion
from rislam_rt.slam.window.smoother.excess import grow, take_in

DT = 0.1


@pytest.mark.parametrize("every", [1, 3, 200])
def test_it_is_the_error_of_a_filter_whose_model_is_too_calm(every):
    move, push = np.eye(6), np.concatenate([0.5 * DT**2 * np.eye(3), DT * np.eye(3)])
    move[:3, 3:] = DT * np.eye(3)
    calm, true = np.full(3, 1e-4), np.array([1e-2, 1e-4, 3e-3])
    start = np.diag([1e-4] * 3 + [1e-4] * 3)
    told, real, excess = start, start.copy(), np.zeros((6, 6))
    look, noise = np.eye(3, 6), 1e-4 * np.eye(3)
    for cycle in range(100):
        told = move @ told @ move.T + (push * calm) @ push.T
        real = move @ real @ move.T + (push * true) @ push.T
        excess = grow(excess, DT, true - calm)
        if cycle % every == 0:
            gain = told @ look.T @ np.linalg.inv(look @ told @ look.T + noise)
            keep, before = np.eye(6) - gain @ look, told
            told, real = keep @ told, keep @ real @ keep.T + gain @ noise @ gain.T
            excess = take_in(excess, before, told)
    # the scaled covariance is damped by 1e-9; its condition is below 1e3
    np.testing.assert_allclose(told + excess, real, rtol=1e-5, atol=1e-6 * real.max())


def test_it_never_grows_by_a_measurement():
    rng = np.random.default_rng(3)
    for _ in range(20):
        root, other = rng.standard_normal((2, 6, 6))
        before, excess = root @ root.T, other @ other.T
        # a belief about a new feature may move more than it tells: the six numbers are not all that is estimated
        left = take_in(excess, before, before * rng.uniform(0.5, 3.0))
        assert (np.diag(left) <= np.diag(excess) * (1.0 + 1e-9)).all()


def test_nothing_is_added_where_the_expected_precision_tells_all():
    sure = np.eye(len(motion.ladder()))
    surplus = motion.expected_variance(sure) - 1.0 / motion.expected_precision(sure)
    np.testing.assert_allclose(surplus, 0.0, atol=1e-15)
    assert not grow(np.zeros((6, 6)), DT, np.zeros(3)).any()
