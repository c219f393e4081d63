"""RIS candidates: what codes tell of a track, whether it is real, the panel's direct path, or what a receiver leaks."""

from dataclasses import replace

import numpy as np
import pytest
from lit_candidates import CODES, CYCLE, HERE, SENSOR, SHEET, SIX, aimed_scene, at_place, poses, tracks_at

from rislam_rt.arrays import Floats
from rislam_rt.design.beam_sweep import BeamSweep, search_code
from rislam_rt.model import Body, RisCode, empty_map
from rislam_rt.model.estimate import SlamEstimate
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import OTHER, PANEL
from rislam_rt.slam.window.landmarks.landmark_table import empty_table
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.landmarks.ris_identification import unknown
from rislam_rt.slam.window.ris_candidate import find_candidate, weigh_tracks
from rislam_rt.slam.window.solver_limits import CERTAIN
from rislam_rt.slam.window.tracks import WindowTracks, due, unlike


def test_silence_under_the_code_that_lit_it_tells_against_a_candidate_and_under_another_one_does_not():
    scene = KnownEnvironment(None, SENSOR.radio, SENSOR, SHEET, 2, True)
    before = tracks_at(np.array([[4.0, 4.0, 2.5]]), [0.0], log_real=3.0)
    snr = 12.0
    loud = np.log(np.sqrt(snr / SENSOR.radio.integrated_snr(np.ones(()))))
    before = before._replace(log_amplitude=np.array([loud]), log_grid=unknown(1).log_grid)
    missed = np.log1p(-CONSTANTS.shown * SENSOR.detection_probability(snr))
    for ago, change in ((0, 0.0), (2, missed), (3, np.log1p(-CONSTANTS.rare))):
        after = weigh_tracks(before._replace(last=before.last - ago), CYCLE, poses(), scene, CODES)
        np.testing.assert_allclose(after.log_real, 3.0 + change)


def lit_by_turns(straight: bool, rng: np.random.Generator) -> Floats:
    """Log odds of a track of being over no wall, after a beam that lit it, that beam again, three codes aimed at it and
    three others; a path over a wall besides is lit by its own beam alone."""
    scene, aimed, gain = aimed_scene()
    beam = aimed if straight else RisCode((aimed.index + 2 * np.arange(6)) % 4, 4)
    codes = [beam, beam, *[aimed] * 3, *[RisCode(rng.integers(4, size=(6, 6)), 4) for _ in range(3)]]
    track, odds = at_place(gain), []
    for cycle, code in enumerate(codes):
        if code is beam:
            track = track._replace(earlier=track.last, last=np.array([cycle]))
        track = weigh_tracks(track, cycle, poses(), scene, tuple(codes[: cycle + 1]))
        odds.append(track.log_direct[0, 0])
    return np.array(odds)


def test_an_aimed_code_tells_whether_a_track_is_the_direct_path():
    """By hand: what lit it and what is lit again say nothing; silence under an aimed code says all that a detection
    that fails, and what may hide it, leave of it."""
    straight, over_a_wall = (lit_by_turns(kind, np.random.default_rng(5)) for kind in (True, False))
    np.testing.assert_allclose(straight[:5], 0.0, atol=1e-9)
    assert straight[-1] > -1.0  # other codes light neither
    np.testing.assert_allclose(over_a_wall[:2], 0.0, atol=1e-9)
    rare, missed, hidden, expected = CONSTANTS.rare, 1.0 - CONSTANTS.shown, 0.0, [0.0]
    for _ in range(3):
        before = hidden + rare * (1.0 - hidden)
        silence = before + (1.0 - before) * missed
        expected.append(expected[-1] + np.log(silence / (1.0 - rare)))
        hidden = before / silence
    np.testing.assert_allclose(over_a_wall[2:5], expected[1:], atol=2e-2)
    # what a code does not light that lit nothing of it before tells next to nothing of whether it is real
    scene, aimed, gain = aimed_scene()
    beam = RisCode((aimed.index + 2 * np.arange(6)) % 4, 4)
    track = at_place(gain)
    after = weigh_tracks(track, 1, poses(), scene, (beam, aimed))
    np.testing.assert_allclose(after.log_real - track.log_real, np.log1p(-rare))


