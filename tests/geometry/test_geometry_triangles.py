"""Triangles: planes, groups, outlines and distances."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rislam_rt.geometry.plane_segmentation import planar_regions
from rislam_rt.geometry.triangles import (
    distance_to_edges,
    distance_to_triangles,
    edge_planes,
    outline_edges,
    triangle_planes,
)

RIGHT = np.array([[[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]]])
SQUARE = np.array([[[0, 0, 1], [1, 0, 1], [1, 1, 1]], [[0, 0, 1], [1, 1, 1], [0, 1, 1]]], dtype=float)


def test_planes():
    normal, offset = triangle_planes(SQUARE)
    np.testing.assert_allclose(normal, [[0, 0, 1]] * 2)
    np.testing.assert_allclose(offset, [1, 1])


def test_edge_planes_of_a_right_triangle():
    normal, offset = edge_planes(RIGHT)
    # the inscribed circle of the 3-4-5 triangle has radius 1 about (1, 1)
    np.testing.assert_allclose(normal[0] @ [1.0, 1.0, 0.0] - offset[0], [1.0, 1.0, 1.0])
    np.testing.assert_allclose((normal[0] @ [4.0, 3.0, 0.0] - offset[0]).min(), -2.4)


def test_nothing_lies_inside_a_degenerate_triangle():
    line = np.array([[[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]]])
    normal, offset = edge_planes(line)
    assert (normal[0] @ [0.5, 0.0, 0.0] - offset[0]).min() == -np.inf
    assert distance_to_triangles(np.array([[0.5, 1.0, 0.0]]), line)[0] == pytest.approx(1.0)


def test_planar_groups_ignore_orientation_and_part_parallel_planes():
    flipped = SQUARE[1][::-1]
    above = SQUARE[0] + [0.0, 0.0, 0.01]
    upright = np.array([[0, 0, 1], [1, 0, 1], [1, 0, 2]], dtype=float)
    groups = planar_regions(
        np.stack([SQUARE[0], above, flipped, upright, above + np.array([5.0, 5.0, 0.0])]), 1e-4, 1e-4
    ).group
    np.testing.assert_array_equal(groups, [0, 1, 0, 2, 1])


def test_the_outline_of_a_square_is_its_four_sides():
    edges = outline_edges(SQUARE)
    assert len(edges) == 4
    np.testing.assert_allclose(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1), 1.0)
    middle = np.array([[0.5, 0.5, 1.0], [0.5, 0.25, 1.0], [0.5, 0.5, 3.0], [2.0, 1.0, 1.0]])
    np.testing.assert_allclose(distance_to_edges(middle, edges), [0.5, 0.25, np.hypot(2.0, 0.5), 1.0])
    assert len(outline_edges(SQUARE[:0])) == 0
    assert distance_to_edges(middle, edges[:0]).tolist() == [np.inf] * 4


@given(st.integers(0, 10_000))
def test_distance_to_triangles_against_a_dense_sampling(seed):
    rng = np.random.default_rng(seed)
    triangles, points = rng.normal(size=(3, 3, 3)), 2.0 * rng.normal(size=(4, 3))
    grid = np.array([(i, j, 40 - i - j) for i in range(41) for j in range(41 - i)]) / 40.0
    samples = np.einsum("sc,tci->tsi", grid, triangles).reshape(-1, 3)
    nearest = np.linalg.norm(points[:, None] - samples, axis=-1).min(axis=1)
    distance = distance_to_triangles(points, triangles)
    spacing = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=-1).max() / 40.0
    assert (distance <= nearest + 1e-12).all()  # no sample is nearer than the nearest point
    assert (distance >= nearest - spacing).all()  # and one sample is not far from it
