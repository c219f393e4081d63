"""Values that the designs' own tests take for granted: what reaches the problem, curves, codes of phases, beams."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.design import (
    DESIGNERS,
    DesignConfig,
    DesignProblem,
    build_objective,
    direct_only,
    gain_curves,
    problem_from_arrays,
    problem_from_belief,
)
from rislam_rt.design.beam_sweep import beam_phases
from rislam_rt.design.coordinate_descent import _first_changes, _rank_by_slope, _rank_by_value
from rislam_rt.errors import ConfigError, GeometryError
from rislam_rt.geometry.angles import unit

POSITION = np.array([1.2, 2.1, 0.5])


def test_least_snr_becomes_a_power(make_belief, make_spec, radio, rng):
    """|alpha|^2 of the least SNR: integrated over all antennas, `L E |alpha|^2 / N0`."""
    problem = problem_from_belief(make_belief(POSITION, rng), make_spec(), radio, least_snr=10.0)
    power = 10.0 * radio.noise_psd / (radio.array.num_antennas * radio.energy)
    assert problem.least_power == pytest.approx(power)


def test_an_agent_on_an_element_does_not_spoil_the_others(make_belief, make_spec, radio, rng):
    """The element that is touched contributes nothing, all others what they do."""
    spec, belief = make_spec(5, 5), make_belief(POSITION, rng)
    offset = belief.body.ends(np.zeros(3), np.array(belief.heading))[0]
    belief = replace(belief, position=np.array([3.0, 3.0, 3.0]) - offset)
    response = problem_from_belief(belief, spec, radio, samples=1).response[0, 0]
    assert response[2, 2] == 0.0
    assert np.isfinite(response).all()


def test_length_variance_is_that_of_the_landmarks(make_belief, make_spec, radio, rng):
    """First order: unit vectors from either end, one landmark seen twice, or a landmark and its image apart."""
    belief = make_belief(POSITION, rng)
    count = len(belief.map.position)
    root = rng.normal(size=(count, 3, 3))
    landmarks = replace(belief.map, covariance=1e-3 * root @ root.swapaxes(1, 2))
    belief = replace(belief, map=landmarks)
    problem = problem_from_belief(belief, make_spec(), radio, samples=1, landmark_uncertainty=True)
    panel, images = 1, np.flatnonzero(landmarks.parent == landmarks.ris)
    # panel paths in the order of the problem: direct, then walls on the Rx leg, then on the Tx leg
    pairs = [(panel, panel), *((panel, i) for i in images), *((i, panel) for i in images)]
    tx, rx = belief.body.ends(POSITION, np.array(belief.heading))
    for path, (seen_tx, seen_rx) in enumerate(pairs):
        out, back = unit(landmarks.position[seen_tx] - tx), unit(landmarks.position[seen_rx] - rx)
        if seen_tx == seen_rx:
            expected = (out + back) @ landmarks.covariance[seen_tx] @ (out + back)
        else:
            expected = out @ landmarks.covariance[seen_tx] @ out + back @ landmarks.covariance[seen_rx] @ back
        assert problem.variance[0, path] == pytest.approx(expected)


def test_curves_are_those_of_the_direct_path(make_problem, rng):
    problems = [direct_only(make_problem(rng, rows=2, cols=3)) for _ in range(2)]
    curves = gain_curves(problems, rng=rng, method="exact", seeds=1, draws=4000)
    for place, problem in enumerate(problems):
        size = np.abs(problem.target)
        assert curves.continuous[place] == pytest.approx(20.0 * np.log10(size.sum()))
        assert curves.random.middle[place] == pytest.approx(10.0 * np.log10((size**2).sum()))
        assert curves.exact[place] == pytest.approx(curves.optimized.middle[place])


def test_the_code_of_continuous_phases_is_the_nearest(make_problem, rng):
    design = DESIGNERS["continuous"](make_problem(rng, rows=4, cols=5), rng=rng, config=DesignConfig(certify=False))
    off = np.angle(np.exp(1j * (design.xi - design.code.xi)))
    assert np.abs(off).max() <= np.pi / 4 + 1e-12
    assert design.code.index.min() >= 0


@pytest.mark.parametrize(("samples", "panel"), [(0, 2), (2, 0)])
def test_a_problem_needs_samples_and_panel_paths(samples, panel):
    with pytest.raises(ConfigError, match="give at least one"):
        DesignProblem(
            np.zeros((samples, panel, 2, 2)), np.zeros((samples, 0)), np.zeros((samples, panel, 2)), np.eye(2), 1.0, 4
        )


def test_a_variance_of_another_shape_is_refused(make_problem, rng):
    with pytest.raises(GeometryError, match="variance"):
        replace(make_problem(rng), variance=np.ones((1, 3)))


@pytest.mark.parametrize(("count", "spacing"), [(6, 0.015), (6, 0.005), (40, 0.015), (1, 0.015)])
def test_beams_cover_all_cosines_and_the_second_sweep_lies_between(count, spacing):
    """The slope of the phase over the row is 2 pi times the beam's turn; the turns are midpoints of equal shares."""
    wavelength = 0.03
    phases = beam_phases(count, spacing, wavelength)
    width = min(1.0, 4.0 * spacing / wavelength)
    beams = phases.shape[1]
    if count == 1:
        np.testing.assert_allclose(phases, 0.0)
        return
    turns = (phases[..., -1] - phases[..., 0]) / (2.0 * np.pi * (count - 1))
    share = width / beams
    np.testing.assert_allclose(turns[0], -width / 2 + share * (np.arange(beams) + 0.5), atol=1e-12)
    np.testing.assert_allclose(turns[1], turns[0] + share / 2, atol=1e-12)
    # each covers its share: the turn from element to element runs over what one beam of the row leaves of it
    bend = np.diff(phases, n=2, axis=-1) / (2.0 * np.pi)
    np.testing.assert_allclose(bend, max(share - 1.0 / count, 0.0) / count, atol=1e-12)


