"""Codes that look for a panel: the sweep covers all directions, and goes on unless a candidate is worth more."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rislam_rt.arrays import Complexes
from rislam_rt.design import exact_code
from rislam_rt.design.beam_sweep import BeamSweep, search_code, sweep_codes
from rislam_rt.model import PanelCandidate, RadioConfig, RisCode, RisSpec, SlamEstimate, empty_map
from rislam_rt.ris import leg_response

PLACES = 300
"""Directions that are tried; a beam is an eighth of the hemisphere's width across or more, so none is skipped."""


def responses(spec: RisSpec, rng: np.random.Generator, wavelength: float) -> Complexes:
    """(PLACES, N M) responses of devices 3 m away, up to 60 degrees off the normal."""
    up = rng.uniform(0.5, 1.0, PLACES)
    turn = rng.uniform(-np.pi, np.pi, PLACES)
    flat = np.sqrt(1.0 - up**2)
    ray = 3.0 * np.stack([flat * np.cos(turn), flat * np.sin(turn), -up], axis=-1)
    leg = leg_response(spec, np.zeros(3), ray, np.ones(PLACES), wavelength)
    return (leg**2).reshape(PLACES, -1)


def gains(codes: np.ndarray, levels: int, response: Complexes) -> np.ndarray:
    return np.abs(response @ np.exp(-2j * np.pi / levels * codes.reshape(len(codes), -1)).T)


@pytest.mark.parametrize(("side", "spacing", "loss_db"), [(6, 0.015, 5.5), (4, 0.015, 5.5), (6, 0.0075, 5.5)])
def test_some_beam_comes_near_the_best_code_everywhere(side, spacing, loss_db, make_spec, radio, rng):
    """Between two beams of both sweeps 3.9 dB are lost, to four levels about 1 dB, some at the edge."""
    spec = replace(make_spec(side, side), spacing=np.array([spacing, spacing]))
    response = responses(spec, rng, radio.wavelength)
    best = gains(sweep_codes(spec, radio.wavelength), spec.levels, response).max(axis=1)
    _, exact = exact_code(response, spec.levels)
    assert 20.0 * np.log10(exact / best).max() < loss_db


def test_large_panels_are_swept_in_as_many_codes_by_wider_beams(make_spec, radio, rng):
    """16 x 16: a beam of 1/6 instead of 1/16 loses 8.5 dB of 24; it stays above the random codes' rms everywhere."""
    small, large = make_spec(6, 6), make_spec(16, 16)
    codes = sweep_codes(large, radio.wavelength)
    assert len(codes) == len(sweep_codes(small, radio.wavelength)) == 72
    response = responses(large, rng, radio.wavelength)
    rms = np.sqrt(np.sum(np.abs(response) ** 2, axis=1))
    assert (gains(codes, large.levels, response).max(axis=1) > 2.0 * rms).all()


@pytest.fixture
def blind(make_belief, rng) -> SlamEstimate:
    return replace(make_belief(np.array([1.0, 1.0, 0.5]), rng), map=empty_map())


PLACE = np.array([3.0, 3.0, 3.0])


def with_candidate(blind: SlamEstimate, real: float, **other: Any) -> SlamEstimate:
    """Belief with a panel candidate that is real with a probability, and told by the receiver to be the panel's, at
    `PLACE`, sharply known, unless `other` says something else."""
    usual = {"samples": PLACE + np.zeros((12, 3)), "is_panel": 1.0, "told": True}
    return replace(blind, suspects=(PanelCandidate(PLACE, real=real, **{**usual, **other}),))


def aimed_at(belief: SlamEstimate, spec: RisSpec, radio: RadioConfig) -> np.ndarray:
    """Levels of the best code for the direct path over a panel at `PLACE`."""
    tx, rx = (
        leg_response(spec, PLACE, end, np.ones(()), radio.wavelength)
        for end in belief.body.ends(belief.position, np.array(belief.heading))
    )
    return exact_code((tx * rx).ravel(), spec.levels)[0].reshape(spec.rows, spec.cols)


def test_without_a_candidate_the_sweep_goes_through_all_beams_round_and_round(blind, make_spec, radio):
    beams, sweep = sweep_codes(make_spec(), radio.wavelength), BeamSweep()
    sent = [search_code(blind, make_spec(), radio, sweep).index for _ in range(len(beams) + 3)]
    np.testing.assert_array_equal(sent, np.concatenate([beams, beams[:3]]))


