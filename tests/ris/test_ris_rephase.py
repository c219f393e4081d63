"""Re-phasing: the sum over elements path by path, whatever the pairs of legs, and what it leaves alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rislam_rt.model import RisCode
from rislam_rt.ris import PanelTolerance, draw_panel, panel_gain, rephase

PAIRS = {
    "one": [(0, 0)],
    "all": [(i, j) for i in range(4) for j in range(3)],
    # as a trace up to three bounces has it: a leg's partners are those with what is left of the bounces
    "triangle": [(i, j) for i in range(6) for j in range(6) if i // 2 + j // 2 <= 2],
    "mixed up": [(3, 1), (0, 4), (3, 4), (0, 1), (2, 2), (1, 0)],
}


def expected(paths, code, weight):
    """Second way: each path on its own, by the sum of the model's docstring."""
    gain = np.array(paths.gain)
    xi, weight = (np.broadcast_to(a, paths.ris.tx[:, 0].shape) for a in (code.xi, weight))
    for k, p in np.ndindex(gain.shape):
        i, j = paths.ris.tx_leg[p], paths.ris.rx_leg[p]
        if i >= 0:
            total = (paths.ris.tx[k, i] * weight[k] * np.exp(-1j * xi[k]) * paths.ris.rx[k, j]).sum()
            gain[k, p] = total if paths.valid[k, p] else 0.0
    return gain


@pytest.mark.parametrize("pairs", PAIRS.values(), ids=PAIRS)
@pytest.mark.parametrize("a_code_a_cycle", [False, True])
@pytest.mark.parametrize("weighted", [False, True])
def test_every_path_is_the_sum_over_its_elements(panels, pairs, a_code_a_cycle, weighted):
    paths = panels.random_paths(pairs, (3, 5))
    rng = np.random.default_rng(7)
    code = RisCode(rng.integers(4, size=(3, 3, 5) if a_code_a_cycle else (3, 5)), 4)
    errors = draw_panel(panels.spec(3, 5), PanelTolerance(0.2, 0.3, 0.1), rng=rng)
    weight = errors.weight if weighted else 1.0
    # sums of 15 terms of order 1 that may cancel
    np.testing.assert_allclose(rephase(paths, code, weight).gain, expected(paths, code, weight), rtol=0, atol=1e-13)


@settings(max_examples=60, deadline=None)
@given(st.sets(st.tuples(st.integers(0, 6), st.integers(0, 6)), min_size=1), st.randoms(use_true_random=False))
def test_any_set_of_pairs_in_any_order(panels, pairs, shuffle):
    pairs = sorted(pairs)
    shuffle.shuffle(pairs)
    paths = panels.random_paths(pairs, (2, 2), cycles=2)
    code = RisCode(np.array([[0, 1], [2, 3]]), 4)
    np.testing.assert_allclose(rephase(paths, code).gain, expected(paths, code, 1.0), rtol=0, atol=1e-13)


def test_nothing_else_changes_and_nothing_is_copied(panels):
    paths = panels.random_paths(PAIRS["all"], (3, 5))
    before = paths.gain.copy()
    again = rephase(paths, RisCode(np.ones((3, 5), dtype=int), 4))
    assert again.tau is paths.tau
    assert again.vertices is paths.vertices
    assert again.ris is paths.ris
    assert not again.gain.flags.writeable
    np.testing.assert_array_equal(paths.gain, before)
    np.testing.assert_array_equal(again.gain[:, :2], before[:, :2])


def test_weights_of_one_are_the_data_sheet(panels):
    paths = panels.random_paths(PAIRS["triangle"], (3, 5))
    code = RisCode(np.random.default_rng(1).integers(4, size=(3, 5)), 4)
    np.testing.assert_array_equal(rephase(paths, code, np.ones((3, 5))).gain, rephase(paths, code).gain)


def test_panel_gain_takes_the_same_weights(panels):
    paths = panels.random_paths([(0, 0)], (3, 5))
    rng = np.random.default_rng(2)
    code = RisCode(rng.integers(4, size=(3, 5)), 4)
    weight = draw_panel(panels.spec(3, 5), PanelTolerance(0.2, 0.3, 0.1), rng=rng).weight
    one = panel_gain(paths.ris.tx[:, 0], paths.ris.rx[:, 0], code, weight)
    np.testing.assert_allclose(one[paths.valid[:, 2]], rephase(paths, code, weight).gain[paths.valid[:, 2], 2])