@pytest.mark.parametrize("turned", [1, 2, 3])
@pytest.mark.parametrize("faint", [0.3, 1.0])
def test_what_is_heard_under_a_code_unlike_the_one_that_lit_it_is_the_direct_path_by_as_much(turned, faint):
    """By hand, from how loud it was then: the code that lit it has so many rows the other way."""
    scene, aimed, gain = aimed_scene()
    beam = RisCode((aimed.index + 2 * (np.arange(6) < turned)[:, None]) % 4, 4)
    likeness = 1.0 - turned / 3.0
    track = at_place(gain)._replace(last=np.array([4]), earlier_log_amplitude=np.log([gain * faint]))
    after = weigh_tracks(track, 4, poses(), scene, (beam, beam, beam, beam, aimed))
    snr = 40.0 * (faint * likeness) ** 2
    again = max(CONSTANTS.shown * float(scene.sensor.detection_probability(snr)), CONSTANTS.rare)
    lit = (1.0 - CONSTANTS.rare) * CONSTANTS.shown
    np.testing.assert_allclose(after.log_direct[0, 0], np.log(max(lit, again) / again), atol=2e-2)
    np.testing.assert_allclose(after.log_real, track.log_real)
    # as loud as it is now would be another thing
    same = weigh_tracks(track, 4, poses(), scene, (aimed,) * 5)
    if faint == 1.0:
        np.testing.assert_allclose(same.log_direct, 0.0, atol=1e-9)
    # of what is told for another thing nothing is asked, and without a code nothing is told but the panel's side
    other = weigh_tracks(track._replace(side=np.array([OTHER])), 4, poses(), scene, (beam,) * 4 + (aimed,))
    np.testing.assert_array_equal(other.log_direct, 0.0)
    blind = weigh_tracks(track, 4, poses(), scene, (*(beam,) * 4, None))
    np.testing.assert_array_equal(blind.log_direct, 0.0)
    assert (blind.log_grid != track.log_grid).any()


def test_each_track_is_asked_by_the_code_that_lit_it():
    """Lit by three codes, the newest first; one that was lit before all that are kept is known by no code."""
    one = tracks_at(np.array([[4.0, 4.0, 2.5]]), [0.0], log_real=3.0)._replace(log_grid=unknown(1).log_grid)
    snr = 12.0
    loud = np.log(np.sqrt(snr / SENSOR.radio.integrated_snr(np.ones(()))))
    fields = [np.repeat(field, 4, axis=0) for field in one[:-1]]
    ago = np.array([len(CODES), 3, 2, 4])
    four = WindowTracks._make([*fields, 4])._replace(last=CYCLE - ago, log_amplitude=np.full(4, loud))
    after = weigh_tracks(four, CYCLE, poses(), KnownEnvironment(None, SENSOR.radio, SENSOR, SHEET, 2, True), CODES)
    missed = np.log1p(-CONSTANTS.shown * SENSOR.detection_probability(snr))
    unlike = np.log1p(-CONSTANTS.rare)
    np.testing.assert_allclose(after.log_real, 3.0 + np.array([unlike, unlike, missed, unlike]))
    assert after.log_direct[0, 0] == four.log_direct[0, 0]


def test_what_was_aimed_at_in_vain_gives_way_to_the_sweep():
    """A track that is surely real and over the panel, silent under codes aimed at it: soon a beam is sent."""
    scene, aimed, gain = aimed_scene()
    beam, sweep, kinds = RisCode((aimed.index + 2 * np.arange(6)) % 4, 4), BeamSweep(), []
    codes, track = [beam], at_place(gain)._replace(log_ris=np.array([[12.0]]), hits=np.array([2]))
    mean, belief = np.concatenate([HERE, np.zeros(4)]), make_estimate()
    for cycle in range(1, 12):
        found = find_candidate(track, empty_table(1), mean, cycle - 1, poses(), tuple(codes), scene.sensor)
        assert found is not None
        code = search_code(replace(belief, suspects=(found,)), SIX, scene.radio, sweep, lit=found.code)
        kinds.append("held" if code is beam else "aimed" if (code.index == aimed.index).all() else "beam")
        codes.append(code)
        if code is beam:
            track = track._replace(earlier=track.last, last=np.array([cycle]), hits=track.hits + 1)
        track = weigh_tracks(track, cycle, poses(), scene, tuple(codes))
    assert kinds[0] == "aimed"
    assert kinds.count("beam") >= 7


@pytest.mark.parametrize("turned", [0, 3])
@pytest.mark.parametrize("heard", [True, False])
@pytest.mark.parametrize("hits", [1, 4])
def test_a_leak_is_heard_under_any_code_as_often_as_before(turned, heard, hits):
    """By hand, under a code that lights the panel's direct path, and under one that lights nothing."""
    scene, aimed, gain = aimed_scene()
    code = RisCode((aimed.index + 2 * (np.arange(6) < turned)[:, None]) % 4, 4)
    track = at_place(gain)._replace(
        log_leak=np.zeros((1, 1)), last=np.array([4 if heard else 0]), hits=np.array([hits])
    )
    after = weigh_tracks(track, 4, poses(), scene, (*(aimed,) * 4, code))
    again = CONSTANTS.shown * float(scene.sensor.detection_probability(40.0))
    often = (hits + 1 - heard) / 6.0
    always, lit = often * again, often * again if turned == 0 else CONSTANTS.rare
    expected = np.log(always / lit) if heard else np.log1p(-always) - np.log1p(-lit)
    np.testing.assert_allclose(after.log_leak[0, 0], expected, atol=2e-2)
    hidden = weigh_tracks(track._replace(hidden=np.array([[0.99, 0.0]])), 4, poses(), scene, (*(aimed,) * 4, code))
    if turned == 0:  # what may hide it says no more
        np.testing.assert_allclose(hidden.log_leak[0, 0], 0.0, atol=0.1)
    unknown_code = weigh_tracks(track, 4, poses(), scene, (code,))  # what lit it is not known
    np.testing.assert_array_equal(unknown_code.log_leak, 0.0)


