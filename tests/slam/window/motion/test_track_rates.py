"""Rates of the tracks that nothing explains, as measurements of the agent's way."""

from types import SimpleNamespace

import numpy as np

from rislam_rt.model import RadioConfig
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.motion.track_rates import rate_factor, with_rates
from rislam_rt.slam.window.smoother import window_gaussian

TRUE, TOLD, COUNT, STEP = np.array([0.2, -0.1, 0.0]), np.array([0.22, -0.08, 0.0]), 12, 0.1
RAYS = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, -1.0, 0.0]])


def _log(rate):
    """Measurements, one of each track in each cycle, of tracks with these rates (T,) along `RAYS`, within 1 mm."""
    cycle, track = (each.ravel() for each in np.meshgrid(np.arange(COUNT), np.arange(len(rate)), indexing="ij"))
    length = 5.0 + track + rate[track] * STEP * cycle
    many, none = len(cycle), np.zeros(len(cycle))
    return Log(
        cycle, np.concatenate([length[:, None], RAYS[track, :2]], axis=1), np.full((many, 3), 1e-3), none, none,
        none.astype(np.int64), track, np.full((many, 2, 5), UNKNOWN), none, np.zeros((many, 3)), np.zeros((many, 3)),
    )  # fmt: skip


def _state(log, *, use_vt=True):
    """An agent that is told to move at `TOLD` within 0.02 m/s, on a floor, at a constant velocity."""
    window = window_gaussian.begin(np.zeros(3), TOLD, np.array([1e-5, 1e-5, 1e-5, 0.02, 0.02, 1e-4, 0.0]))
    for _ in range(COUNT - 1):
        window = window_gaussian.extend(window, STEP, np.full(3, 0.003**-2.0))
    body = SimpleNamespace(tx_offset=np.zeros(3), rx_offset=np.zeros(3))
    return SimpleNamespace(
        window=window_gaussian.solve(window), log=log, cycle=COUNT - 1, heading=np.zeros(COUNT),
        scene=SimpleNamespace(use_vt=use_vt, body=body, radio=RadioConfig()),
    )  # fmt: skip


def _solved(state):
    return window_gaussian.now(window_gaussian.solve(state.window._replace(rates=rate_factor(state))))


def test_tracks_that_are_no_features_tell_the_velocity():
    mean, covariance = _solved(_state(_log(-2.0 * RAYS @ TRUE)))
    # 1 mm twelve times in 1.1 s, 5.7 times as uncertain as reported: 5 mm/s of a rate, twice the velocity
    assert np.sqrt(np.diag(covariance)[3:5]).max() < 5e-3
    np.testing.assert_allclose(mean[3:5], TRUE[:2], atol=5e-3)


def test_a_long_track_that_scatters_as_reported_counts_more_than_one_that_scatters_more():
    log = _log(-2.0 * RAYS @ TRUE)
    wild = 4e-3 * np.random.default_rng(1).standard_normal(len(log.cycle))
    rough = log._replace(seen=log.seen + wild[:, None] * [1.0, 0.0, 0.0])
    calm, shaken = (np.sqrt(np.diag(_solved(_state(each))[1])[3:5]).max() for each in (log, rough))
    assert shaken > 1.3 * calm


def test_a_path_that_keeps_its_length_moves_nothing():
    """As over opposite walls, to and fro along the way: it speaks against no motion."""
    rate = -2.0 * RAYS @ TRUE
    rate[0] = 0.0
    kept, _ = _solved(_state(_log(rate)))
    np.testing.assert_allclose(kept[3:5], TRUE[:2], atol=7e-3)


def test_what_the_map_explains_counts_no_more():
    log = _log(-2.0 * RAYS @ TRUE)
    log.form[log.track < 3] = 0
    one = rate_factor(_state(log))
    assert one.common.shape == (COUNT, 3, 2)
    log.form[:] = 0
    assert rate_factor(_state(log)) is None


def test_wall_returns_that_are_thrown_away_move_nothing():
    assert rate_factor(_state(_log(-2.0 * RAYS @ TRUE), use_vt=False)) is None


def test_a_lone_path_of_another_kind_is_held_for_that():
    """Of one track a rate ten deviations off what the velocity may be: half of all tracks are something else."""
    rate = -2.0 * RAYS @ TOLD
    rate[1:] += [0.4, -0.4, 0.4]
    mean, _ = _solved(_state(_log(rate)))
    np.testing.assert_allclose(mean[3:5], TOLD[:2], atol=2e-3)


def test_the_state_takes_the_factor_into_its_window():
    class State(SimpleNamespace):
        def _replace(self, **changes):
            return State(**{**vars(self), **changes})

    state = with_rates(State(**vars(_state(_log(-2.0 * RAYS @ TRUE)))))
    assert state.window.rates.middle.shape == (COUNT, 3)
