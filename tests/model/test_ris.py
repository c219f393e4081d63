"""Several panels behind one code: every element has one place in it, and no other."""

import numpy as np
import pytest

from rislam_rt.errors import SceneError
from rislam_rt.model import RisCode, RisPanel, RisPanels, RisSpec, RisSpecs, join_codes, join_panels

LOOK, UP = np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])


def sheet(rows, cols, levels=4):
    return RisSpec(rows, cols, np.array([0.015, 0.02]), LOOK, UP, levels)


def test_codes_come_apart_as_they_were_joined():
    sheets, rng = RisSpecs((sheet(2, 3), sheet(4, 1), sheet(1, 5))), np.random.default_rng(0)
    codes = tuple(RisCode(rng.integers(4, size=(7, s.rows, s.cols)), 4) for s in sheets.panels)
    whole = join_codes(codes)
    assert whole.index.shape == (7, sheets.rows, sheets.cols) == (7, 1, 15)
    for one, other in zip(sheets.parts(whole), codes, strict=True):
        np.testing.assert_array_equal(one.index, other.index)
    lone = sheet(2, 3)
    assert join_codes((codes[0],)) is codes[0]
    assert lone.parts(codes[0]) == (codes[0],)


def test_a_response_meets_the_code_of_its_own_panel_alone():
    sheets, rng = RisSpecs((sheet(2, 3), sheet(4, 1))), np.random.default_rng(1)
    whole = RisCode(rng.integers(4, size=(1, sheets.num_elements)), 4)
    for number, (panel, code) in enumerate(zip(sheets.panels, sheets.parts(whole), strict=True)):
        response = rng.normal(size=(5, panel.rows, panel.cols)) + 1j
        placed = sheets.place(number, response)
        assert placed.shape == (5, 1, sheets.num_elements)
        np.testing.assert_array_equal(placed[:, 0, sheets.span(number)], response.reshape(5, -1))
        want = np.sum(response * np.exp(-1j * code.xi), axis=(1, 2))
        np.testing.assert_allclose(np.sum(placed * np.exp(-1j * whole.xi), axis=(1, 2)), want, rtol=1e-14)


def test_panels_of_a_room_differ_in_name_and_agree_in_levels():
    one, other = RisPanel(sheet(2, 2), np.zeros(3), name="a"), RisPanel(sheet(3, 2), np.ones(3), name="b")
    assert join_panels(()) is None
    assert join_panels((one,)) is one
    both = join_panels((one, other))
    assert isinstance(both, RisPanels)
    assert both.spec.panels == (one.spec, other.spec)
    with pytest.raises(SceneError, match="a name of its own"):
        join_panels((one, RisPanel(sheet(3, 2), np.ones(3), name="a")))
    with pytest.raises(SceneError, match="same number of levels"):
        join_panels((one, RisPanel(sheet(3, 2, levels=2), np.ones(3), name="b")))
    with pytest.raises(SceneError, match="two or more"):
        RisSpecs((one.spec,))
