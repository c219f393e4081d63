"""The chain of two states, tracked or lost: what map and tracks of a cycle make of its odds, and the cause named."""

import numpy as np
import pytest

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.divergence import divergence_monitor


def test_the_chain_is_that_of_two_states():
    """Against the forward filter of the hidden chain, in probabilities."""
    rng, odds = np.random.default_rng(4), CONSTANTS.log_lost
    least = 1.0 / (1.0 + 1.0 / CONSTANTS.rare**2)
    lost = least
    for score in rng.normal(-0.3, 1.0, 60):
        odds = divergence_monitor.advance(odds, score, np.zeros(0), 0)
        passed = lost + (1.0 - lost) * least
        lost = np.clip(passed / (passed + (1.0 - passed) * np.exp(score)), least, 1.0 - least)
        assert odds == pytest.approx(np.log(lost / (1.0 - lost)), abs=1e-6)
    assert not divergence_monitor.is_lost(CONSTANTS.log_lost)


def test_tracks_that_end_at_once_make_a_loss_likelier_and_a_map_that_explains_does_not():
    often = np.full(17, 0.95)
    torn = divergence_monitor.advance(CONSTANTS.log_lost, -3.0, often, 3)
    assert torn > 3.0 > divergence_monitor.advance(CONSTANTS.log_lost, -3.0, often[:2], 18)
    assert divergence_monitor.is_lost(torn)
    assert not divergence_monitor.is_lost(divergence_monitor.advance(CONSTANTS.log_lost, 40.0, often, 3))
    assert divergence_monitor.advance(torn, 30.0, np.zeros(0), 5) == pytest.approx(CONSTANTS.log_lost)


def test_tracks_that_are_heard_now_and_then_end_without_a_jump():
    """31 of 68 tracks, each heard once or twice, as a waveform receiver has them in its first second."""
    odds = divergence_monitor.advance(CONSTANTS.log_lost, 6.5, np.full(31, 0.667), 37)
    assert odds == pytest.approx(CONSTANTS.log_lost)


def test_one_track_that_was_never_missed_may_be_hidden():
    """Alone among few others its end is no jump; by hand, at the odds of 0.02 that something hides it."""
    odds = divergence_monitor.advance(CONSTANTS.log_lost, 0.0, np.ones(1), 3)
    assert odds == pytest.approx(CONSTANTS.log_lost, abs=0.7)
    burst = np.log((1.0 - 0.3 * 0.98) / 0.02)  # and with none that goes on
    assert divergence_monitor.advance(CONSTANTS.log_lost, 0.0, np.ones(1), 0) == pytest.approx(
        np.logaddexp(CONSTANTS.log_lost, CONSTANTS.log_lost + burst), abs=1e-2
    )


@pytest.mark.parametrize(
    ("score", "ended", "motion", "cause"),
    [(0.4, 17, 0.0, "TRACKS"), (-9.0, 0, 2.0, "MAP"), (2.0, 0, 9.0, "MOTION")],
)
def test_a_cycle_of_loss_names_what_speaks_most_against_the_map(score, ended, motion, cause):
    before = -1.0
    heard = divergence_monitor.advance(before, score, np.full(ended, 0.95), 20 - ended)
    assert divergence_monitor.cause_of_loss(before, heard, heard + motion, score).name == cause


def test_a_cycle_in_which_nothing_is_weighed_names_no_cause():
    assert divergence_monitor.cause_of_loss(1.0, 1.0, 1.0, -5.0).name == "NONE"
