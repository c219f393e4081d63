"""Evidence of the motion where wall returns are thrown away: tracks that are too faint for one."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

from rislam_rt.model import RadioConfig
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD
from rislam_rt.slam.predicted_returns import NONE, TX
from rislam_rt.slam.window.divergence import length_rates
from rislam_rt.slam.window.divergence.motion_evidence import (
    are_no_wall_returns,
    log_odds_of_no_wall_return,
    with_evidence,
)
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.motion import track_rates
from rislam_rt.slam.window.motion.track_rates import with_rates
from rislam_rt.slam.window.smoother import window_gaussian

RADIO, COUNT, STEP = RadioConfig(), 12, 0.1
RAYS = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, -1.0, 0.0]])
TRUE, TOLD = np.array([0.2, -0.1, 0.0]), np.array([0.22, -0.08, 0.0])


class State(SimpleNamespace):
    def _replace(self, **changes):
        return State(**{**vars(self), **changes})


def mirror(length, reflection):
    """Log amplitude of a mirror's return of a length [m]: free space over it, less what is reflected."""
    return np.log(RADIO.wavelength * np.sqrt(RADIO.tx_gain * RADIO.rx_gain) / (4.0 * np.pi * length) * reflection)


def sphere(length, radius):
    """Log amplitude of a large sphere's return over a path of a length [m] there and back, by the radar equation."""
    area, gain = np.pi * radius**2, RADIO.tx_gain * RADIO.rx_gain
    power = gain * RADIO.wavelength**2 * area / ((4.0 * np.pi) ** 3 * (0.5 * length) ** 4)
    return 0.5 * np.log(power)


def tracks(length, level, side=OTHER, base=UNKNOWN):
    """Log of tracks (T,) of these lengths [m] and log amplitudes along `RAYS`, as the agent moves by `TRUE`."""
    cycle, track = (each.ravel() for each in np.meshgrid(np.arange(COUNT), np.arange(len(length)), indexing="ij"))
    rate, many = -2.0 * RAYS @ TRUE, len(cycle)
    seen = np.column_stack([length[track] + rate[track] * STEP * cycle, RAYS[track, :2]])
    none, form = np.zeros(many), np.full((many, 2, 5), NONE)
    form[:, :, 0] = UNKNOWN
    form[:, 0, 0] = np.broadcast_to(base, len(length))[track]
    return Log(
        cycle, seen, np.full((many, 3), 1e-3), level[track], none, np.broadcast_to(side, len(length))[track],
        np.where(form[:, 0, 0] == UNKNOWN, track, -1), form, none, np.zeros((many, 3)), np.zeros((many, 3)),
    )  # fmt: skip


def state_of(log, *, use_vt=False):
    """An agent that is told to move at `TOLD` within 0.02 m/s, on a floor, at a constant velocity."""
    window = window_gaussian.begin(np.zeros(3), TOLD, np.array([1e-5, 1e-5, 1e-5, 0.02, 0.02, 1e-4, 0.0]))
    for _ in range(COUNT - 1):
        window = window_gaussian.extend(window, STEP, np.full(3, 0.003**-2.0))
    body = SimpleNamespace(tx_offset=np.zeros(3), rx_offset=np.zeros(3))
    return State(
        window=window_gaussian.solve(window), log=log, cycle=COUNT - 1, heading=np.zeros(COUNT),
        scene=SimpleNamespace(use_vt=use_vt, body=body, radio=RADIO),
    )  # fmt: skip


LENGTH = np.array([5.0, 6.0, 7.0, 8.0])
WALLS, SPHERES = mirror(LENGTH, np.array([0.8, 0.6, 0.5, 0.3])), sphere(LENGTH, 0.08)


def velocity(state):
    """Velocity [m/s] across, and its deviations, once the rates of tracks have told."""
    mean, covariance = window_gaussian.now(window_gaussian.solve(with_rates(state).window))
    return mean[3:5], np.sqrt(np.diag(covariance)[3:5])


def test_faint_tracks_tell_the_velocity_and_wall_returns_move_nothing():
    found, std = velocity(state_of(tracks(LENGTH, SPHERES)))
    np.testing.assert_allclose(found, TRUE[:2], atol=5e-3)  # as with wall returns: 5 mm/s of a rate
    assert std.max() < 5e-3
    assert with_rates(state_of(tracks(LENGTH, WALLS))).window.rates is None
    loud, _ = velocity(state_of(tracks(LENGTH, WALLS), use_vt=True))
    np.testing.assert_allclose(loud, TRUE[:2], atol=5e-3)


