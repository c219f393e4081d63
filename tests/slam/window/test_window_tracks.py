"""How long a track that is missed is waited for."""

from pathlib import Path

import numpy as np
import pytest
import scipy

from rislam_rt import slam
from rislam_rt.model import Measurement, RadioConfig, SensorModel
from rislam_rt.scene import load_scene
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.window import tracks
from rislam_rt.slam.window.landmarks.horizon_detection import level_above, prior_tilts
from rislam_rt.slam.window.smoother import attitude


def waits(level, seen, hits=3):
    """Cycles for which a track of so many measurements at `seen` (3,) is waited for, while the body sways by the
    deviation number `level`."""
    one = np.ones(1)
    heard = Observations(seen[None], np.full((1, 3), 1e-3), one, 0.1 * one, one)
    found, _ = tracks.start(tracks.no_tracks(), heard, np.array([0]), np.full((1, 3), 0.1), 0)
    found = found._replace(hits=np.array([hits]), last=np.array([hits - 1]))
    probability = np.tile(np.eye(len(attitude.levels()))[level], (2, 1))
    above = level_above(tracks.nearly_level(found), found.rises, prior_tilts(probability))
    cycle = hits - 1
    while tracks.alive(found, cycle + 1, above, probability[0])[0]:
        cycle += 1
    return cycle - (hits - 1)


def test_a_level_track_is_waited_for_longer_while_the_body_sways():
    rim, ceiling = np.array([5.0, 0.6, 0.8]), np.array([5.0, 0.1, 0.2])
    assert waits(0, rim) == waits(0, ceiling) == waits(4, ceiling) == 3
    assert waits(4, rim) > 4
    assert waits(4, rim, hits=8) > waits(0, rim, hits=8)


def test_tracks_go_on_as_in_a_manoeuvre_if_that_is_likelier_for_all_of_them():
    """Lengths that change by 3 cm more than believed are those of who accelerates; one such alone is another thing."""
    seen = np.array([[5.0, 0.1, 0.2], [7.0, -0.3, 0.2], [9.0, 0.4, -0.5], [4.0, 0.0, 0.6]])
    heard = Observations(seen, np.full((4, 3), 1e-3), np.zeros(4), np.full(4, 0.1), np.ones(4))
    found, _ = tracks.start(tracks.no_tracks(), heard, np.arange(4), np.full((4, 3), 0.02), 0)
    calm, lively = (tracks.advance(found, 0.1, 0.0, np.array([bend, 0.1, 0.1]), np.zeros(2)) for bend in (0.1, 2.0))
    for moved, followed in ((3, True), (1, False), (0, False)):
        now = heard._replace(seen=seen + 0.03 * (np.arange(4) < moved)[:, None] * [1.0, 0.0, 0.0])
        both, rows, picks = tracks.match_over_motions(calm, lambda: (lively, np.log(0.02)), now, np.arange(4), 1, 1e-3)
        assert both is (lively if followed else calm)
        np.testing.assert_array_equal(rows, picks)
        assert len(rows) == (4 if followed else 4 - moved)


def test_a_track_is_real_by_the_density_of_its_continuation_against_that_of_false_components():
    """By the normal density of scipy; a far one tells against it, and neither by more than a rare event may."""
    seen, std = np.array([[5.0, 0.1, 0.2]]), np.array([[0.3, 0.2, 0.2]])
    heard = Observations(seen, std, np.zeros(1), np.full(1, 0.1), np.ones(1))
    begun, _ = tracks.start(tracks.no_tracks(), heard, np.array([0]), np.full((1, 3), 0.02), 0, -2.0)
    for gap, false in ((0.1, 0.5), (0.5, 0.5), (0.0, 1e-6), (30.0, 0.5)):
        now = heard._replace(seen=seen + np.array([gap, 0.0, 0.0]), log_amplitude=np.array([0.3]))
        after = tracks.with_evidence(begun, np.array([0]), now, np.array([0]), 1, np.array([false]))
        density = scipy.stats.norm.logpdf([gap, 0.0, 0.0], scale=np.sqrt(2.0) * std[0]).sum()
        density += scipy.stats.norm.logpdf(0.3, scale=np.hypot(tracks.WANDER, 0.1))
        told = density + np.log(2.0 / 3.0) - np.log(false)
        told = np.clip(told, -CONSTANTS.max_log_ratio, CONSTANTS.max_log_ratio)
        np.testing.assert_allclose(after.log_real, -2.0 + told)


