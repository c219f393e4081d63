"""Planes against true walls: a hand-made room of two surfaces, one large, one small."""

import numpy as np
import pytest

from rislam_rt.evaluate import NEAR_ANGLE, Surfaces, ghost_planes, match_planes, plane_angle, plane_distance

LARGE, SMALL = 0, 1
SIDES = np.array([[0.0, 6.0, 3.0], [0.4, 0.0, 0.6]])
WALLS = Surfaces(
    np.array([[5.0, 3.0, 1.5], [2.0, 1.0, 0.3]]),
    np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    np.array([np.diag(side**2 / 12.0) for side in SIDES]),
)
"""Rectangles: the variance along a side of length a is a^2 / 12."""


def through_middle(wall, normal):
    normal = np.array([normal], dtype=np.float64) / np.linalg.norm(normal)
    return normal, normal @ WALLS.middle[wall]


def test_distance_is_the_mean_over_the_surface():
    normal, offset = through_middle(LARGE, [1.0, 0.3, -0.2])
    points = WALLS.middle[LARGE] + np.random.default_rng(0).uniform(-0.5, 0.5, (200_000, 3)) * SIDES[LARGE]
    sampled = np.sqrt(np.mean((points @ normal[0] - offset - 0.2) ** 2))
    # relative sampling error of a mean of squares over 200 000 points: below 0.3 %, halved by the root; 4 sigma
    assert plane_distance(WALLS, normal, offset + 0.2)[LARGE, 0] == pytest.approx(sampled, rel=6e-3)


@pytest.mark.parametrize("angle", [0.0, 0.01, 45.0, 90.0])
def test_angle_knows_no_side(angle):
    tilt = np.radians(angle)
    normal = np.array([[np.cos(tilt), np.sin(tilt), 0.0]])
    for sign in (1.0, -1.0):
        np.testing.assert_allclose(plane_angle(WALLS, sign * normal)[:, 0], [angle, 90.0 - angle], atol=1e-9)


def test_a_plane_at_right_angles_to_a_small_surface_is_a_ghost():
    for normal in ([1.0, 0.0, 0.0], [0.0, 0.0, 1.0]):
        plane = through_middle(SMALL, normal)
        assert plane_distance(WALLS, *plane)[SMALL, 0] < 0.2
        assert (match_planes(WALLS, *plane) == -1).all()
        assert ghost_planes(WALLS, *plane).tolist() == [True]


@pytest.mark.parametrize("wall", [LARGE, SMALL])
@pytest.mark.parametrize(("angle", "found"), [(1.0, True), (NEAR_ANGLE - 0.1, True), (NEAR_ANGLE + 0.1, False)])
def test_a_tilted_wall_is_found_up_to_the_limit(wall, angle, found):
    tilt = np.radians(angle)
    plane = through_middle(wall, np.cos(tilt) * WALLS.normal[wall] + np.sin(tilt) * np.array([0.0, 0.0, 1.0]))
    assert (match_planes(WALLS, *plane)[wall] == 0) == found
    assert ghost_planes(WALLS, *plane).tolist() == [not found]


def test_pairs_are_one_to_one_and_of_heard_walls():
    normal, offset = np.tile(WALLS.normal[LARGE], (2, 1)), 5.0 + np.array([0.3, 0.01])
    assert match_planes(WALLS, normal, offset).tolist() == [1, -1]
    assert ghost_planes(WALLS, normal, offset).tolist() == [True, False]
    assert match_planes(WALLS, normal, offset, np.array([False, True])).tolist() == [-1, -1]


def test_an_exact_plane_is_not_given_up_for_one_beyond_the_limit():
    """A ceiling at 2 m, a floor at 0; estimates 1 cm below the one, 1.2 m above it. If pairs counted beyond the limit,
    the crossed pairs' 1.99 + 1.2 m would beat 0.01 + 3.2 m, and neither is near."""
    level = np.tile([0.0, 0.0, 1.0], (2, 1))
    walls = Surfaces(np.array([[1.0, 1.0, 2.0], [1.0, 1.0, 0.0]]), level, np.zeros((2, 3, 3)))
    for order in ([0, 1], [1, 0]):
        normal, offset = level, np.array([1.99, 3.2])[order]
        assert match_planes(walls, normal, offset).tolist() == [order.index(0), -1]
        assert ghost_planes(walls, normal, offset).tolist() == [bool(far) for far in order]


def test_nothing_stands_for_nothing():
    empty = np.zeros((0, 3)), np.zeros(0)
    assert match_planes(WALLS, *empty).tolist() == [-1, -1]
    assert ghost_planes(WALLS, *empty).tolist() == []
    nowhere = Surfaces(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3, 3)))
    assert ghost_planes(nowhere, *through_middle(LARGE, [1.0, 0.0, 0.0])).tolist() == [True]