def test_what_an_aimed_code_lights_is_no_leak_for_that_and_odds_stay_finite():
    """Lit before by a code unlike the aimed one; forty times in a row under a code that lights nothing; and as faint as
    can be."""
    scene, aimed, gain = aimed_scene()
    unlike_it = RisCode((aimed.index + 2 * (np.arange(6) < 3)[:, None]) % 4, 4)
    track = at_place(gain)._replace(log_leak=np.zeros((1, 1)), last=np.array([4]), hits=np.array([6]))
    after = weigh_tracks(track, 4, poses(), scene, (*(unlike_it,) * 4, aimed))
    np.testing.assert_allclose(after.log_leak, 0.0, atol=5e-2)
    for _ in range(40):
        after = weigh_tracks(after, 4, poses(), scene, (*(aimed,) * 4, unlike_it))
    np.testing.assert_array_equal(after.log_leak, CERTAIN)
    assert np.abs(after.log_direct).max() <= CERTAIN
    faint = weigh_tracks(track._replace(earlier_log_amplitude=np.array([-30.0])), 4, poses(), scene, (unlike_it,) * 5)
    np.testing.assert_allclose(faint.log_leak, 0.0, atol=1e-9)


def asked_for(heard: Floats, spent: int) -> Floats:
    """Whether each code of so many lights the place of a track that is told for the panel's, examined for births as it
    is due, and never born; it is heard with probabilities (2,) under a beam, and where its place is lit."""
    scene, aimed, gain = aimed_scene()
    rng, mean = np.random.default_rng(7), np.concatenate([HERE, np.zeros(4)])
    sweep, codes, lights = BeamSweep(), [aimed], np.zeros(spent)
    track = at_place(gain)._replace(log_ris=np.array([[12.0]]), log_leak=unlike(1)[1])
    for cycle in range(1, spent + 1):
        found = find_candidate(track, empty_table(1), mean, cycle - 1, poses(), tuple(codes), scene.sensor)
        assert found is not None
        belief = replace(make_estimate(), suspects=(found,))
        codes.append(search_code(belief, SIX, scene.radio, sweep, lit=found.code))
        lit = int((codes[-1].index == aimed.index).all())
        lights[cycle - 1] = lit
        if rng.uniform() < heard[lit]:
            real = np.minimum(track.log_real + CONSTANTS.max_log_ratio, CERTAIN)
            track = track._replace(earlier=track.last, last=np.array([cycle]), hits=track.hits + 1, log_real=real)
        track = weigh_tracks(track, cycle, poses(), scene, tuple(codes))
        if len(due(track, cycle)):
            track = track._replace(looked=track.hits)
    return lights


@pytest.mark.parametrize("often", [0.4, 0.6, 0.9])
def test_a_leak_gives_way_to_the_sweep_however_often_it_is_heard(often):
    assert asked_for(np.array([often, often]), 100)[-40:].mean() < 0.3


@pytest.mark.parametrize("often", [0.5, 0.9])
def test_the_direct_path_keeps_most_of_the_codes(often):
    """All until it is examined, then two of three."""
    assert asked_for(np.array([0.0, often]), 100).mean() > 0.55


def test_other_tracks_have_no_say_in_how_often_one_is_heard():
    scene, aimed, gain = aimed_scene()
    unlike_it = RisCode((aimed.index + 2 * (np.arange(6) < 3)[:, None]) % 4, 4)
    one = at_place(gain)._replace(log_leak=np.zeros((1, 1)), last=np.array([4]), hits=np.array([3]))
    fields = [np.repeat(field, 2, axis=0) for field in one[:-1]]
    two = WindowTracks._make([*fields, 2])._replace(side=np.array([OTHER, PANEL]), hits=np.array([5, 3]))
    alone, beside = (
        weigh_tracks(tracks, 4, poses(), scene, (*(aimed,) * 4, unlike_it)).log_leak[-1] for tracks in (one, two)
    )
    np.testing.assert_array_equal(beside, alone)


def make_estimate() -> SlamEstimate:
    """Belief of an agent at `HERE` that knows nothing of the room."""
    return SlamEstimate(HERE, np.zeros(3), 0.0, 1e-4 * np.eye(6), HERE + np.zeros((4, 3)), Body(), empty_map())