def test_least_snr_of_arrays_becomes_a_power(radio):
    problem = problem_from_arrays(np.ones((1, 2, 2)), np.zeros(0), np.ones((1, 2)), radio, 4, least_snr=10.0)
    assert problem.least_power == pytest.approx(10.0 * radio.noise_psd / (radio.array.num_antennas * radio.energy))


def test_static_gains_of_another_shape_are_refused(make_problem, rng):
    with pytest.raises(GeometryError, match="static_gain"):
        replace(make_problem(rng), static_gain=np.ones((2, 2)))


def test_two_individuals_are_a_population():
    assert DesignConfig(population=2, elite=0).population == 2
    with pytest.raises(ConfigError):
        DesignConfig(population=1, elite=0)


def test_slope_and_value_agree_for_one_path(make_problem, rng):
    """With one path the objective falls with its power alone: both name the same elements and the same steps."""
    for _ in range(20):
        objective = build_objective(direct_only(make_problem(rng, rows=3, cols=4)))
        index = rng.integers(4, size=12)
        weight = objective.table[index]
        gain = objective.gains(weight)
        now = float(objective.value(gain))
        (by_slope, step), (by_value, exact) = (
            rank(objective, weight, gain, now) for rank in (_rank_by_slope, _rank_by_value)
        )
        np.testing.assert_array_equal(by_slope, by_value)
        np.testing.assert_array_equal(step[by_slope], exact[by_value])
        better = [
            element
            for element in range(12)
            if min(objective.of_index((index + shift * (np.arange(12) == element)) % 4) for shift in (1, 2, 3)) < now
        ]
        assert sorted(by_value) == better


def test_changes_are_tried_in_powers_of_two():
    index, change = np.array([0, 1, 2, 3, 0]), np.array([0, 1, 2, 0, 1])
    trials = _first_changes(index, np.array([4, 0, 2, 1, 3]), change, 4)
    expected = [[0, 1, 2, 3, 2], [1, 1, 2, 3, 2], [1, 3, 1, 3, 2], [1, 3, 1, 0, 2]]
    np.testing.assert_array_equal(trials, expected)
