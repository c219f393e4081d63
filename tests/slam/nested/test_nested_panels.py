"""Which landmark is which panel: several data sheets, one point each at most."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.model import Body, Measurement, RadioConfig, RisCode, RisSpec, RisSpecs, SensorModel
from rislam_rt.ris.path_gain import panel_path_gain
from rislam_rt.slam.identity import panel_probabilities
from rislam_rt.slam.inputs import check_sides
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.nested.belief_moments import POSE, Moments
from rislam_rt.slam.nested.candidates import return_sides
from rislam_rt.slam.nested.landmark_table import LandmarkTable, empty_table, enter
from rislam_rt.slam.nested.measurement_prediction import MapBelief
from rislam_rt.slam.nested.panel_candidate import find_panel_candidate, weigh_tracks
from rislam_rt.slam.nested.tracks import LandmarkTracks, advance, begin, extend, no_tracks
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD, Observations, side_of
from rislam_rt.slam.returns import TX, Returns, observe

RADIO, BODY, THRESHOLD = RadioConfig(noise_psd=3.52e-12), Body(), 10.0
SHEET = RisSpec(6, 6, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
SHEETS = RisSpecs((SHEET, SHEET))
AGENT = Moments(np.concatenate([[2.0, 2.5, 0.5], np.zeros(3), [0.4]]), 1e-6 * np.eye(POSE))
POSES = poses_of(AGENT.position, np.asarray(AGENT.heading), BODY)
SPOTS = np.array([[3.0, 3.0, 3.0], [1.5, 3.2, 3.0], [2.0, 1.0, 1.5]])
"""Two panels of one data sheet, and a scatterer."""


@pytest.mark.parametrize(("points", "panels"), [(4, 1), (4, 2), (1, 2), (5, 3), (2, 3)])
def test_probabilities_are_those_of_all_ways_to_share_points_out(points: int, panels: int) -> None:
    table = np.random.default_rng(points).normal(0.0, 2.0, (points, panels))
    total, each = 0.0, np.zeros(table.shape)
    for choice in product(range(-1, points), repeat=panels):
        taken = [point for point in choice if point >= 0]
        if len(taken) > len(set(taken)):
            continue
        weight = np.exp(sum(table[point, panel] for panel, point in enumerate(choice) if point >= 0))
        total += weight
        for panel, point in enumerate(choice):
            if point >= 0:
                each[point, panel] += weight
    np.testing.assert_allclose(panel_probabilities(table), each / total, rtol=1e-12)
    if panels == 1:
        np.testing.assert_array_equal(panel_probabilities(table[:, 0]), panel_probabilities(table)[:, 0])


def test_certain_panels_and_impossible_ones_stay_so() -> None:
    table = np.array([[30.0, -30.0], [-np.inf, 30.0], [-np.inf, -np.inf]])
    np.testing.assert_allclose(panel_probabilities(table), [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], atol=1e-12)
    # a point that either may be is one of them
    assert panel_probabilities(np.full((1, 2), 20.0)).sum() == pytest.approx(1.0, abs=1e-8)


def follow(cycles: int, sides: bool, rng: np.random.Generator) -> LandmarkTracks:
    """The spots under a new random code a cycle; `sides`: the receiver tells whose signs a component has."""
    noise = np.sqrt(RADIO.noise_psd / (2.0 * RADIO.array.num_antennas * RADIO.energy))
    least = noise * np.sqrt(2.0 * THRESHOLD)
    rows = np.arange(3)
    fixed = Returns(np.stack([rows, np.full(3, -1), np.full(3, -1)], axis=1), rows, rows)
    seen = observe(fixed, SPOTS, SPOTS, POSES).seen
    belief = MapBelief(np.zeros((0, 3)), empty_table(2), POSES, BODY, SensorModel(RADIO, threshold=THRESHOLD), SHEETS)
    tracks, dull = no_tracks(40, 2), np.zeros(3, dtype=np.bool_)
    for cycle in range(cycles):
        code = RisCode(rng.integers(4, size=(1, 72)), 4)
        gain = [
            abs(panel_path_gain(SHEET, part, spot[None], POSES.tx, POSES.rx, np.ones(1), RADIO)[0])
            for part, spot in zip(SHEETS.parts(code), SPOTS, strict=False)
        ]
        amplitude = np.hypot(*(np.array([[*gain, 3.0 * least], np.zeros(3)]) + noise * rng.standard_normal((2, 3))))
        side = np.array([PANEL, PANEL + 1, OTHER]) if sides else None
        look = Observations(
            seen, np.full((3, 3), 0.02), np.log(amplitude), np.full(3, 0.1), 0.1 * amplitude, np.zeros(3), side
        )  # fmt: skip
        if not cycle:
            tracks = begin(tracks, look, rows, dull, np.full(3, 0.01), cycle)
        else:
            heard = np.flatnonzero(amplitude > least)
            tracks = extend(advance(tracks, 0.1, cycle, np.full(3, 1e-3)), heard, look, heard, dull, cycle)
        tracks = weigh_tracks(tracks, belief, code)
    return tracks


@pytest.mark.parametrize(("sides", "cycles"), [(True, 4), (False, 20)])
def test_panels_of_one_data_sheet_are_told_apart(sides: bool, cycles: int) -> None:
    """By the codes alone within 20 cycles, by whose signs they have within four."""
    rng = np.random.default_rng(5)
    for _ in range(5):
        tracks = follow(cycles, sides, rng)
        own, other = tracks.log_ris[[0, 1], [0, 1]], tracks.log_ris[[0, 1], [1, 0]]
        assert (own > 4.0).all()
        assert (own - other > 4.0).all()
        assert (tracks.log_ris[2] < -2.0).all()
    alive = tracks._replace(misses=np.zeros(3, dtype=np.int64))
    for panel in range(2):
        suspect = find_panel_candidate(alive, empty_table(2), AGENT, BODY, panel)
        assert suspect is not None
        assert suspect.panel == panel
        np.testing.assert_allclose(suspect.position, SPOTS[panel], atol=0.1)


def book_of(odds: list[list[float]]) -> LandmarkTable:
    landmarks = empty_table(2)
    for _ in odds:
        landmarks = enter(landmarks, False, np.zeros(3), -1)
    return landmarks._replace(log_ris=np.array(odds))


def test_returns_take_the_side_of_the_panel_that_their_point_is_held_for() -> None:
    points = np.array([0, 1, 2, TX])
    returns = Returns(np.stack([points, np.full(4, -1), np.full(4, -1)], axis=1), np.arange(4), np.arange(4))
    both = book_of([[-9.0, 9.0], [9.0, -9.0], [-9.0, -9.0]])
    assert both.holders == (1, 0)
    np.testing.assert_array_equal(return_sides(returns, both, 6.0), [PANEL + 1, PANEL, OTHER, OTHER])
    one = book_of([[-9.0, 0.0], [9.0, -9.0], [-9.0, 0.0]])
    assert one.holders == (1, -1)
    np.testing.assert_array_equal(return_sides(returns, one, 6.0), [UNTOLD, PANEL, UNTOLD, OTHER])
    none = book_of([[0.0, 0.0]] * 3)
    np.testing.assert_array_equal(return_sides(returns, none, 6.0), [UNTOLD, UNTOLD, UNTOLD, OTHER])


def test_a_component_is_on_the_side_of_the_panel_that_it_likely_ran_over() -> None:
    side, odds = side_of(np.array([0.999, 0.999, 0.5, 0.001]), np.array([0, 1, 1, 0]))
    np.testing.assert_array_equal(side, [PANEL, PANEL + 1, UNTOLD, OTHER])
    look = Observations(*np.zeros((2, 4, 3)), *np.zeros((4, 4)), side, odds, np.array([0, 1, 1, 0]))
    table = look.odds_of(2)
    assert table.shape == (4, 2)
    assert (table[[0, 1], [0, 1]] > 6.0).all()
    assert (table[[0, 1, 3, 3], [1, 0, 0, 1]] < -6.0).all()


def test_a_measurement_must_say_which_of_several_panels() -> None:
    none = np.zeros(0)
    told = Measurement(none, np.zeros((0, 2)), none, none, np.zeros((0, 2)), none, none)
    check_sides(told, SHEET)
    check_sides(replace(told, panel=np.zeros(0, dtype=np.int64)), SHEETS)
    with pytest.raises(ConfigError, match=r"measurement.panel: missing"):
        check_sides(told, SHEETS)
