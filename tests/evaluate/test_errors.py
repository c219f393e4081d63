"""Errors of trajectories and walls against figures worked out by hand."""

import numpy as np
import pytest

from rislam_rt.errors import GeometryError
from rislam_rt.evaluate import align, rmse, trajectory_error
from rislam_rt.geometry.angles import rotation_z

TRUTH = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [2.0, 1.0, 1.0], [2.0, 3.0, 1.0]])


def test_rmse_of_a_3_4_5_triangle():
    assert rmse(np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]]), np.zeros((2, 3))) == pytest.approx(np.sqrt(12.5))
    with pytest.raises(GeometryError, match="at least one"):
        rmse(np.zeros((0, 3)), np.zeros((0, 3)))


def test_constant_offset_is_all_absolute_error_and_no_drift():
    score = trajectory_error(TRUTH + np.array([0.3, 0.0, 0.4]), TRUTH)
    assert score.rmse == pytest.approx(0.5)
    assert score.median == pytest.approx(0.5)
    assert score.final == pytest.approx(0.5)
    # float64 rounding of metres
    assert score.drift == pytest.approx(0.0, abs=1e-12)
    assert score.rmse_aligned == pytest.approx(0.0, abs=1e-12)


def test_growing_offset_drifts_by_its_growth():
    score = trajectory_error(TRUTH + np.arange(4)[:, None] * np.array([0.0, 0.1, 0.0]), TRUTH, step=2)
    assert score.drift == pytest.approx(0.2)
    assert score.largest == pytest.approx(0.3)


def test_heading_errors_wrap():
    turn = np.full(4, np.pi - 0.05)
    score = trajectory_error(TRUTH, TRUTH, heading=turn + 0.1, true_heading=turn - 2.0 * np.pi)
    assert score.heading == pytest.approx(0.1)


def test_alignment_undoes_a_turn_about_z_and_a_shift():
    moved = TRUTH @ rotation_z(np.array(0.7)).T + np.array([5.0, -2.0, 0.3])
    np.testing.assert_allclose(align(moved, TRUTH), TRUTH, atol=1e-12)


def test_trajectories_of_different_lengths_are_refused():
    with pytest.raises(GeometryError, match="same"):
        trajectory_error(TRUTH[:3], TRUTH)
