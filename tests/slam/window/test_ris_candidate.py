"""RIS candidates: which track or point the phase design aims at while no panel is known."""

import numpy as np
from lit_candidates import ACROSS, CODES, CYCLE, HERE, SENSOR, SHEET, poses, tracks_at

from rislam_rt import slam
from rislam_rt.arrays import Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import (
    Body,
    Measurement,
    RisCode,
    RisSpec,
    RisSpecs,
    SensorModel,
    join_codes,
)
from rislam_rt.model.estimate import PanelCandidate
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import PANEL, UNTOLD, Observations
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable, empty_table, enter
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.landmarks.ris_identification import log_silence, unknown
from rislam_rt.slam.window.ris_candidate import false_density, find_candidate, weigh_tracks
from rislam_rt.slam.window.tracks import WindowTracks


def best(tracks: WindowTracks, walls: list[Floats] | None = None) -> PanelCandidate | None:
    """Candidate beside walls whose mirror images of the agent are given."""
    landmarks: WindowTable = empty_table(1)
    for _ in walls or []:
        landmarks = enter(landmarks, True, HERE, 9, 5.0, unknown(1, 1))
    mean = np.concatenate([HERE, np.zeros(4), *(walls or [])])
    return find_candidate(tracks, landmarks, mean, CYCLE, poses(), CODES, SENSOR)


def test_a_wall_in_front_makes_a_candidate_unlikely_but_may_end_before_it():
    panel, front = np.array([4.0, 4.0, 2.5]), np.array([4.0, 2.0, 1.0])  # a wall at x = 3
    told = tracks_at(panel[None], [2.0])
    untold = told._replace(side=np.array([UNTOLD]))
    for track, by in ((told, np.exp(2.0 * CONSTANTS.wall_ratio)), (untold, CONSTANTS.rare)):
        found = best(track)
        assert found is not None
        np.testing.assert_allclose(found.position, panel, atol=1e-9)
        np.testing.assert_allclose(found.is_panel, 1.0 / (1.0 + np.exp(-2.0)))
        behind = best(track, [front])
        assert behind is not None
        np.testing.assert_allclose(behind.is_panel, 1.0 / (1.0 + np.exp(-2.0) / by))


def test_a_candidate_has_to_be_real_and_the_panel():
    panel = np.array([[4.0, 4.0, 2.5]])
    found = best(tracks_at(panel, [1.0], log_real=0.5))
    assert found is not None
    np.testing.assert_allclose([found.real, found.is_panel], 1.0 / (1.0 + np.exp([-0.5, -1.0])))
    assert found.told
    assert not found.examined
    elsewhere = tracks_at(np.array([[4.0, 4.0, 2.5], [1.0, 3.0, 2.5]]), [3.0, 1.0])
    elsewhere = elsewhere._replace(log_real=np.array([-3.0, 2.0]), looked=np.array([0, 6]), hits=np.array([6, 6]))
    found = best(elsewhere)  # 0.05 of 0.95, and 0.88 of 0.73
    assert found is not None
    np.testing.assert_allclose(found.position, [1.0, 3.0, 2.5])
    assert found.examined
    found = best(elsewhere._replace(hits=np.array([6, 5])))  # no more measurements were looked at than there are
    assert found is not None
    assert not found.examined
    assert best(tracks_at(np.zeros((0, 3)), [])) is None


def test_candidates_carry_the_code_that_lit_them():
    now = tracks_at(np.array([[4.0, 4.0, 2.5]]), [1.0])
    for ago, code in ((0, CODES[-1]), (3, CODES[-4]), (7, None)):
        found = best(now._replace(last=now.last - ago))
        assert found is not None
        assert found.code is code