def told_by(log):
    """Which of four tracks are classified as no wall returns."""
    return are_no_wall_returns(state_of(log), np.arange(4)).tolist()


def level_of(length, log_odds):
    """Log amplitude at which a track of a length [m] is no wall return at these log odds, below the mirrors'."""

    def off(level):
        log = tracks(np.full(1, length), np.full(1, level))
        return log_odds_of_no_wall_return(state_of(log), log, np.zeros(COUNT, dtype=np.int64))[0] - log_odds

    return brentq(off, mirror(length, 0.1) - 4.0, mirror(length, 0.5))


def test_what_is_merely_likelier_to_be_no_wall_return_is_no_evidence():
    """Held for true from log odds of 2.94 on, 19 to 1; all tracks have the same mean length."""
    log = tracks(np.full(4, 7.0), np.array([level_of(7.0, odds) for odds in (0.5, 2.7, 3.2, 6.0)]))
    log.seen[:, 0] = 7.0
    assert told_by(log) == [False, False, True, True]


def test_a_track_is_classified_by_its_mean_log_amplitude():
    """As faint as a sphere in half of its cycles, and as a wall in the others, it is louder than spheres are."""
    log = tracks(LENGTH, SPHERES)
    log.log_amplitude[:] = np.where((log.cycle % 2 == 0) & (log.track < 2), WALLS[log.track], SPHERES[log.track])
    quiet = tracks(LENGTH, 0.5 * (WALLS + SPHERES))
    assert told_by(log)[:2] == told_by(quiet)[:2]
    assert told_by(log)[2:] == [True, True]
    few = tracks(LENGTH, SPHERES)
    few.log_amplitude[few.cycle == 0] = WALLS
    assert told_by(few) == [True] * 4


def test_tracks_over_a_panel_are_no_wall_returns_however_loud():
    """Over any panel, if the receiver tells it for certain, in most cycles."""
    assert told_by(tracks(LENGTH, WALLS, side=np.array([PANEL, PANEL + 1, OTHER, UNTOLD]))) == [
        True,
        True,
        False,
        False,
    ]
    log = tracks(LENGTH, WALLS)
    log.side[:] = np.where(log.cycle < np.array([2, 5, 8, 12])[log.track], PANEL, OTHER)
    assert told_by(log) == [False, False, True, True]


def test_what_is_explained_counts_for_no_track():
    """A track's earlier components, as the map explains them, tell nothing of what it is by now."""
    log = tracks(LENGTH, SPHERES)
    log.form[log.cycle < 6, 0, 0] = 3
    log.log_amplitude[log.cycle < 6] = 0.0
    assert told_by(log) == [True] * 4


def test_the_log_and_the_tracks_stay_as_they_are():
    state = state_of(tracks(LENGTH, np.where(np.arange(4) < 2, WALLS, SPHERES)))
    after = with_rates(state)
    assert after.log is state.log
    assert after.window.rates.common.shape == (COUNT, 3, 4)  # two numbers of each of two tracks


def _rates(state):
    """Rates of all tracks and explained paths."""
    place = window_gaussian.poses(state.window)[:, :3]
    heard = length_rates.Heard(state.log, state.heading, place, STEP, np.zeros(3), 0.5)
    return length_rates.rates(length_rates.lengths(heard))


def test_rates_of_walls_alone_are_no_evidence():
    """Of tracks by their loudness, of explained paths by what they run over; with wall returns all are."""
    log = tracks(LENGTH, np.array([WALLS[0], SPHERES[1], WALLS[2], WALLS[3]]), base=np.array([TX, UNKNOWN, UNKNOWN, 4]))
    found = _rates(state_of(log))
    told = with_evidence(state_of(log), found)
    assert {(int(base), int(track)) for base, *_, track in told.name} == {(UNKNOWN, 1), (4, -1)}
    rows = [found.name.tolist().index(name) for name in told.name.tolist()]
    for field in ("toward", "rate", "variance", "blur", "whole", "bend", "bend_variance"):
        np.testing.assert_array_equal(getattr(told, field), getattr(found, field)[rows])
    assert with_evidence(state_of(log, use_vt=True), found) is found
    np.testing.assert_allclose(found.kinds.follows, 0.5)
    np.testing.assert_allclose(told.kinds.follows, 0.25)  # of 3079 paths beyond walls 26 to 37 %
    np.testing.assert_allclose(told.kinds.follows + told.kinds.keeps + told.kinds.other, 1.0)


