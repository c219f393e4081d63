"""The attitude of a cycle: against a joint least squares, a dense likelihood, exact rotations, and drawn sways."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rislam_rt.slam.window.smoother import attitude


def rays(rng, count):
    """Directions (count, 3) from above, not too near the horizon."""
    found = rng.standard_normal((count, 3))
    found[:, 2] = np.abs(found[:, 2]) + 0.5
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def test_the_jacobian_is_that_of_a_turned_body():
    rng, step = np.random.default_rng(0), 1e-6
    ray = rays(rng, 6)
    slopes = attitude.jacobian(ray[:, :2], 3)
    for axis in range(3):
        turned = Rotation.from_rotvec(step * np.eye(3)[axis]).inv().apply(ray)  # seen from the body
        np.testing.assert_allclose(slopes[:, 1:, axis], (turned - ray)[:, :2] / step, atol=2e-6)  # second order: step
    np.testing.assert_array_equal(slopes[:, 0], 0.0)
    np.testing.assert_array_equal(attitude.jacobian(ray[:, :2], 2), slopes[..., :2])


def test_levelling_undoes_the_turn_of_the_body():
    rng = np.random.default_rng(1)
    ray, turn = rays(rng, 20), 0.02 * rng.standard_normal((20, 3))
    heard = Rotation.from_rotvec(turn).inv().apply(ray)
    found = attitude.levelled(heard[:, :2], turn)
    np.testing.assert_allclose(found, ray[:, :2], atol=2.0 * np.max(np.linalg.norm(turn, axis=1)) ** 3)  # third order


@pytest.mark.parametrize("axes", [2, 3])
def test_a_marginalised_attitude_is_that_of_a_joint_least_squares(axes):
    """By pose and features the same solution, whatever attitude the equations begin with, and its attitude too."""
    rng = np.random.default_rng(2)
    variance = rng.uniform(0.01, 0.1, axes)
    by, own = rng.standard_normal((30, 5)), rng.standard_normal((30, axes))
    value, before = rng.standard_normal(30), rng.standard_normal(axes)
    prior = np.diag(np.concatenate([np.full(5, 0.3), 1.0 / variance]))
    wide = np.concatenate([by, own], axis=1)
    wanted = np.linalg.solve(wide.T @ wide + prior, wide.T @ value)
    left = value - own @ before
    flat = np.concatenate([by, own, left[:, None]], axis=1)
    found = attitude.marginalise((flat.T @ flat)[None], before[None], variance[None])
    place = np.linalg.solve(found.hessian[0] + 0.3 * np.eye(5), found.slope[0])
    np.testing.assert_allclose(place, wanted[:5], atol=1e-12)
    # with pose and features held where the solution has them, the change is what is missing to its attitude
    flat[:, -1] = left - by @ place
    again = attitude.marginalise((flat.T @ flat)[None], before[None], variance[None])
    np.testing.assert_allclose(before + again.change[0], wanted[5:], atol=1e-12)


def test_what_a_cycle_tells_leaves_out_what_pose_and_map_may_move():
    """Against the dense covariance of the innovations; outliers speak less."""
    rng = np.random.default_rng(3)
    jacobian, slopes = rng.standard_normal((7, 3, 10)), rng.standard_normal((7, 3, 3))
    root = 0.3 * rng.standard_normal((10, 10))
    left = 0.1 * rng.standard_normal((7, 3))
    told = attitude.likelihood(left, jacobian, root @ root.T, slopes, np.full(3, 0.01))
    flat, by = jacobian.reshape(-1, 10), slopes.reshape(-1, 3)
    inside = np.linalg.inv(np.eye(21) + flat @ root @ root.T @ flat.T)
    np.testing.assert_allclose(told.information[0], by.T @ inside @ by, atol=1e-10)
    np.testing.assert_allclose(told.slope[0], by.T @ inside @ left.ravel(), atol=1e-10)
    loud = left.copy()
    loud[0] += 1e3
    swayed = attitude.likelihood(loud, jacobian, root @ root.T, slopes, np.full(3, 0.01))
    assert np.linalg.norm(swayed.slope) < np.linalg.norm(by.T @ inside @ loud.ravel()) / 100.0


@pytest.mark.parametrize(("tilt", "yaw"), [(0.0, 0.0), (0.0087, 0.0), (0.0, 0.0087), (0.02, 0.002)])
def test_the_levels_learn_how_much_a_body_sways(tilt, yaw):
    """Within a factor of the levels' own distance, from 40 cycles that tell each rotation to within a milliradian."""
    rng, std = np.random.default_rng(4), 1e-3
    probability = attitude.first_levels(compass=True)
    for _ in range(40):
        seen = rng.standard_normal(3) * [tilt, tilt, yaw] + std * rng.standard_normal(3)
        probability = attitude.next_levels(
            probability, attitude.Attitude(np.eye(3)[None] / std**2, seen[None] / std**2)
        )  # fmt: skip
    found = np.sqrt(attitude.variance(probability))
    for value, truth in ((found[0], tilt), (found[2], yaw)):
        assert value < 2.0 * np.sqrt(10.0) * max(truth, 2e-4)
        assert value > truth / np.sqrt(10.0)
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_allclose(probability.sum(axis=1), 1.0)


def test_without_a_compass_there_is_no_yaw():
    probability = attitude.first_levels(compass=False)
    assert attitude.variance(probability).shape == (2,)
    assert attitude.variance(attitude.held_level(probability)) == pytest.approx(np.full(2, attitude.levels()[0] ** 2))


def test_tilts_have_the_moments_of_their_levels_and_of_what_is_told():
    probability = attitude.first_levels(compass=True)
    found = attitude.tilts(probability, None)
    assert found.weight.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(found.point.mean(axis=1), 0.0, atol=1e-12)
    spread = np.sqrt((found.point**2).mean(axis=1))
    np.testing.assert_allclose(spread, np.tile(attitude.levels()[:, None], 2), rtol=0.1)
    seen, std = np.array([0.004, -0.002, 0.001]), 1e-4
    told = attitude.Attitude(np.eye(3)[None] / std**2, seen[None] / std**2)
    np.testing.assert_allclose(attitude.tilts(probability, told).point.mean(axis=1)[-1], seen[:2], atol=std)


def test_the_change_of_an_attitude_is_that_of_least_squares():
    rng, variance = np.random.default_rng(4), np.array([1e-4, 1e-4])
    rows, left, rotation = rng.standard_normal((9, 2)), rng.standard_normal(9), 0.01 * rng.standard_normal(2)
    flat = np.column_stack([rows, left])
    found = attitude.change((flat.T @ flat)[None], rotation[None], variance[None])[0]
    wide = np.vstack([rows, np.diag(variance**-0.5)])
    aim = np.concatenate([left, -rotation * variance**-0.5])
    np.testing.assert_allclose(found, np.linalg.lstsq(wide, aim)[0])