def test_of_several_panels_the_part_that_lit_it_counts():
    """A track that is told for the second panel; of both, one that is not told."""
    normal, up, spacing = np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), np.array([0.015, 0.015])
    sheets = RisSpecs((RisSpec(2, 2, spacing, normal, up), RisSpec(1, 3, spacing, normal, up)))
    scene = KnownEnvironment(None, SENSOR.radio, SENSOR, sheets, 2, True)
    codes = tuple(join_codes((RisCode(one, 4), RisCode(np.ones((1, 3), dtype=np.int64), 4))) for one in ACROSS)
    track = tracks_at(np.array([[4.0, 4.0, 2.5]]), [0.0], log_real=3.0)
    track = track._replace(
        last=track.last - 2, log_grid=unknown(1).log_grid, log_ris=np.zeros((1, 2)), hidden=np.zeros((1, 3)),
        log_direct=np.zeros((1, 2)), log_leak=np.full((1, 2), -np.inf),
    )  # fmt: skip
    for side, falls in ((PANEL + 1, True), (PANEL, False), (UNTOLD, False)):
        after = weigh_tracks(track._replace(side=np.array([side])), CYCLE, poses(), scene, codes)
        assert (after.log_real[0] < 2.9) == falls


def test_one_track_is_not_two_panels_at_a_time():
    track = tracks_at(np.array([[4.0, 4.0, 2.5]]), [0.0])._replace(
        log_ris=np.array([[5.0, 5.0]]), log_direct=np.full((1, 2), 30.0), log_leak=np.full((1, 2), -np.inf)
    )
    mean = np.concatenate([HERE, np.zeros(4)])
    for side, panels in ((UNTOLD, (0, 1)), (PANEL + 1, (1,))):
        for panel in (0, 1):
            one = track._replace(side=np.array([side]))
            found = find_candidate(one, empty_table(2), mean, CYCLE, poses(), CODES, SENSOR, panel)
            assert (found is not None) == (panel in panels)
            if found is not None:
                np.testing.assert_allclose(found.is_panel, np.exp(5.0) / (1.0 + 2.0 * np.exp(5.0)))
                assert found.told == (side == PANEL + panel)
                assert np.ptp(found.samples, axis=0).max() == 0.0


def test_a_candidate_may_be_where_its_measurements_leave_it_open():
    track = tracks_at(np.array([[4.0, 4.0, 2.5], [1.0, 3.0, 2.5]]), [1.0, 3.0])
    spread = np.zeros((2, 3, 2, 2))
    spread[1, :, 0, 0] = 0.05**2
    found = best(track._replace(covariance=spread))
    assert found is not None
    # a path of twice the distance; across, by the distance over the cosine of the elevation
    off, away = found.samples - found.position, np.linalg.norm(found.position - HERE)
    ray = (found.position - HERE) / away
    assert 0.01 < np.std(off @ ray) < 0.05 * away
    assert 0.02 * away < np.sqrt(np.mean(np.sum((off - (off @ ray)[:, None] * ray) ** 2, axis=1))) < 0.2 * away


def components(snr: Floats, side: int, seen: Floats) -> Observations:
    """Components of SNRs (M,) on a side."""
    count = len(snr)
    level = 0.5 * np.log(snr / SENSOR.radio.integrated_snr(np.ones(())))
    return Observations(
        np.tile(seen, (count, 1)), np.full((count, 3), 1e-2), level, np.full(count, 0.1), np.ones(count),
        np.full(count, side),
    )  # fmt: skip


