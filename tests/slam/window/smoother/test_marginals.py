"""Marginal covariances of the window, against matrices that spell its poses out."""

import numpy as np
import pytest

from rislam_rt.slam.window.smoother import window_features, window_gaussian
from rislam_rt.slam.window.smoother.direction_priors import no_holds
from rislam_rt.slam.window.smoother.marginals import pose_covariance, prediction_variance
from rislam_rt.slam.window.smoother.motion_basis import HEAD


def drawn(turns):
    """A window of five poses and two features, of any covariance."""
    rng = np.random.default_rng(6)
    window = window_gaussian.begin(np.zeros(3), np.ones(3), np.full(7, 0.1), turns=turns)
    for _ in range(2):
        window = window_features.add_feature(window, rng.standard_normal(3), no_holds())
    for _ in range(4):
        step, angle = rng.uniform(0.05, 0.2), rng.uniform(-0.5, 0.5)
        window = window_gaussian.extend(window, float(step), np.ones(3 + turns), velocity_turn=float(angle))
    root = rng.standard_normal(window.covariance.shape)
    return window._replace(covariance=root @ root.T)


def spelt_out(window):
    """Matrix (K, 4 + 3F, D) from the window's unknowns to each pose and the features, by differences of `poses`."""
    head, accel = window.head.copy(), window.accel
    unknown = np.append(head, accel)

    def at(values):
        moved = window._replace(head=values[: len(head)], accel=values[len(head) :].reshape(accel.shape))
        place = window_gaussian.poses(moved)
        return np.concatenate([place, np.tile(values[HEAD : len(head)], (len(place), 1))], axis=1)

    return np.stack([at(unknown + row) - at(unknown) for row in np.eye(len(unknown))], axis=-1)


@pytest.mark.parametrize("turns", [False, True])
def test_the_variance_of_a_prediction_is_that_of_its_pose_and_features(turns):
    window, rng = drawn(turns), np.random.default_rng(7)
    whole = spelt_out(window)
    for slot in (np.array([0, 2, 2, 4]), np.array([4, 4])):
        slopes = rng.standard_normal((len(slot), 3, 10))
        rows = slopes @ whole[slot]
        wanted = np.einsum("nad,de,nae->na", rows, window.covariance, rows)
        np.testing.assert_allclose(prediction_variance(window, slot, slopes), wanted, rtol=1e-9)
    assert prediction_variance(window, slot[:0], slopes[:0]).shape == (0, 3)


@pytest.mark.parametrize("turns", [False, True])
def test_the_covariance_of_all_poses_along_an_axis(turns):
    window = drawn(turns)
    whole = spelt_out(window)
    for axis in range(3 + turns):
        wanted = whole[:, axis] @ window.covariance @ whole[:, axis].T
        np.testing.assert_allclose(pose_covariance(window, axis), wanted, rtol=1e-9, atol=1e-9)
