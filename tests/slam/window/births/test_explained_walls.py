"""Walls that two others explain: the image of a corner, of floor and ceiling; and walls that stand for themselves."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import NONE, TX, reflect
from rislam_rt.slam.window.births.explained_walls import (
    explained_walls,
    log_explained,
    log_own_place,
    nearer_pairs,
)
from rislam_rt.slam.window.landmarks.duplicate_walls import log_same_place
from rislam_rt.slam.window.landmarks.landmark_table import empty_table, enter
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.landmarks.ris_identification import unknown
from rislam_rt.slam.window.measurement_log import empty_log
from rislam_rt.slam.window.smoother import window_gaussian

MIDDLE = np.array([1.0, 2.0, 1.2])
ELSEWHERE = MIDDLE + np.array([1.4, -0.5, 0.0])
SIDE, END, CEILING, FLOOR = (-1.0, 0.0, 0.0, 1.1), (0.0, 1.0, 0.0, 1.2), (0.0, 0.0, 1.0, 1.6), (0.0, 0.0, -1.0, 1.2)
"""Outward normals and distances [m] from `MIDDLE` of four walls of a room."""
FAR = (0.8, 0.6, 0.0, 9.0)
"""A wall that takes no part."""


def _over_both(walls, spot):
    """Image of `spot` over two walls, each a normal and a distance from `MIDDLE`."""
    for *normal, distance in walls:
        wall = MIDDLE + 2.0 * distance * np.array(normal)
        spot = reflect(spot, wall, MIDDLE)
    return spot


def _context(monkeypatch, walls, born, *, off=0.0, std=1e-3, heard=None, order=(0, 1, 2, 3, 4), use_vt=True):
    """State of a filter whose map holds a point, a far wall, two walls and the wall that was born at `born` of the
    return over both; all known within `std` [m] and in part together, the last wall `off` [m] farther. `heard` is where
    that wall was last heard by itself."""
    image = _over_both(walls, born)
    image += 2.0 * off * (image - born) / np.linalg.norm(image - born)
    places = [np.array([3.0, 3.0, 1.0]), *(MIDDLE + 2.0 * d * np.array(n) for *n, d in (FAR, *walls)), image]
    anchors = [MIDDLE, MIDDLE, MIDDLE, MIDDLE, born]
    landmarks = empty_table(1)
    for row in order:
        landmarks = enter(landmarks, row > 0, anchors[row], 10, 5.0, unknown(1, 1))
    root = np.random.default_rng(3).standard_normal((15, 15))
    mean = np.concatenate([np.zeros(7), np.concatenate([places[row] for row in order])])
    covariance = np.zeros((22, 22))
    size = std * np.repeat(
        np.array([9.0, 3.0, 1.0, 1.0, 1.0])[list(order)], 3
    )  # those that take no part are known worse
    covariance[7:, 7:] = size[:, None] * (0.5 * np.eye(15) + 0.5 * root @ root.T / 15.0) * size
    monkeypatch.setattr(window_gaussian, "now", lambda window: (mean, covariance))
    where = np.tile(np.append(born if heard is None else heard, 0.0), (2, 1))
    monkeypatch.setattr(window_gaussian, "poses", lambda window: where)
    form = np.full((1, 2, 5), UNKNOWN)
    if heard is not None:
        form[0, 0] = [TX, NONE, NONE, landmarks.ident[order.index(4)], NONE]
    log = empty_log()._replace(cycle=np.array([9]), form=form)
    return SimpleNamespace(landmarks=landmarks, scene=SimpleNamespace(use_vt=use_vt), window=None, log=log, cycle=10)


def _asked(monkeypatch, *case, order=(0, 1, 2, 3, 4), **settings):
    """Which features of `_context` are explained."""
    context = _context(monkeypatch, *case, order=order, **settings)
    return [order[row] for row in np.flatnonzero(explained_walls(context))]


@pytest.mark.parametrize("walls", [(SIDE, END), (CEILING, END), (FLOOR, CEILING)])
@pytest.mark.parametrize("born", [MIDDLE, ELSEWHERE])
def test_the_return_over_two_walls_is_no_third(monkeypatch, walls, born):
    assert _asked(monkeypatch, walls, born) == [4]
    assert _asked(monkeypatch, walls, born, order=(4, 0, 3, 1, 2)) == [4]
    assert _asked(monkeypatch, walls, born, heard=born + np.array([0.0, 0.0, 1e-3])) == [4]


@pytest.mark.parametrize("walls", [(SIDE, END), (FLOOR, CEILING)])
@pytest.mark.parametrize("off", [-0.1, 0.1])
def test_a_corner_cut_off_and_a_loft_are_walls_of_their_own(monkeypatch, walls, off):
    assert _asked(monkeypatch, walls, ELSEWHERE, off=off) == []


def test_a_wall_that_was_heard_where_the_two_do_not_throw_it_is_one_of_its_own(monkeypatch):
    assert _asked(monkeypatch, (SIDE, END), MIDDLE, heard=ELSEWHERE) == []
    assert _asked(monkeypatch, (FLOOR, CEILING), MIDDLE, heard=ELSEWHERE) == [4]  # along the ceiling they always do


def test_a_third_wall_that_is_known_badly_may_be_one_of_its_own(monkeypatch):
    assert _asked(monkeypatch, (SIDE, END), MIDDLE, std=3.0) == []


def test_without_wall_returns_no_wall_was_born_of_one(monkeypatch):
    assert _asked(monkeypatch, (SIDE, END), MIDDLE, use_vt=False) == []


def test_the_decision_is_by_the_posterior_odds(monkeypatch):
    decided, expected = [], []
    for off in np.linspace(0.0, 0.06, 61):
        context = _context(monkeypatch, (SIDE, END), MIDDLE, off=off, std=3e-3)
        mean, covariance = window_gaussian.now(None)
        place = mean[7:].reshape(-1, 3)
        blocks = covariance[7:, 7:].reshape(5, 3, 5, 3).swapaxes(1, 2)
        anchor = np.tile(MIDDLE, (5, 1))
        both = np.array([[4, 2, 3], [4, 3, 2]])
        one = log_explained(anchor[:2], both, place, anchor, blocks).max()
        two = log_own_place(place[4], blocks[4, 4], MIDDLE, place[[1, 2, 3]])
        odds = one + np.log(CONSTANTS.rare) - np.log(2.0) - two  # of two ordered pairs of the two nearer walls
        decided.append(bool(explained_walls(context)[4]))
        expected.append(1.0 / (1.0 + np.exp(-odds)) > CONSTANTS.born)
    assert decided == expected
    assert 10 < sum(expected) < 50


def test_a_path_that_cannot_be_explains_nothing(monkeypatch):
    angle = np.radians(115.0)  # of the second normal; the corner is as wide, and nobody hears itself over both faces
    wide = (np.cos(angle), np.sin(angle), 0.0, 1.2)
    assert _asked(monkeypatch, ((-1.0, 0.0, 0.0, 1.1), wide), MIDDLE) == []


def test_density_of_the_gap_is_that_of_the_images_to_first_order():
    rng, count = np.random.default_rng(0), 4
    anchor = rng.uniform(0.0, 4.0, (count, 3))
    place = anchor + rng.uniform(2.0, 6.0, (count, 1)) * (lambda v: v / np.linalg.norm(v, axis=1)[:, None])(
        rng.standard_normal((count, 3))
    )
    rows, spot = np.array([[0, 1, 2], [3, 2, 0]]), rng.uniform(0.0, 4.0, (2, 3))
    root = 0.05 * rng.standard_normal((3 * count, 3 * count))
    covariance = root @ root.T

    def gap(places, row, at):
        wall, first, second = rows[row]
        inner = reflect(at, places[first], anchor[first])
        return reflect(inner, places[second], anchor[second]) - reflect(at, places[wall], anchor[wall])

    found = log_explained(spot, rows, place, anchor, covariance.reshape(count, 3, count, 3).swapaxes(1, 2))
    for row in range(2):
        slopes = np.zeros((3, 3 * count))
        for column in range(3 * count):
            move = np.zeros(3 * count)
            move[column] = 1e-6
            sides = (gap(place + sign * move.reshape(count, 3), row, spot[row]) for sign in (1.0, -1.0))
            slopes[:, column] = (next(sides) - next(sides)) / 2e-6
        spread = slopes @ covariance @ slopes.T
        exact = scipy.stats.multivariate_t(np.zeros(3), spread, df=CONSTANTS.tail)
        assert found[row] == pytest.approx(exact.logpdf(gap(place, row, spot[row])), rel=1e-4)


def test_the_more_pairs_the_less_one_of_them_says():
    places = np.array([MIDDLE + 2.0 * d * np.array(n) for *n, d in (SIDE, END, CEILING, FLOOR)])
    image = _over_both((SIDE, END), MIDDLE)
    every = np.concatenate([places, image[None]])
    rows, pairs = nearer_pairs(every, np.tile(MIDDLE, (5, 1)))
    assert {tuple(row) for row in rows.tolist()} >= {(4, 0, 1), (4, 1, 0)}
    nearer = (np.linalg.norm(places - MIDDLE, axis=1) < np.linalg.norm(image - MIDDLE)).sum()
    assert pairs[(rows[:, 0] == 4)].tolist() == [nearer * (nearer - 1.0)] * int((rows[:, 0] == 4).sum())


def test_a_wall_of_its_own_is_upright_or_at_right_angles_rather_than_slanting():
    others, spread = MIDDLE + np.array([[4.0, 0.0, 0.0]]), 1e-4 * np.eye(3)
    along, aside, slant = (
        log_own_place(MIDDLE + 4.0 * np.array(n), spread, MIDDLE, others)
        for n in ((0.0, 1.0, 0.0), (0.6, 0.8, 0.0), (0.0, 0.7, np.sqrt(0.51)))
    )
    anywhere = -np.log(8.0 * np.pi * CONSTANTS.size * 16.0)
    assert along > aside > anywhere > slant
    assert slant == pytest.approx(anywhere + np.log(1.0 - CONSTANTS.upright))


def test_log_density_is_students():
    gap, spread = np.array([[0.1, -0.2, 0.05]]), np.diag([0.01, 0.02, 0.03])[None]
    exact = scipy.stats.multivariate_t(np.zeros(3), spread[0], df=CONSTANTS.tail).logpdf(gap[0])
    assert log_same_place(gap, spread)[0] == pytest.approx(exact, rel=1e-12)
