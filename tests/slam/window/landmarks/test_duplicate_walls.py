"""Planes that are one wall, and planes that are two: what the map shows of them."""

import numpy as np
import pytest

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.estimates import build_map
from rislam_rt.slam.window.landmarks.duplicate_walls import same_wall, second_planes
from rislam_rt.slam.window.landmarks.landmark_table import empty_table, enter
from rislam_rt.slam.window.landmarks.ris_identification import unknown

MIDDLE = np.array([1.0, 2.0, 1.2])
FAR = 4.0
"""[m] from the agent to the first wall."""


def _walls(behind, lean, std=1e-3):
    """Images (2, 3) of the agent in an upright wall and in another, by so much [m] behind it and leaning [rad]; and
    their covariance (6, 6), the images being known within `std` [m] along the normal and 2 mrad."""
    places, blocks = [], np.zeros((6, 6))
    for row, (distance, angle) in enumerate(((FAR, 0.0), (FAR + behind, lean))):
        normal = np.array([np.cos(angle), 0.0, np.sin(angle)])
        places.append(MIDDLE + 2.0 * distance * normal)
        across = (2.0 * distance * 2e-3) ** 2
        blocks[3 * row : 3 * row + 3, 3 * row : 3 * row + 3] = (
            across * np.eye(3) + (4.0 * std**2 - across) * normal[:, None] * normal
        )
    return np.array(places), blocks


def _log_odds(behind, lean, std=1e-3):
    places, covariance = _walls(behind, lean, std)
    blocks = covariance.reshape(2, 3, 2, 3).swapaxes(1, 2)
    return same_wall(places, blocks, np.tile(MIDDLE, (2, 1)), MIDDLE)


def _table():
    landmarks = empty_table(1)
    for _ in range(2):
        landmarks = enter(landmarks, True, MIDDLE, 10, 5.0, unknown(1, 1))
    return landmarks


@pytest.mark.parametrize(("behind", "lean"), [(0.0, 0.0), (0.003, 0.002), (0.0, 0.025), (0.01, -0.015)])
def test_two_copies_of_one_wall_are_one(behind, lean):
    odds = _log_odds(behind, lean)
    np.testing.assert_allclose(odds, odds.T, atol=0.1)  # whichever is asked first, but for the square of 1 / FAR
    assert odds[0, 1] > CONSTANTS.log_born


@pytest.mark.parametrize(("behind", "lean"), [(-0.3, 0.0), (-0.6, 0.005), (0.15, 0.0), (0.0, 0.3)])
def test_a_cabinet_a_screen_and_a_slant_are_walls_of_their_own(behind, lean):
    assert _log_odds(behind, lean)[0, 1] < 0.0


def test_what_is_known_badly_may_be_either():
    assert _log_odds(0.3, 0.0, std=0.2)[0, 1] > _log_odds(0.3, 0.0)[0, 1] + 5.0


def test_the_map_shows_one_plane_of_a_wall_the_one_that_stands_upright():
    places, covariance = _walls(0.003, 0.02)
    assert second_planes(places, covariance, _table(), np.arange(2), MIDDLE).tolist() == [False, True]
    found = build_map(places, covariance, _table(), np.zeros(3), MIDDLE, np.zeros(2))
    np.testing.assert_allclose(found.wall_normal, [[1.0, 0.0, 0.0]], atol=1e-12)
    swapped = np.kron([[0, 1], [1, 0]], np.eye(3))
    turned = second_planes(places[::-1], swapped @ covariance @ swapped, _table(), np.arange(2), MIDDLE)
    assert turned.tolist() == [True, False]


def test_the_map_shows_a_cabinet_and_the_wall_behind_it():
    places, covariance = _walls(-0.3, 0.0)
    found = build_map(places, covariance, _table(), np.zeros(3), MIDDLE, np.zeros(2))
    np.testing.assert_allclose(np.diff(found.wall_offset), [-0.3], atol=1e-12)


def test_an_agent_that_stands_in_a_plane_is_no_trouble():
    places, covariance = _walls(-0.3, 0.0)
    blocks = covariance.reshape(2, 3, 2, 3).swapaxes(1, 2)
    foot = MIDDLE + np.array([FAR, 0.0, 0.0])  # half way to the first image
    with np.errstate(all="raise"):
        odds = same_wall(places, blocks, np.tile(MIDDLE, (2, 1)), foot)
    assert np.isfinite(odds).all()
    assert odds[0, 1] < 0.0
