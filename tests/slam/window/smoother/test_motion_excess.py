"""Excess of motion: what too calm a prior leaves out of the window's covariance, against the errors it makes."""

import numpy as np
import pytest

from rislam_rt.slam.window.smoother import motion, window_features, window_gaussian
from rislam_rt.slam.window.smoother.direction_priors import no_holds
from rislam_rt.slam.window.smoother.motion_basis import POSE
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic

DT, CYCLES = 0.1, 10
PRECISION, VARIANCE = np.array([4.0, 100.0, 25.0]), np.array([1.0, 0.09, 0.04])


def _last(pushes, keep, leaving):
    """The window after sightings without noise of an agent with accelerations (CYCLES - 1, 3), and its true numbers.

    `leaving`: the second of two features leaves on the way, when the window's first poses have slid out.
    """
    rng, place, speed = np.random.default_rng(5), np.zeros(3), np.zeros(3)
    window = window_gaussian.begin(np.zeros(3), np.zeros(3), np.array([0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.0]))
    features = np.array([[1.0, 2.0, 0.5], [-1.0, 0.5, 2.0]])
    for feature in features:
        window = window_features.add_feature(window, feature, no_holds(), ridge=1.0)
    for cycle in range(CYCLES):
        if cycle:
            push = pushes[cycle - 1]
            place, speed = place + DT * speed + 0.5 * DT**2 * push, speed + DT * push
            while window.num_poses >= keep:
                window = window_gaussian.slide(window)
            window = window_gaussian.extend(window, DT, PRECISION, VARIANCE)
        rows, weight = rng.standard_normal((3, POSE + 6)), rng.uniform(1.0, 100.0, 3)
        rows[:, 3] = 0.0
        if leaving and cycle >= CYCLES - 1 - keep:  # what left the window may be marginalised, the rest is struck
            rows[:, -3:] = 0.0
        spot = np.concatenate([window_gaussian.poses(window)[-1], window.features.ravel()])
        rows = rows[:, : len(spot)]
        value = rows @ np.concatenate([place, [0.0], features.ravel()[: len(spot) - POSE]])
        hessian, gradient, middle = (field.copy() for field in window.slots)
        hessian[-1], middle[-1] = rows.T @ (weight[:, None] * rows), spot
        gradient[-1] = rows.T @ (weight * (rows @ spot - value))
        window = window_gaussian.solve(window._replace(slots=Quadratic(hessian, gradient, middle)))
        if leaving and cycle == CYCLES - 2:
            window = window_features.drop_features(window, np.array([True, False]))
    return window, np.concatenate([place, speed])


@pytest.mark.parametrize(("keep", "leaving"), [(20, False), (4, False), (4, True), (2, False)])
def test_it_is_the_error_by_accelerations_that_are_livelier_than_their_prior(keep, leaving):
    found = np.zeros((6, 6))
    for step in range(CYCLES - 1):
        for axis in range(3):
            pushes = np.zeros((CYCLES - 1, 3))
            pushes[step, axis] = 1.0
            window, true = _last(pushes, keep, leaving)
            error = window_gaussian.now(window)[0][:6] - true
            found += (VARIANCE[axis] - 1.0 / PRECISION[axis]) * np.outer(error, error)
    # slopes of features that were added hang on nothing; rounding: condition of the window's matrix, 1e8
    np.testing.assert_allclose(
        window_gaussian.now_with_excess(window)[2], found, rtol=1e-6, atol=1e-9 * np.abs(found).max()
    )


def test_a_step_that_no_longer_counts_as_lively_leaves_what_it_did():
    """What is learnt of later steps tells nothing of how far the agent went astray before."""
    pushes = np.zeros((CYCLES - 1, 3))
    window, _ = _last(pushes, 4, leaving=False)
    calm = window._replace(variance=np.zeros_like(window.variance))
    left = np.diag(window_gaussian.now_with_excess(calm)[2])
    assert (left > 0.1 * np.diag(window_gaussian.now_with_excess(window)[2])).all()


def test_nothing_is_left_out_where_the_expected_precision_tells_all():
    sure = np.eye(len(motion.ladder()))
    precision = motion.expected_precision(sure)
    np.testing.assert_allclose(precision**2 * motion.expected_variance(sure), precision, rtol=1e-12)


def test_it_is_symmetric_to_the_bit():
    """After long gaps rounding would show beside the smallest variances."""
    window, _ = _last(np.random.default_rng(7).standard_normal((CYCLES - 1, 3)), 4, leaving=False)
    excess = window_gaussian.now_with_excess(window)[2]
    np.testing.assert_array_equal(excess, excess.T)
