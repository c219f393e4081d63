"""Design of several panels together: known ones jointly, the others look for themselves."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from rislam_rt.design import design_code, designer, exact_code, problem_from_belief
from rislam_rt.design.beam_sweep import BeamSweep, search_code
from rislam_rt.design.design_problem import problem_from_arrays
from rislam_rt.design.objective import build_objective
from rislam_rt.model import PanelCandidate, RisCode, RisSpecs
from rislam_rt.ris import leg_response, panel_gain

AGENT = np.array([1.8, 2.4, 0.6])


@pytest.fixture
def both(make_belief, make_spec, rng):
    """The paper's room, the sphere's landmark taken for a second panel, smaller, that looks along x."""
    belief = make_belief(AGENT, rng)
    names = np.where(np.arange(len(belief.map.ident)) == 0, 1, 0)
    certain = belief.map.ris_probability.copy()
    certain[0] = 0.9
    landmarks = replace(belief.map, ris_probability=certain, panel=names)
    small = replace(make_spec(4, 3), normal=np.array([0.0, 0.6, -0.8]), up=np.array([0.0, 0.8, 0.6]))
    return replace(belief, map=landmarks), RisSpecs((make_spec(), small))


def direct_gain(belief, sheet, row, code, radio):
    ends = belief.body.ends(belief.position, np.array(belief.heading))
    legs = [
        leg_response(sheet, belief.map.position[row], end, np.sqrt(gain), radio.wavelength)
        for end, gain in zip(ends, (radio.tx_gain, radio.rx_gain), strict=True)
    ]
    return panel_gain(*legs, code)


def test_every_panels_direct_path_answers_to_its_own_elements(both, radio, rng):
    belief, sheets = both
    problem = problem_from_belief(belief, sheets, radio, samples=1)
    assert problem.shape == (1, 48)
    whole = RisCode(rng.integers(4, size=(1, 48)), 4)
    gain = build_objective(problem).gains(np.exp(-1j * whole.xi.ravel()))
    for number, (row, sheet, code) in enumerate(zip((1, 0), sheets.panels, sheets.parts(whole), strict=True)):
        want = direct_gain(belief, sheet, row, code, radio)
        np.testing.assert_allclose(gain[problem.panels[number][0]], want, rtol=1e-12)
    # each panel has its direct path and two over each of five walls, and no static landmark is left
    assert problem.response.shape[1] == 22
    seen = np.abs(problem.response[0]).reshape(22, -1).any(axis=1)  # the second panel has walls behind it
    for number, (row, span) in enumerate(problem.panels):
        mine = np.flatnonzero(seen & (problem.owner() == number))
        assert mine[0] == row
        assert not np.delete(problem.response[0, mine, 0], np.arange(48)[span], axis=1).any()
    assert problem.static_gain.shape == (1, 0)


def test_exact_is_the_optimum_of_every_panel_and_joint_descent_is_no_worse(both, radio, rng):
    belief, sheets = both
    exact = design_code(belief, sheets, radio, method="exact", rng=rng)
    for row, sheet, code in zip((1, 0), sheets.panels, sheets.parts(exact.code), strict=True):
        response = problem_from_belief(belief, sheets, radio, samples=1).targets[0 if row else 1]
        best = exact_code(response, 4)[1]
        assert abs(direct_gain(belief, sheet, row, code, radio)) == pytest.approx(best, rel=1e-12)
    joint = design_code(belief, sheets, radio, method="coordinate", rng=rng)
    assert joint.bound <= joint.crlb <= exact.crlb
    alone = replace(belief, map=replace(belief.map, panel=np.full(len(belief.map.ident), 2)))
    assert design_code(alone, sheets, radio, method="exact", rng=rng).outcome.name == "NO_PATHS"


def test_two_small_panels_against_every_code(radio, rng):
    """Panels of 2 and 3 elements: 1024 codes, valued one by one."""
    response = rng.normal(size=(4, 1, 5)) + 1j * rng.normal(size=(4, 1, 5))
    response[[0, 2], :, 2:] = 0.0
    response[[1, 3], :, :2] = 0.0
    panels = ((0, slice(0, 2)), (1, slice(2, 5)))
    problem = problem_from_arrays(response, np.zeros(0), rng.normal(size=(4, 2)), radio, 4, np.eye(2), panels=panels)
    np.testing.assert_array_equal(problem.owner(), [0, 1, 0, 1])
    every = np.array(list(product(range(4), repeat=5)))
    least = float(build_objective(problem).of_index(every).min())
    found = designer("coordinate")(problem, rng=rng)
    assert found.bound <= least <= found.crlb < 1.05 * least
    power = np.abs(np.exp(-0.5j * np.pi * every) @ response[:2, 0].T)
    exact = designer("exact")(problem, rng=rng).code
    at = np.abs(np.exp(-1j * exact.xi[0]) @ response[:2, 0].T)
    np.testing.assert_allclose(at, power.max(axis=0), rtol=1e-12)


def test_a_panel_not_yet_found_looks_for_itself(both, radio, rng):
    belief, sheets = both
    half = belief.map.ris_probability.copy()
    half[0] = 0.4
    place = np.array([2.0, 1.0, 1.0])
    suspect = PanelCandidate(place, place + np.zeros((12, 3)), 0.9, 1.0, told=True, panel=1)
    partly = replace(belief, map=replace(belief.map, ris_probability=half), suspects=(suspect,))
    found = design_code(partly, sheets, radio, method="exact", rng=rng)
    first, second = sheets.parts(found.code)
    alone = design_code(partly, sheets.panels[0], radio, method="exact", rng=rng)
    np.testing.assert_array_equal(first.index, alone.code.index)
    aimed = search_code(partly, sheets.panels[1], radio, BeamSweep(), 1)
    np.testing.assert_array_equal(second.index, aimed.index)
    assert not np.array_equal(second.index, search_code(partly, sheets.panels[1], radio, BeamSweep(), 0).index)
    assert found.code.index.shape == (1, 48)
    # held is the part of the joint code that is this panel's
    joint = RisCode(rng.integers(4, size=(1, 48)), 4)
    again = replace(partly, suspects=(suspect._replace(code=joint, again=1.0),))
    held = sheets.parts(design_code(again, sheets, radio, method="exact", rng=rng).code)[1]
    np.testing.assert_array_equal(held.index, sheets.parts(joint)[1].index)


def test_no_element_of_either_panel_could_be_set_better(both, radio, rng):
    belief, sheets = both
    joint = design_code(belief, sheets, radio, method="coordinate", rng=rng, samples=1)
    objective = build_objective(problem_from_belief(belief, sheets, radio, samples=1))
    index = joint.code.index.ravel()
    assert float(objective.of_index(index)) == pytest.approx(joint.crlb, rel=1e-9)
    changed = np.repeat(index[None], 3 * len(index), axis=0)
    changed[np.arange(len(changed)), np.arange(len(changed)) // 3] += 1 + np.arange(len(changed)) % 3
    assert (objective.of_index(changed % 4) > joint.crlb * (1.0 - 1e-6)).all()
