"""Points as 21-bit numbers: what goes in comes out, to half a step, whatever the signs."""

import numpy as np
import pytest

from rislam_rt.slam.nested.particles.drjit_engine import TOP, decode, encode, steps
from rislam_rt.slam.nested.particles.engine_choice import pick_engine
from rislam_rt.slam.nested.particles.landmark_cloud import Kernel, kernel_width


def test_points_come_back_to_half_a_step(rng: np.random.Generator) -> None:
    """Rounding alone; the division and the multiplication by the step in double precision add 1e-10 of a step."""
    points = rng.standard_normal((3, 400, 3)) * np.array([1e-4, 0.1, 30.0])[:, None, None]
    step = steps(np.abs(points).max(axis=(1, 2)))
    back = decode(encode(points, step), step)
    assert np.all(np.abs(back - points) <= 0.5001 * step[:, None, None])


@pytest.mark.parametrize("name", ["numpy", "drjit"])
def test_every_sign_and_every_extreme_survives(name: str) -> None:
    """All combinations of the extremes and of the numbers next to zero, where a lost bit or sign would show."""
    ends = np.array([-TOP, -1024, -1023, -1, 0, 1, 1023, 1024, TOP], dtype=np.float64)
    points = np.stack(np.meshgrid(ends, ends, ends), axis=-1).reshape(1, -1, 3)[:, :728]
    engine, zero = pick_engine(name), np.zeros(1, dtype=np.int64)
    weight = np.full((1, points.shape[1]), -np.log(points.shape[1]))
    cloud = engine.build(points, weight, zero, zero)
    np.testing.assert_array_equal(engine.read(cloud)[0], points)
    _, sums = engine.weigh(cloud, (), np.zeros((0, 1)))
    # sums of 728 numbers in single precision
    np.testing.assert_allclose(sums.mean[0], points[0].mean(axis=0), atol=728 * 6e-8 * TOP)


def test_a_collapsed_block_has_a_step_too() -> None:
    step = steps(np.zeros(2))
    assert np.all(step > 0.0)
    np.testing.assert_array_equal(decode(encode(np.zeros((2, 4, 3)), step), step), np.zeros((2, 4, 3)))


def test_resampled_points_reach_no_farther_than_the_grid(rng: np.random.Generator) -> None:
    """A flat cloud, 1000 times as long as thick and turned: nothing is cut off, the resample direction stays resolved.

    Spread of the resample direction: a step is 3e-6 m at most, so that rounding adds (3e-6)^2 / 12 to (1e-3)^2; the
    covariance that was asked for is met to single precision: a few times 6e-8 of the largest variance, 1.
    """
    engine = pick_engine("drjit")
    axes = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    points = (rng.standard_normal((1, 2000, 3)) * [1.0, 0.3, 1e-3]) @ axes.T
    zero = np.zeros(2, dtype=np.int64)
    cloud = engine.build(points, np.full((1, 2000), -np.log(2000.0)), zero, zero)
    wanted = np.tile(np.cov(points[0].T, bias=True), (2, 1, 1))
    cloud = engine.resample(cloud, wanted, 2000, Kernel(np.array([0.3, 0.7]), 7, 400, kernel_width(2000, 3)))
    found = engine.read(cloud)[0]
    for one in found:
        np.testing.assert_allclose(one.mean(axis=0), 0.0, atol=1e-5)
        assert np.abs(one).max() < TOP * cloud.points.step.max()
        np.testing.assert_allclose(np.var(one @ axes, axis=0), np.var(points[0] @ axes, axis=0), rtol=1e-5, atol=2e-7)