def test_a_first_component_counts_against_noise_as_loud_as_it():
    """By hand: exp(-(snr - threshold)) of the false ones, 2 snr an e-fold; wherever they are reported, and for each of
    two sides alike; and one of another kind is as rare as one that a code lit."""
    snr, span = np.array([10.0, 13.0, 20.0, 1e4]), SPEED_OF_LIGHT * (SENSOR.window[1] - SENSOR.window[0])
    for side, share in ((PANEL, 0.5), (UNTOLD, 1.0)):
        noise = share * SENSOR.false_alarms * 2.0 * snr * np.exp(-(snr - SENSOR.threshold))
        for seen in (np.array([5.0, 0.1, 0.2]), np.array([5.0, 0.9, 0.9])):  # noise is reported beyond the disc, too
            scene = KnownEnvironment(None, SENSOR.radio, SENSOR, SHEET, 2, True)
            density, log_odds = false_density(components(snr, side, seen), scene)
            np.testing.assert_allclose(log_odds, np.log(CONSTANTS.rare / (CONSTANTS.rare + noise)))
            np.testing.assert_allclose(density * np.pi * span, CONSTANTS.rare + noise)
    endless = SensorModel(SENSOR.radio, false_alarms=0.0, window=(0.0, np.inf))
    scene = KnownEnvironment(None, endless.radio, endless, SHEET, 2, True)
    density, log_odds = false_density(components(snr, PANEL, seen), scene)
    assert np.isfinite(np.log(density)).all()
    np.testing.assert_allclose(log_odds, 0.0)


