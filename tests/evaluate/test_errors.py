"""Errors of positions against figures worked out by hand, and the alignment of a trajectory."""

import numpy as np
import pytest

from rislam_rt.errors import GeometryError
from rislam_rt.evaluate import align, rmse
from rislam_rt.geometry.angles import rotation_z

TRUTH = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [2.0, 1.0, 1.0], [2.0, 3.0, 1.0]])


def test_rmse_of_a_3_4_5_triangle():
    assert rmse(np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]]), np.zeros((2, 3))) == pytest.approx(np.sqrt(12.5))
    with pytest.raises(GeometryError, match="at least one"):
        rmse(np.zeros((0, 3)), np.zeros((0, 3)))


def test_alignment_undoes_a_turn_about_z_and_a_shift():
    moved = TRUTH @ rotation_z(np.array(0.7)).T + np.array([5.0, -2.0, 0.3])
    np.testing.assert_allclose(align(moved, TRUTH), TRUTH, atol=1e-12)
