"""What unexplained tracks tell of the poses, as a quadratic in the window."""

import numpy as np
import pytest

from rislam_rt.slam.window.smoother import window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import rotation
from rislam_rt.slam.window.smoother.rate_factor import RateFactor

STEP = 0.1


def _factor(count, rng, *, strength=1.0):
    """A factor by tracks along all directions, whose own unknowns leave half of what their lengths tell."""
    ray = rng.standard_normal((count, 3, 3))
    single = strength * (ray @ np.swapaxes(ray, 1, 2) + np.eye(3))
    common = np.sqrt(0.5 * strength / count) * rng.standard_normal((count, 3, 4)) / 3.0
    middle = np.cumsum(rng.standard_normal((count, 3)), axis=0)
    gradient = strength * rng.standard_normal((count, 3))
    return RateFactor(single, common, gradient, middle, np.eye(3), np.ones(3))


def test_the_cost_by_the_windows_numbers_is_that_by_the_positions():
    rng, count = np.random.default_rng(1), 5
    window = window_gaussian.begin(np.zeros(3), np.ones(3), np.full(7, 0.1))
    for _ in range(count - 1):
        window = window_gaussian.extend(window, STEP, np.full(3, 1e2), velocity_turn=0.3)
    factor, place = _factor(count, rng), window_gaussian.poses(window)[:, :3]
    alone, told = window_gaussian.solve(window), window_gaussian.solve(window._replace(rates=factor))

    def numbers(window):
        return np.concatenate([window.head, window.accel.ravel()])

    def moved(change):
        accel = change[7:].reshape(window.accel.shape)
        return window_gaussian.poses(window._replace(head=window.head + change[:7], accel=window.accel + accel))[:, :3]

    def slope(window, solved):
        return np.linalg.solve(solved.covariance, numbers(window) - numbers(solved))

    design = np.array([(moved(unit) - place).ravel() for unit in np.eye(len(window.covariance))])
    common, off = factor.common.reshape(3 * count, -1), (place - factor.middle).ravel()
    single = np.zeros((count, 3, count, 3))
    single[range(count), :, range(count)] = factor.single
    hessian = single.reshape(3 * count, -1) - common @ common.T
    found = np.linalg.inv(told.covariance) - np.linalg.inv(alone.covariance)
    np.testing.assert_allclose(found, design @ hessian @ design.T, atol=1e-7)
    wanted = design @ (factor.gradient.ravel() + hessian @ off)
    np.testing.assert_allclose(slope(window, told) - slope(window, alone), wanted, atol=1e-7)


@pytest.mark.parametrize("angle", [0.0, 0.5])
def test_a_first_step_that_leaves_tells_the_velocity(angle):
    """A window whose velocity is uncertain by 0.05 m/s; the step that leaves was measured within 0.1 mm in 0.1 s, on
    top of where it is linearised by as much as 0.01 m/s: of the mean of the velocities before and after a turn."""
    velocity, std = np.array([0.2, 0.1, 0.0]), np.array([1e-3, 1e-3, 1e-3, 0.05, 0.05, 0.05, 0.0])
    window = window_gaussian.begin(np.zeros(3), velocity, std)
    for _ in range(2):
        window = window_gaussian.extend(window, STEP, np.full(3, 1e4), velocity_turn=angle)
    window = window_gaussian.solve(window)
    place, off, information = window_gaussian.poses(window)[:, :3], STEP * np.array([0.01, 0.0, 0.0]), 1e-4**-2
    none = np.zeros((3, 3, 3))
    told = RateFactor(none, np.zeros((3, 3, 2)), np.zeros((3, 3)), place, information * np.eye(3), -information * off)
    before = window_gaussian.solve(window_gaussian.slide(window))
    after = window_gaussian.solve(window_gaussian.slide(window._replace(rates=told)))
    assert np.sqrt(np.diag(before.covariance)[3:6]).min() > 0.03
    assert np.sqrt(np.diag(after.covariance)[3:6]).max() < 2e-3
    turn = rotation(angle)
    faster = np.linalg.solve(0.5 * (np.eye(3) + turn), off / STEP)
    np.testing.assert_allclose(after.head[3:6], turn @ (velocity + faster), atol=2e-4)
