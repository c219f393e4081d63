"""What may tell of the motion where wall returns are thrown away: tracks that are too faint for one."""

from types import SimpleNamespace

import numpy as np
import pytest
from rislam_rt.slam.window.motion.motion_evidence import log_odds_of_no_wall_return, with_motion_evidence
from scipy.stats import norm

from rislam_rt.model import RadioConfig
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import OTHER, PANEL
from rislam_rt.slam.predicted_returns import NONE, TX
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.measurement_log import Log
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


def test_of_tracks_of_both_kinds_the_faint_ones_are_kept():
    log = with_motion_evidence(state_of(tracks(LENGTH, np.where(np.arange(4) < 2, WALLS, SPHERES)))).log
    assert set(log.track) == {2, 3}
    assert len(log.cycle) == 2 * COUNT


def test_what_is_understood_is_kept_unless_it_runs_over_walls_alone():
    log = with_motion_evidence(state_of(tracks(LENGTH, WALLS, base=np.array([TX, 3, UNKNOWN, 4])))).log
    assert set(log.form[:, 0, 0]) == {3, 4}


def test_what_the_codes_tell_to_run_over_a_panel_is_no_wall_return_however_loud():
    log = with_motion_evidence(state_of(tracks(LENGTH, WALLS, side=np.array([PANEL, OTHER, OTHER, OTHER])))).log
    assert set(log.track) == {0}


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