@pytest.mark.parametrize(("over", "held"), [(1.2, True), (0.8, False)])
def test_a_code_is_held_only_while_that_is_likelier_to_light_the_panel_than_the_next_beam(
    over, held, blind, make_spec, radio, rng
):
    """By hand: `p again = (1 - p) / beams` at the limit; no beam is skipped for what is held."""
    spec, again, lit = make_spec(), 0.6, RisCode(rng.integers(4, size=(6, 6)), 4)
    beams = sweep_codes(spec, radio.wavelength)
    limit = 1.0 / (1.0 + again * len(beams))
    vague = PLACE + np.array([0.0, 0.0, -9.0]) * np.ones((12, 1))  # no place that an aimed code would light
    sweep = BeamSweep()
    search_code(blind, spec, radio, sweep)
    belief = with_candidate(blind, over * limit, samples=vague, again=again, code=lit)
    assert (search_code(belief, spec, radio, sweep, lit=lit) is lit) == held
    np.testing.assert_array_equal(search_code(blind, spec, radio, sweep).index, beams[1 if held else 2])


def test_what_is_not_lit_again_is_aimed_at_if_its_place_is_known(blind, make_spec, radio, rng):
    spec, lit = make_spec(), RisCode(rng.integers(4, size=(6, 6)), 4)
    found = search_code(with_candidate(blind, 0.9, again=0.1, code=lit), spec, radio, BeamSweep(), lit=lit)
    np.testing.assert_array_equal(found.index, aimed_at(blind, spec, radio))
    some = PLACE + np.array([0.0, 0.0, -9.0]) * (np.arange(12) < 11)[:, None]
    belief = with_candidate(blind, 0.9, samples=some, again=0.1, code=lit)  # one place in twelve: 0.08 for 0.1
    assert search_code(belief, spec, radio, BeamSweep(), lit=lit) is lit
    unlikely = with_candidate(blind, 0.01)  # one in a hundred, for one in 72
    np.testing.assert_array_equal(
        search_code(unlikely, spec, radio, BeamSweep()).index, sweep_codes(spec, radio.wavelength)[0]
    )


@pytest.mark.parametrize(("over", "share"), [(1.2, 1.0), (0.8, 1.0), (1.2, 0.5), (0.8, 0.5)])
def test_a_code_is_aimed_only_while_that_is_likelier_to_light_the_panel_than_the_next_beam(
    over, share, blind, make_spec, radio
):
    """By hand: `p share = (1 - p) / beams` at the limit; places of a third of the power do not count."""
    spec = make_spec()
    beams, aimed = sweep_codes(spec, radio.wavelength), aimed_at(blind, spec, radio)

    def power(place: np.ndarray) -> float:
        tx, rx = (
            leg_response(spec, place, end, np.ones(()), radio.wavelength)
            for end in blind.body.ends(blind.position, np.array(blind.heading))
        )
        return float(np.abs(np.sum(tx * rx * np.exp(-0.5j * np.pi * aimed))) ** 2)

    aside = next(
        place
        for place in PLACE + np.linspace(0.0, 1.0, 400)[:, None] * [1.0, 0.0, 0.0]
        if power(place) < power(PLACE) / 3.0
    )
    samples = np.where((np.arange(12) < 12 * share)[:, None], PLACE, aside)
    limit = 1.0 / (1.0 + share * len(beams))
    belief = with_candidate(blind, over * limit, samples=samples)
    found = search_code(belief, spec, radio, BeamSweep()).index
    np.testing.assert_array_equal(found, aimed if over > 1.0 else beams[0])


def test_every_panel_has_a_sweep_and_turns_of_its_own(blind, make_spec, radio, rng):
    spec, sweep, lit = make_spec(), BeamSweep(), RisCode(rng.integers(4, size=(6, 6)), 4)
    beams = sweep_codes(spec, radio.wavelength)
    for panel in (0, 1):
        np.testing.assert_array_equal(search_code(blind, spec, radio, sweep, panel).index, beams[0])
    both = [
        with_candidate(blind, 0.999, again=0.9, code=lit, examined=True, panel=panel).suspects[0] for panel in (0, 1)
    ]
    belief = replace(blind, suspects=tuple(both))
    assert all(search_code(belief, spec, radio, sweep, panel, lit) is lit for panel in (0, 1))


