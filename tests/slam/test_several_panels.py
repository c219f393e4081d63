"""Which point is which panel: several data sheets, one point each at most; and what a receiver must say of them."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.model import Measurement, RisSpec, RisSpecs
from rislam_rt.slam.input_checks import check_sides
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD, side_of
from rislam_rt.slam.panel_evidence import panel_probabilities

SHEET = RisSpec(6, 6, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
SHEETS = RisSpecs((SHEET, SHEET))


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


def test_a_component_is_on_the_side_of_the_panel_that_it_likely_ran_over() -> None:
    side, odds = side_of(np.array([0.999, 0.999, 0.5, 0.001]), np.array([0, 1, 1, 0]))
    np.testing.assert_array_equal(side, [PANEL, PANEL + 1, UNTOLD, OTHER])
    assert odds is not None
    np.testing.assert_allclose(odds, np.log([999.0, 999.0, 1.0, 1.0 / 999.0]), atol=1e-9)


def test_a_measurement_must_say_which_of_several_panels() -> None:
    none = np.zeros(0)
    told = Measurement(none, np.zeros((0, 2)), none, none, np.zeros((0, 2)), none, none)
    check_sides(told, SHEET)
    check_sides(replace(told, panel=np.zeros(0, dtype=np.int64)), SHEETS)
    with pytest.raises(ConfigError, match=r"measurement.panel: missing"):
        check_sides(told, SHEETS)
