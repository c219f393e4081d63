"""Reciprocal paths: which tracks are one path both ways round, and what their lengths tell of the motion."""

import numpy as np
import pytest

from rislam_rt.slam.window.measurement_log import empty_log
from rislam_rt.slam.window.motion import track_rates
from rislam_rt.slam.window.motion.length_rates import Heard, lengths, rates
from rislam_rt.slam.window.reciprocal_paths import with_reciprocal

STEP, COUNT = 0.1, 10
APART = np.array([-0.06, -0.04, 0.02])
"""From Rx to Tx, in the axes of a body that does not turn."""
NORTH, SOUTH_WEST = (np.array([0.0, 1.0, 0.0]), 5.0), (np.array([-0.6, -0.8, 0.0]), 1.5)


def _mirror(place, wall):
    normal, offset = wall
    return place - 2.0 * ((place @ normal) - offset)[..., None] * normal


def _over(walls, place):
    """Lengths and directions of arrival of the paths over walls in their order, by the mirror images of the Tx."""
    image = place + 0.5 * APART
    for wall in walls:
        image = _mirror(image, wall)
    way = image - (place - 0.5 * APART)
    length = np.linalg.norm(way, axis=1)
    return length, way / length[:, None]


def _log(paths, std=1e-3, amplitude=()):
    """Log of a track for each path, whose (K,) lengths and (K, 3) directions of arrival are given."""
    loud = amplitude or [-10.0] * len(paths)
    count, log = COUNT * len(paths), empty_log()
    zeros = {name: np.zeros((count, *getattr(log, name).shape[1:]), getattr(log, name).dtype) for name in log._fields}
    seen = np.stack([np.column_stack([length, arrival[:, :2]]) for length, arrival in paths], axis=1)
    return log._replace(**{
        **zeros, "seen": seen.reshape(count, 3), "std": np.full((count, 3), std), "form": zeros["form"] - 9,
        "cycle": np.repeat(np.arange(COUNT), len(paths)), "track": np.tile(np.arange(len(paths)), COUNT),
        "log_amplitude": np.tile(loud, COUNT), "log_amplitude_std": np.full(count, 0.05),
    })  # fmt: skip


def _pairs(log):
    rows = np.arange(len(log.cycle))
    found = with_reciprocal(log, log.both_ends(rows, log.track, 0.5), APART)
    return found, {tuple(pair) for pair in found.legs[found.owner.max() + 1 :].tolist()}


@pytest.fixture
def place():
    """(K, 3) [m] an agent that goes north, and a little east."""
    return np.array([[0.3, 0.4, 0.1]]) + STEP * np.arange(COUNT)[:, None] * [0.2, 0.7, 0.0]


def test_a_path_over_two_walls_and_its_reciprocal_are_found(place):
    """By lengths 3 cm and more apart, as Tx and Rx are; the single return is as loud and a little longer."""
    single = _over([NORTH], place)
    both = [_over(walls, place) for walls in ([NORTH, SOUTH_WEST], [SOUTH_WEST, NORTH])]
    assert (np.abs(both[0][0] - both[1][0]) > 0.03).all()
    found, pairs = _pairs(_log([*both, (both[0][0] + 0.02, single[1])]))
    assert pairs == {(0, 1), (1, 0)}
    assert np.bincount(found.which).tolist() == [COUNT] * 5
    np.testing.assert_array_equal(found.owner, [0, 1, 2, 0, 1])


def test_what_is_as_long_by_chance_or_not_as_loud_is_none(place):
    both = [_over(walls, place) for walls in ([NORTH, SOUTH_WEST], [SOUTH_WEST, NORTH])]
    assert not _pairs(_log(both, amplitude=[-10.0, -11.0]))[1]
    assert not _pairs(_log([both[0], (both[1][0] + 0.02, both[1][1])]))[1]
    seldom = (both[1][0] + 0.02 * (np.arange(COUNT) % 3 > 0), both[1][1])
    assert not _pairs(_log([both[0], seldom]))[1]


@pytest.mark.parametrize("heading", [0.0, 0.7])
def test_their_rates_are_those_along_both_directions(place, heading):
    """Against the change of the lengths themselves; along the direction of arrival alone they are others."""
    cos, sin = np.cos(heading), np.sin(heading)
    body = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    paths = [_over(walls, place) for walls in ([NORTH, SOUTH_WEST], [SOUTH_WEST, NORTH])]
    log = _log([(length, arrival @ body.T) for length, arrival in paths])
    found = rates(lengths(Heard(log, np.full(COUNT, heading), place, STEP, body @ APART, 0.5)))
    velocity = (place[-1] - place[0]) / (STEP * (COUNT - 1))
    assert found.owner.tolist() == [0, 1, 0, 1]
    true = [(length[-1] - length[0]) / (STEP * (COUNT - 1)) for length, _ in paths]
    np.testing.assert_allclose(found.rate[2:], true, atol=2e-3)  # of lengths of 12 m, over a way of 0.7 m
    np.testing.assert_allclose(found.toward[2:] @ velocity, true, atol=5e-3)
    assert (np.abs(found.toward[:2] @ velocity - true) > 0.3).all()


def test_an_unexplained_pair_speaks_for_the_motion_that_it_has(place):
    """The directions by which the window weighs it, against the change of the lengths from cycle to cycle."""
    paths = [_over(walls, place) for walls in ([NORTH, SOUTH_WEST], [SOUTH_WEST, NORTH])]
    log = _log(paths)
    rows = np.lexsort((log.cycle, log.track))
    ends = with_reciprocal(log, log.both_ends(rows, log.track[rows], 0.5), APART)
    toward, variance = track_rates._directions(np.zeros(COUNT), ends, log.cycle[ends.row], STEP * log.cycle[ends.row])
    assert variance.shape == (4,)
    for number, (length, _) in enumerate(paths):
        way = toward[ends.which == 2 + number]
        moved = np.vecdot(0.5 * (way[1:] + way[:-1]), np.diff(place, axis=0))
        np.testing.assert_allclose(moved, np.diff(length), atol=5e-4)  # the baseline of 7 cm at 11 m, of a step of 7 cm
