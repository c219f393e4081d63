"""What unexplained tracks tell of the poses, as a quadratic in the window."""

import numpy as np
import pytest

from rislam_rt.slam.window.smoother import window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import basis
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


def test_the_cost_by_the_motions_numbers_is_that_by_the_positions():
    rng, count = np.random.default_rng(1), 5
    factor, along = _factor(count, rng), basis(np.full(count - 1, STEP).tobytes(), False)
    numbers = rng.standard_normal((3, count + 1))

    def cost(numbers):
        off = (along @ numbers[..., None])[..., 0].T - factor.middle
        own = np.einsum("kat,ka->t", factor.common, off)
        return (factor.gradient * off).sum() + 0.5 * np.einsum("ka,kab,kb", off, factor.single, off) - 0.5 * own @ own

    hessian, gradient = factor.normal((along @ numbers[..., None])[..., 0].T, along)
    change = rng.standard_normal((3, count + 1))
    value = cost(numbers) + (gradient * change.T).sum() + 0.5 * np.einsum("ka,kalb,lb", change.T, hessian, change.T)
    assert cost(numbers + change) == pytest.approx(value)


def test_a_first_step_that_leaves_tells_the_velocity():
    """A window whose velocity is uncertain by 0.05 m/s; the step that leaves was measured within 0.1 mm in 0.1 s, on
    top of where it is linearised by as much as 0.01 m/s."""
    velocity, std = np.array([0.2, 0.1, 0.0]), np.array([1e-3, 1e-3, 1e-3, 0.05, 0.05, 0.05, 0.0])
    window = window_gaussian.begin(np.zeros(3), velocity, std)
    for _ in range(2):
        window = window_gaussian.extend(window, STEP, np.full(3, 1e4))
    window = window_gaussian.solve(window)
    place, off, information = window_gaussian.poses(window)[:, :3], STEP * np.array([0.01, 0.0, 0.0]), 1e-4**-2
    none = np.zeros((3, 3, 3))
    told = RateFactor(none, np.zeros((3, 3, 2)), np.zeros((3, 3)), place, information * np.eye(3), -information * off)
    before = window_gaussian.solve(window_gaussian.slide(window))
    after = window_gaussian.solve(window_gaussian.slide(window._replace(rates=told)))
    assert np.sqrt(np.diag(before.covariance)[3:6]).min() > 0.03
    assert np.sqrt(np.diag(after.covariance)[3:6]).max() < 2e-3
    np.testing.assert_allclose(after.head[3:6], velocity + off / STEP, atol=2e-4)
