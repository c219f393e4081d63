"""The table of constants: none idle, none more than agreed, and what follows from them."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.slam import window
from rislam_rt.slam.model_constants import CONSTANTS, ModelConstants
from rislam_rt.slam.window.landmarks.measurement_prediction import PANEL_STD
from rislam_rt.slam.window.smoother.cholesky import inverse, solution

SOURCES = [path.read_text() for path in Path(window.__file__).parents[1].rglob("*.py")]


def test_there_are_at_most_25_constants_and_each_is_read():
    assert len(ModelConstants._fields) <= 25
    for name in ModelConstants._fields:
        assert any(f"CONSTANTS.{name}" in text or f"self.{name}" in text for text in SOURCES), name


def test_nothing_is_worked_out_from_the_table_when_a_module_is_loaded():
    """Or a study that changes the table would change half of it."""
    for text in SOURCES:
        loose = [line for line in text.splitlines() if "CONSTANTS." in line and not line.startswith((" ", ")"))]
        assert not loose


def test_unseen_legs_are_clear_as_often_as_the_chain_is_in_the_long_run():
    move = np.array([[1.0 - CONSTANTS.rare, CONSTANTS.rare], [CONSTANTS.cleared, 1.0 - CONSTANTS.cleared]])
    assert CONSTANTS.steady == pytest.approx(np.linalg.matrix_power(move, 1000)[0, 0], rel=1e-9)


def test_the_weaker_of_two_paths_lies_a_walls_loss_below():
    first, second = 1.0, np.exp(CONSTANTS.wall_ratio)
    assert CONSTANTS.weaker == pytest.approx(second / (first + second), rel=1e-12)


def test_the_panels_spread_is_that_of_a_rayleigh_amplitude():
    draws = np.log(np.random.default_rng(3).rayleigh(size=40_000))
    assert pytest.approx(draws.std(), abs=4.0 * 1.1 / np.sqrt(2 * 40_000)) == PANEL_STD  # kurtosis 5.4


def test_inverse_and_solution_of_a_badly_scaled_matrix():
    rng = np.random.default_rng(4)
    scale = 10.0 ** rng.uniform(-4, 4, 12)
    root = rng.standard_normal((12, 20))
    matrix, right = scale[:, None] * (root @ root.T) * scale, rng.standard_normal(12)
    found = inverse(matrix)
    # exact to the condition of the matrix scaled to a unit diagonal
    np.testing.assert_allclose(scale[:, None] * (found @ matrix) / scale, np.eye(12), atol=1e-10)
    np.testing.assert_allclose(found, found.T, rtol=0.0)
    np.testing.assert_allclose(solution(matrix, right) / (found @ right), 1.0, rtol=1e-9)


def test_what_rounding_made_indefinite_is_damped_and_finite():
    matrix = np.ones((3, 3)) - 1e-13 * np.eye(3)
    assert np.linalg.eigvalsh(matrix)[0] < 0.0
    found = inverse(matrix)
    assert np.isfinite(found).all()
    assert np.linalg.eigvalsh(found)[0] > 0.0