def test_turns_go_round_however_many_codes_are_worth_it(blind, make_spec, radio, rng):
    """Held, aimed at and doubted alike often, where aiming is worth it in every other cycle alone."""
    spec, sweep, lit = make_spec(), BeamSweep(), RisCode(rng.integers(4, size=(6, 6)), 4)
    vague, kinds = PLACE + np.array([0.0, 0.0, -9.0]) * np.ones((12, 1)), []
    for cycle in range(24):
        other = {"samples": vague} if cycle % 2 else {}
        belief = with_candidate(blind, 1.0, is_panel=0.5, told=False, again=0.9, code=lit, **other)
        code = search_code(belief, spec, radio, sweep, lit=lit)
        kinds.append("held" if code is lit else "aimed" if (code.index == aimed_at(blind, spec, radio)).all() else "")
    assert min(kinds.count(kind) for kind in ("held", "aimed", "")) >= 5


def test_what_was_examined_in_vain_takes_turns_with_the_sweep(blind, make_spec, radio, rng):
    spec, sweep, lit = make_spec(), BeamSweep(), RisCode(rng.integers(4, size=(6, 6)), 4)
    belief = with_candidate(blind, 0.999, again=0.9, code=lit, examined=True)
    sent = [search_code(belief, spec, radio, sweep, lit=lit).index for _ in range(6)]
    aimed, beams = aimed_at(blind, spec, radio), sweep_codes(spec, radio.wavelength)
    np.testing.assert_array_equal(sent, [lit.index, aimed, beams[0], lit.index, aimed, beams[1]])
    for again, code in ((0.6, aimed), (0.4, lit.index)):  # half of its places are lit by an aimed code
        half = np.where((np.arange(12) < 6)[:, None], PLACE, PLACE + np.array([0.0, 0.0, -9.0]))
        fresh = with_candidate(blind, 0.999, again=1.0 - again, code=lit, samples=half)
        assert all((search_code(fresh, spec, radio, sweep, lit=lit).index == code).all() for _ in range(3))


def test_what_may_be_a_scatterer_is_doubted_beam_by_beam(blind, make_spec, radio, rng):
    """A scatterer is heard under any code. One that is unlikely to be the panel is not asked for: 0.1 of 0.1."""
    spec, sweep, lit = make_spec(), BeamSweep(), RisCode(rng.integers(4, size=(6, 6)), 4)
    beams, aimed = sweep_codes(spec, radio.wavelength), aimed_at(blind, spec, radio)
    belief = with_candidate(blind, 1.0, is_panel=0.5, told=False, again=0.9, code=lit)
    sent = [search_code(belief, spec, radio, sweep, lit=lit).index for _ in range(6)]
    np.testing.assert_array_equal(sent, [lit.index, aimed, beams[0], lit.index, aimed, beams[1]])
    belief = with_candidate(blind, 1.0, is_panel=0.1, told=False, again=0.9, code=lit)
    np.testing.assert_array_equal(search_code(belief, spec, radio, sweep, lit=lit).index, beams[2])
    told = with_candidate(blind, 1.0, is_panel=0.1, again=0.9, code=lit)
    np.testing.assert_array_equal(search_code(told, spec, radio, sweep, lit=lit).index, aimed)


def test_a_candidate_on_the_agent_or_behind_the_panel_is_not_aimed_at(blind, make_spec, radio):
    spec, beams = make_spec(), sweep_codes(make_spec(), radio.wavelength)
    for place in (blind.position, PLACE * np.array([1.0, 1.0, -1.0])):
        belief = replace(blind, suspects=(PanelCandidate(place, place + np.zeros((12, 3)), 1.0, 1.0),))
        code = search_code(belief, spec, radio, BeamSweep()).index
        assert code.min() >= 0
        if place is not blind.position:
            np.testing.assert_array_equal(code, beams[0])


def test_what_something_hides_is_not_asked_for(blind, make_spec, radio, rng):
    """By hand: `p clear again = (1 - p) / beams` at the limit, and no two codes count together."""
    spec, again, lit = make_spec(), 0.6, RisCode(rng.integers(4, size=(6, 6)), 4)
    beams = sweep_codes(spec, radio.wavelength)
    half = np.where((np.arange(12) < 6)[:, None], PLACE, PLACE + np.array([0.0, 0.0, -9.0]))
    real = 0.5
    for over, asked in ((1.2, True), (0.8, False)):
        clear = over * (1.0 - real) / len(beams) / real / again
        belief = with_candidate(blind, real, samples=half, again=again, code=lit, clear=clear)
        assert (search_code(belief, spec, radio, BeamSweep(), lit=lit) is lit) == asked