def test_the_filter_follows_how_likely_its_tracks_are_real():
    """Three cycles: a first component, a second one in its place, and silence under the code that lit it."""
    rng, body = np.random.default_rng(1), Body()
    config, code = SlamConfig(filter="window"), CODES[-1]
    state = slam.init(StartPrior(HERE, np.zeros(3), 0.0), body, SHEET, SENSOR, config, rng=rng)
    gain, one = np.sqrt(11.0 / SENSOR.radio.integrated_snr(np.ones(()))), np.ones(1)
    heard = Measurement(
        12.0 / SPEED_OF_LIGHT * one, np.array([[0.3, 0.2]]), gain * one, 1e-10 * one, np.full((1, 2), 0.02),
        0.2 * gain * one, 0.999 * one,
    )  # fmt: skip
    nothing = Measurement(np.zeros(0), np.zeros((0, 2)), *np.zeros((2, 0)), np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    noise = 0.5 * SENSOR.false_alarms * 2.0 * 11.0 * np.exp(-1.0)
    first = np.log(CONSTANTS.rare / (CONSTANTS.rare + noise))
    missed = np.log1p(-CONSTANTS.shown * SENSOR.detection_probability(11.0))
    expected = np.cumsum([first, CONSTANTS.max_log_ratio, missed])
    for cycle, told in enumerate((heard, heard, nothing)):
        state, _ = slam.step(state, told, code, 0.1 * (cycle > 0), 0.0, config, rng=rng)
        np.testing.assert_allclose(state.tracks.log_real, expected[cycle])
        suspect = slam.predict(state, 0.1, config).suspects[0]
        np.testing.assert_allclose(suspect.real, 1.0 / (1.0 + np.exp(-expected[cycle])))
        assert suspect.code is code


def test_silence_of_a_panel_is_by_its_gain_and_by_what_may_hide_it():
    """By hand: a path at the threshold is missed half the time, by noise of its own; a strong one as it is merged."""
    radio, rare = SENSOR.radio, CONSTANTS.rare
    level = np.sqrt(SENSOR.threshold / float(radio.integrated_snr(np.ones(()))))
    gain = level * np.array([[[1.0], [10.0], [0.1]], [[10.0], [1.0], [10.0]]])
    hidden = np.array([[0.5, 0.0, 0.9], [0.0, 0.5, 0.9], [0.0, 0.2, 0.9]])
    found = np.exp(log_silence(gain, hidden, SENSOR))
    heard = CONSTANTS.shown * np.array([[0.5, 1.0, 0.0], [1.0, 0.5, 1.0]]).T
    before = hidden[:, :2] + rare * (1.0 - hidden[:, :2])
    np.testing.assert_allclose(found, 1.0 - (1.0 - before) * heard, atol=0.05)


def test_a_point_of_the_map_is_over_no_wall():
    """Beside a track with the same odds against a scatterer it is the likelier one: the track may be over a wall."""
    place = np.array([4.0, 4.0, 2.5])
    landmarks = enter(empty_table(1), False, HERE, 9, 5.0, unknown(1, 1))
    landmarks = landmarks._replace(log_ris=np.array([[0.0]]))
    mean = np.concatenate([HERE, np.zeros(4), place])
    track = tracks_at(np.array([[1.0, 3.0, 2.5]]), [0.0])._replace(log_direct=np.zeros((1, 1)))
    found = find_candidate(track, landmarks, mean, CYCLE, poses(), CODES, SENSOR)
    assert found is not None
    np.testing.assert_allclose(found.position, place)
    np.testing.assert_allclose(found.is_panel, 0.5)


def test_a_candidate_is_no_scatterer_and_over_no_wall():
    """By hand: of three things that exclude each other, each as likely, one; of four, where it may leak; each panel by
    odds of its own."""
    place = np.array([[4.0, 4.0, 2.5], [1.0, 3.0, 2.5]])
    both = tracks_at(place, [0.0, -1.0])._replace(log_direct=np.zeros((2, 1)))
    for leak, told, share in ((-np.inf, PANEL, 3.0), (0.0, PANEL, 4.0), (0.0, UNTOLD, 3.0)):
        found = best(both._replace(log_leak=np.full((2, 1), leak), side=np.full(2, told)))
        assert found is not None
        np.testing.assert_allclose(found.is_panel, 1.0 / share)
    two = tracks_at(place[:1], [0.0])._replace(
        log_ris=np.array([[0.0, 0.0]]),
        log_direct=np.array([[-20.0, 20.0]]),
        side=np.array([UNTOLD]),
        log_leak=np.zeros((1, 2)),
    )
    mean = np.concatenate([HERE, np.zeros(4)])
    first, second = (find_candidate(two, empty_table(2), mean, CYCLE, poses(), CODES, SENSOR, q) for q in (0, 1))
    assert first is not None
    assert second is not None
    np.testing.assert_allclose([first.is_panel, second.is_panel], [0.0, 1.0 / 3.0], atol=1e-8)


def test_of_two_panels_each_has_its_own_leak_and_of_two_tracks_the_best_says_whether_it_is_told():
    place, mean = np.array([[4.0, 4.0, 2.5], [1.0, 3.0, 2.5]]), np.concatenate([HERE, np.zeros(4)])
    second = tracks_at(place[:1], [0.0])._replace(
        log_ris=np.array([[-30.0, 5.0]]), log_direct=np.full((1, 2), 30.0), log_leak=np.array([[30.0, -30.0]]),
        side=np.array([PANEL + 1]),
    )  # fmt: skip
    found = find_candidate(second, empty_table(2), mean, CYCLE, poses(), CODES, SENSOR, 1)
    assert found is not None
    np.testing.assert_allclose(found.is_panel, 1.0 / (1.0 + np.exp(-5.0)))
    for sides in ((PANEL, UNTOLD), (UNTOLD, PANEL)):
        found = best(tracks_at(place, [5.0, 0.0])._replace(side=np.array(sides)))
        assert found is not None
        assert found.told == (sides[0] == PANEL)


def test_a_candidate_carries_how_likely_it_is_heard_again_and_what_may_hide_it():
    loud = 0.5 * np.log(np.array([40.0, 12.0]) / SENSOR.radio.integrated_snr(np.ones(())))
    both = tracks_at(np.array([[4.0, 4.0, 2.5], [1.0, 3.0, 2.5]]), [0.0, 2.0])
    found = best(both._replace(log_amplitude=loud, hidden=np.array([[0.1, 0.2], [0.3, 0.4]])))
    assert found is not None
    np.testing.assert_allclose(found.again, CONSTANTS.shown * SENSOR.detection_probability(12.0))
    np.testing.assert_allclose(found.clear, 0.3 * CONSTANTS.cleared + 0.7 * (1.0 - CONSTANTS.rare))
    # what is hidden for sure gives way to what is less likely, and heard
    found = best(both._replace(log_amplitude=loud, hidden=np.array([[0.0, 0.2], [1.0, 0.4]])))
    assert found is not None
    np.testing.assert_allclose(found.again, CONSTANTS.shown * SENSOR.detection_probability(40.0))
