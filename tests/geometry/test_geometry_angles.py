"""Angles: round trips, ranges and small angles."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rislam_rt.geometry.angles import angle_between, angles_from_direction, rotation_z, unit, wrap

azimuth = st.floats(-np.pi, np.pi, exclude_min=True)


@given(st.floats(1e-3, np.pi - 1e-3), azimuth)
def test_angles_and_directions_are_inverse(theta, phi):
    direction = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    back = angles_from_direction(3.7 * direction)
    assert back[0] == pytest.approx(theta, abs=1e-12)
    assert wrap(back[1] - phi) == pytest.approx(0.0, abs=1e-11)


def test_conventions():
    theta, phi = angles_from_direction(np.array([[0, 0, 2], [0, 0, -1], [-1, 0, 0], [0, 5, 0]], dtype=float))
    np.testing.assert_allclose(theta, [0.0, np.pi, np.pi / 2, np.pi / 2])
    np.testing.assert_allclose(phi, [0.0, 0.0, np.pi, np.pi / 2])


@given(st.floats(-100.0, 100.0), st.integers(-5, 5))
def test_wrap_keeps_the_angle_and_its_range(angle, turns):
    wrapped = wrap(angle)
    assert -np.pi < wrapped <= np.pi
    assert np.sin(wrapped) == pytest.approx(np.sin(angle), abs=1e-12)
    assert np.cos(wrap(angle + 2 * np.pi * turns)) == pytest.approx(np.cos(angle), abs=1e-12)


def test_wrap_at_the_seam():
    assert wrap(np.pi) == np.pi
    assert wrap(-np.pi) == np.pi


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, np.pi])
def test_angle_between_is_exact_for_small_angles_too(angle):
    a = np.array([1.0, 0.0, 0.0])
    b = np.array([np.cos(angle), np.sin(angle), 0.0])
    assert angle_between(a, 2.0 * b) == pytest.approx(angle, rel=1e-9, abs=1e-15)


def test_unit_leaves_zero_alone():
    np.testing.assert_array_equal(unit(np.zeros((2, 3))), np.zeros((2, 3)))


@given(azimuth)
def test_rotation_z_turns_forward_to_the_heading(heading):
    matrix = rotation_z(heading)
    np.testing.assert_allclose(matrix @ [1.0, 0.0, 0.0], [np.cos(heading), np.sin(heading), 0.0], atol=1e-15)
    np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(matrix) == pytest.approx(1.0)
