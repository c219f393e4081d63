"""Codes that look for a panel: the sweep covers all directions, a suspect is held, then aimed at, then doubted."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.arrays import Complexes
from rislam_rt.design import exact_code
from rislam_rt.design.beam_sweep import HOLD, LOOK_ROUND, SETTLED, search_code, sweep_codes
from rislam_rt.model import PanelCandidate, RisCode, RisSpec, empty_map
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


def test_without_a_suspect_the_sweep_goes_through_all_beams(make_belief, make_spec, radio, rng):
    belief = replace(make_belief(np.array([1.0, 1.0, 0.5]), rng), map=empty_map())
    beams = sweep_codes(make_spec(), radio.wavelength)
    sent = [search_code(belief, make_spec(), radio, number, None).index for number in range(len(beams))]
    np.testing.assert_array_equal(sent, beams)


def test_a_suspect_is_held_then_aimed_at_and_then_doubted(make_belief, make_spec, radio, rng):
    spec, place = make_spec(), np.array([3.0, 3.0, 3.0])
    blind = replace(make_belief(np.array([1.0, 1.0, 0.5]), rng), map=empty_map())
    last = RisCode(rng.integers(4, size=(6, 6)), 4)

    def sent(hits: int, number: int) -> np.ndarray:
        belief = replace(blind, suspects=(PanelCandidate(place, hits),))
        return search_code(belief, spec, radio, number, last).index

    for number in range(LOOK_ROUND):
        assert sent(1, number) is last.index
        tx, rx = (
            leg_response(spec, place, end, np.ones(()), radio.wavelength)
            for end in blind.body.ends(blind.position, np.array(blind.heading))
        )
        aimed, _ = exact_code((tx * rx).ravel(), 4)
        np.testing.assert_array_equal(sent(HOLD + 1, number).ravel(), aimed)
        assert (sent(SETTLED, number).ravel() == aimed).all() == (number % LOOK_ROUND != 0)