def test_a_track_that_is_heard_alike_from_two_directions_keeps_both():
    found = _rates(state_of(tracks(LENGTH, SPHERES)))
    owner = np.array([0, 1, 2, 3, 1])
    twice = found._replace(owner=owner, **{
        name: getattr(found, name)[owner]
        for name in ("toward", "rate", "variance", "blur", "whole", "bend", "bend_variance", "name")
    })  # fmt: skip
    kept = twice.take(owner != 0)
    np.testing.assert_array_equal(kept.owner, [0, 1, 2, 0])
    np.testing.assert_array_equal(kept.share, [0.5, 1.0, 1.0, 0.5])
    np.testing.assert_array_equal(kept.rate, found.rate[[1, 2, 3, 1]])


def test_a_path_whose_reciprocal_is_louder_has_both_directions():
    """Two tracks as long as each other, one over the limit and one below: it alone counts, along both directions."""
    way = -(RAYS[0] + RAYS[1]) @ TRUE
    log = tracks(np.full(4, 7.0), np.array([level_of(7.0, odds) for odds in (3.2, 2.6, -2.0, -2.0)]))
    log.seen[:, 0] = 7.0 + np.array([0.0, 0.0, 3.0, 6.0])[log.track] + way * STEP * log.cycle
    assert told_by(log)[:2] == [True, False]
    told = with_rates(state_of(log)).window.rates
    toward = np.unique(told.common.reshape(COUNT, 3, -1, 2)[3, :, :, 0].T.round(12), axis=0)
    assert len(toward) == 2  # back as it went, and along both


@pytest.mark.parametrize("length", [4.0, 12.0, 30.0])
@pytest.mark.parametrize("below", [0.0, 2.0, 4.0, 6.0])
def test_the_odds_are_those_of_the_densities_of_loudness(length, below):
    """Points, their images in a wall, and returns over one wall or two, anywhere in the volume (from `scipy`)."""
    level, fading, wall, std = mirror(length, 1.0) - below, CONSTANTS.fading, CONSTANTS.wall_ratio, 0.5
    median = sphere(length, CONSTANTS.strength / np.sqrt(np.pi))  # whose cross-section's root is `strength`
    wide = np.hypot(CONSTANTS.strength_std, fading)
    more, free = np.exp(2.0 * wall), mirror(length, 1.0)
    point = norm.pdf(level, median, wide) + more * norm.pdf(level, median + wall, np.hypot(wide, std))
    double = more * norm.pdf(level, free + 2.0 * wall, np.hypot(np.sqrt(2.0) * std, fading))
    single = norm.pdf(level, free + wall, np.hypot(std, fading))
    # a wall is anywhere up to `size`; a thing half as far off as its path is long, anywhere in the ball of that radius
    ball = 4.0 / 3.0 * np.pi * CONSTANTS.size**3
    there, on_wall = length**2 / 8.0 / ball, 1.0 / (8.0 * np.pi * CONSTANTS.size)
    expected = np.log(there * point / (on_wall * single + there * double))
    log = tracks(np.full(1, length), np.full(1, level))
    log.seen[:, 0] = length
    found = log_odds_of_no_wall_return(state_of(log), log, np.zeros(COUNT, dtype=np.int64))
    np.testing.assert_allclose(found, expected, rtol=1e-9)  # sums of logarithms in double precision


def test_fewer_paths_beyond_walls_come_back_as_they_went(monkeypatch):
    """Of tracks that agree with the motion, the odds are those beforehand times what their rates tell."""
    shares = []
    monkeypatch.setattr(track_rates, "_factor", lambda found, share, state: shares.append(share) or None)
    for use_vt in (True, False):
        with_rates(state_of(tracks(LENGTH, SPHERES), use_vt=use_vt))
    every, beyond = (share / (1.0 - share) for share in shares)
    # a length that changes by 0.3 m/s is not one that stays
    np.testing.assert_allclose(beyond / every, (0.25 / 0.72) / (0.5 / 0.375), rtol=1e-3)
