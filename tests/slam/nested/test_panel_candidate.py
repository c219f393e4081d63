"""Where the panel may hang: places of tracks, their identity by amplitudes and silence, and who is suspected."""

import numpy as np
import pytest

from rislam_rt.model import Body, RadioConfig, RisCode, RisSpec, SensorModel
from rislam_rt.ris.path_gain import panel_path_gain
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.nested.belief_moments import POSE, Moments
from rislam_rt.slam.nested.landmark_table import empty_table
from rislam_rt.slam.nested.measurement_prediction import MapBelief
from rislam_rt.slam.nested.panel_candidate import find_panel_candidate, weigh_tracks
from rislam_rt.slam.nested.tracks import LandmarkTracks, advance, begin, extend, no_tracks
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.returns import Returns, observe
from rislam_rt.slam.ris_candidate import DEEP, places

RADIO, BODY = RadioConfig(noise_psd=3.52e-12), Body()
PANEL = RisSpec(6, 6, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))
AGENT = Moments(np.concatenate([[2.0, 2.5, 0.5], np.zeros(3), [0.4]]), 1e-6 * np.eye(POSE))
POSES = poses_of(AGENT.position, np.asarray(AGENT.heading), BODY)
SPOTS = np.array([[3.0, 3.0, 3.0], [2.0, 1.0, 1.5]])
"""The panel, and a scatterer."""
THRESHOLD = 10.0


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def looks() -> np.ndarray:
    """(2, 3) what is measured of the spots."""
    rows = np.arange(2)
    fixed = Returns(np.stack([rows, np.full(2, -1), np.full(2, -1)], axis=1), rows, rows)
    return observe(fixed, SPOTS, SPOTS, POSES).seen


def belief() -> MapBelief:
    return MapBelief(np.zeros((0, 3)), empty_table(), POSES, BODY, SensorModel(RADIO, threshold=THRESHOLD), PANEL)


def observed(picks: list[int], amplitude: np.ndarray) -> Observations:
    seen, std = looks()[picks], np.tile([0.02, 0.02, 0.02], (len(picks), 1))
    log = np.log(amplitude[picks])
    return Observations(seen, std, log, np.full(len(picks), 0.1), 0.1 * amplitude[picks], 0.0 * log)


def follow(cycles: int, rng: np.random.Generator) -> LandmarkTracks:
    """Both spots under a new random code a cycle; the panel is silent below the threshold, as the receiver has it."""
    noise = np.sqrt(RADIO.noise_psd / (2.0 * RADIO.array.num_antennas * RADIO.energy))
    least = noise * np.sqrt(2.0 * THRESHOLD)
    ball = 3.0 * least
    tracks, dull = no_tracks(40), np.zeros(2, dtype=np.bool_)
    for cycle in range(cycles):
        code = RisCode(rng.integers(4, size=(6, 6)), 4)
        gain = panel_path_gain(PANEL, code, SPOTS[:1], POSES.tx, POSES.rx, np.ones(1), RADIO)
        amplitude = np.hypot(*(np.array([[abs(gain[0]), ball], [0.0, 0.0]]) + noise * rng.standard_normal((2, 2))))
        seen = observed([0, 1], amplitude)
        if not cycle:
            tracks = begin(tracks, seen, np.arange(2), dull, np.full(3, 0.01), cycle)
        else:
            heard = np.flatnonzero(amplitude > least)
            tracks = extend(advance(tracks, 0.1, cycle, np.full(3, 1e-3)), heard, seen, heard, dull, cycle)
        tracks = weigh_tracks(tracks, belief(), code)
    return tracks


def test_a_place_is_where_a_point_was_measured_from() -> None:
    """`places` inverts `observe`, to rounding."""
    spots, reach = places(looks(), POSES)
    np.testing.assert_allclose(spots, SPOTS, atol=1e-9)
    np.testing.assert_allclose(reach, np.linalg.norm(SPOTS - POSES.rx, axis=1), atol=1e-9)


def test_silence_when_the_panel_would_shout_speaks_against_it(rng: np.random.Generator) -> None:
    tracks = begin(no_tracks(40), observed([0], np.full(2, 1e-5)), np.arange(1), np.zeros(1, bool), np.full(3, 0.01), 0)
    tracks = advance(tracks, 0.1, 1, np.full(3, 1e-3))
    loudest = max(
        (RisCode(rng.integers(4, size=(6, 6)), 4) for _ in range(300)),
        key=lambda c: abs(panel_path_gain(PANEL, c, SPOTS[:1], POSES.tx, POSES.rx, np.ones(1), RADIO)[0]),
    )
    before = tracks.log_ris[0]
    assert weigh_tracks(tracks, belief(), loudest).log_ris[0] < before - 0.5


def test_the_likelier_track_is_suspected_and_none_without_evidence(rng: np.random.Generator) -> None:
    tracks = follow(20, rng)
    suspect = find_panel_candidate(tracks._replace(misses=np.zeros(2, dtype=np.int64)), empty_table(), AGENT, BODY)
    assert suspect is not None
    np.testing.assert_allclose(suspect.position, SPOTS[0], atol=0.05)  # 20 looks of 0.02 in cosines, 2.7 m away
    assert suspect.hits == int(tracks.length[0])
    doubted = tracks._replace(log_ris=np.full((2, 1), -10.0))
    assert find_panel_candidate(doubted, empty_table(), AGENT, BODY) is None
    assert find_panel_candidate(no_tracks(4), empty_table(), AGENT, BODY) is None


def test_nothing_deep_behind_a_mirror_is_suspected(rng: np.random.Generator) -> None:
    """A wall return overhead (the ceiling, 2.5 m up) leaves what hangs on it, and rules out what is far behind it."""
    up = np.array([[5.0, 0.0, 0.0]])
    overhead = Observations(up, np.full((1, 3), 0.01), np.zeros(1), np.ones(1), np.ones(1), np.ones(1))
    bright = np.ones(1, dtype=np.bool_)

    def suspected(height: float) -> bool:
        spot = np.array([2.5, 2.5, height])
        rows = np.arange(1)
        fixed = Returns(np.array([[0, -1, -1]]), rows, rows)
        seen = observe(fixed, spot[None], spot[None], POSES).seen
        mine = Observations(seen, np.full((1, 3), 0.01), np.zeros(1), np.ones(1), np.ones(1), np.zeros(1))
        tracks = begin(no_tracks(40), overhead, rows, bright, np.full(3, 0.01), 0)
        tracks = begin(tracks, mine, rows, ~bright, np.full(3, 0.01), 0)
        for cycle in range(1, 4):
            tracks = advance(tracks, 0.1, cycle, np.full(3, 1e-3))
            tracks = extend(tracks, np.array([0]), overhead, rows, bright, cycle)
            tracks = extend(tracks, np.array([1]), mine, rows, ~bright, cycle)
        return (
            find_panel_candidate(tracks._replace(log_ris=np.full((2, 1), 5.0)), empty_table(), AGENT, BODY) is not None
        )

    assert suspected(3.0)
    assert not suspected(3.0 + 2.0 * DEEP)