@pytest.mark.parametrize("told", ["told", "learnt"])
def test_a_faint_path_keeps_its_track_where_the_motion_is_told(told):
    """Heard in one cycle of five among false components, for 9 s: of a motion that is learnt no rate is known, and
    what is heard again after half a second may be anything; else it is where it is predicted."""
    rng, config = np.random.default_rng(3), SlamConfig(filter="window", use_vt=False, motion=told)
    body, radio = load_scene(Path(__file__).parents[3] / "scenes" / "paper_room").agent.body, RadioConfig()
    velocity, point = np.array([0.1, 0.0, 0.0]), np.array([1.0, 1.2, 2.0])
    start = StartPrior(np.zeros(3), velocity, 0.0)
    state, owners = slam.init(start, body, None, SensorModel(radio), config, rng=rng), []
    for cycle in range(90):
        ends = 0.1 * cycle * velocity + np.stack([body.tx_offset, body.rx_offset])
        legs = point - ends
        far = np.linalg.norm(legs, axis=1)
        unit = rng.standard_normal((1, 3))
        seen = np.append(rng.uniform(1.0, 20.0), unit[0, :2] / np.linalg.norm(unit))[None]
        if rng.random() < 0.2:
            seen = np.concatenate([seen, np.append(far.sum(), legs[1, :2] / far[1])[None]])
            seen[1] += rng.normal(0.0, [0.03, 0.06, 0.06])
        number = len(seen)
        heard = Measurement(
            seen[:, 0] / 299792458.0, seen[:, 1:], np.full(number, 5e-6), np.full(number, 1e-10),
            np.full((number, 2), 0.06), np.full(number, 1e-6),
        )  # fmt: skip
        state, _ = slam.step(state, heard, None, 0.1 * (cycle > 0), 0.0, config, rng=rng)
        rows = (state.log.cycle == cycle).nonzero()[0]
        if number > 1:
            at = rows[np.argmin(np.abs(state.log.seen[rows, 0] - seen[1, 0]))]
            owners.append(int(state.log.track[at]))
    assert len(set(owners[:8])) == 1 if told == "told" else len(set(owners)) > 8
    assert (-1 in owners) == (told == "told")  # born


def test_a_track_keeps_when_and_how_loud_it_was_heard_before():
    seen = np.array([[5.0, 0.1, 0.2]])
    heard = Observations(seen, np.full((1, 3), 1e-2), np.array([-3.0]), np.full(1, 0.1), np.ones(1))
    found, _ = tracks.start(tracks.no_tracks(2), heard, np.array([0]), np.full((1, 3), 0.02), 3)
    assert (found.last[0], found.earlier[0], found.earlier_log_amplitude[0]) == (3, 3, -3.0)
    np.testing.assert_array_equal(found.log_direct, np.zeros((1, 2)))
    np.testing.assert_array_equal(found.log_leak, np.full((1, 2), CONSTANTS.log_rare))
    for cycle, loud, before, then in ((5, -2.0, 3, -3.0), (6, -1.0, 5, -2.0)):
        louder = heard._replace(log_amplitude=np.array([loud]))
        found = tracks.extend(found, np.array([0]), louder, np.array([0]), cycle)
        assert (found.last[0], found.earlier[0], found.earlier_log_amplitude[0]) == (cycle, before, then)
