"""An agent that is carried: its bob is no floor that rises, its floor stays level, and a climb is followed all the
same."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rislam_rt import slam
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import ReceiverConfig, measure, with_reference_snr
from rislam_rt.model import RadioConfig, SensorModel
from rislam_rt.pipeline.scheme_simulation import without_panel
from rislam_rt.scene import load_scene
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.window import estimates
from rislam_rt.slam.window.relinearisation import heave_now, predictions, relinearise, trust, whitened
from rislam_rt.slam.window.smoother import heave, window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import HEAD, POSE

ROOM, COUNT, DT = Path(__file__).parents[3] / "scenes" / "paper_room", 60, 0.1
TIME, BOB = DT * np.arange(COUNT), 0.012
CONFIG = SlamConfig(filter="window", use_vt=True)
STEP = 2.0 * np.pi * 1.8


def course(height, rise):
    """Positions and velocities (K, 3) of a walk at 0.3 m/s, at heights [m] that rise by `rise` [m/s] in each cycle."""
    place = np.column_stack([1.6 + 0.3 * TIME, 1.4 + 0.1 * TIME, 1.2 + height])
    return place, np.column_stack([np.full(COUNT, 0.3), np.full(COUNT, 0.1), rise])


def carried(place, velocity, seed):
    """Errors (K,) [m] and told deviations (K,) of the height, and the last state, of the filter in the paper's room
    without its panel."""
    scene, rng = load_scene(ROOM), np.random.default_rng(seed)
    count = len(place)
    motion = replace(scene.agent[:count], position=place, velocity=velocity, heading=np.full(count, 0.3))
    radio = with_reference_snr(RadioConfig(), 13.0)
    paths = without_panel(ImageSourceChannel(replace(scene, agent=motion), radio, 2).paths(motion))
    start = StartPrior(place[0], velocity[0] + 0.01 * rng.standard_normal(3) * [1.0, 1.0, 0.0], 0.3)
    state = slam.init(start, motion.body, None, SensorModel(radio), CONFIG, rng=rng)
    error, std = np.empty((2, count))
    for cycle in range(count):
        heard, _ = measure(paths, cycle, 0.3, radio, ReceiverConfig("bound", alternation=False), rng=rng)
        state, _ = slam.step(state, heard, None, DT if cycle else 0.0, 0.3, CONFIG, rng=rng)
        found = slam.estimate(state, CONFIG)
        error[cycle], std[cycle] = found.position[2] - place[cycle, 2], np.sqrt(found.covariance[2, 2])
    return error, std, state


@cache
def bobbing(phase):
    """Positions, and what `carried` makes of them, of a walker that bobs as it steps; of what several look at, once."""
    place, velocity = course(BOB * np.sin(STEP * TIME + phase), BOB * STEP * np.cos(STEP * TIME + phase))
    return place, carried(place, velocity, 1)


@pytest.mark.parametrize("phase", [0.0, *(pytest.param(x, marks=pytest.mark.slow) for x in (1.0, 1.5, 4.5))])
def test_a_bob_is_followed_above_a_level_floor(phase):
    """Wherever in its step the walker is at the start: told that it rises, stands, or sinks."""
    place, (error, std, state) = bobbing(phase)
    assert state.is_level
    assert np.sqrt(state.heave_variance) == pytest.approx(BOB / np.sqrt(2.0), rel=0.6)  # its ladder's steps
    assert np.sqrt(np.mean(error[40:] ** 2)) < 0.25 * BOB / np.sqrt(2.0)
    assert np.sqrt(np.mean((slam.smoothed(state)[:, 2] - place[:, 2]) ** 2)) < 0.25 * BOB / np.sqrt(2.0)
    assert np.mean(error[40:] ** 2 / std[40:] ** 2) < 4.0  # nearly one draw of one number: 95 % are below


def test_where_a_bob_has_ended_there_may_be_one():
    """In the cycles after, while the window still holds a heave; and in the next one, ahead."""
    _, (*_, state) = bobbing(0.0)
    variance = state.window.heave_variance.copy()
    variance[-1] = 0.0
    ended = state._replace(window=state.window._replace(heave_variance=variance), heave_levels=heave.first_levels())
    assert ended.heave_variance == 0.0
    for ahead in (0.0, DT):
        assert estimates.estimate(ended, CONFIG, ahead).covariance[2, 2] > ended.heave_uncertainty > 0.0


def test_wheels_have_no_heave():
    place, velocity = course(np.zeros(COUNT), np.zeros(COUNT))
    error, _, state = carried(place[:30], velocity[:30], 2)
    assert not state.heaves
    assert state.heave_variance == 0.0
    assert np.abs(error).max() < 1e-4


def test_a_climb_is_no_heave():
    rise = 0.15 * np.clip(TIME - 2.0, 0.0, 1.0)
    place, velocity = course(DT * (np.cumsum(rise) - rise), rise)
    error, _, state = carried(place[:52], velocity[:52], 3)
    assert not state.heaves
    assert np.abs(error[44:]).max() < 0.02


def height_variance(state):
    """Variance [m^2] of the body's height after its last cycle, with the nuisances of that cycle as unknowns beside all
    of the window's, in one dense matrix."""
    window, heard = state.window, whitened(state, predictions(state, state.window.num_poses - 1))
    size, axes, design = len(window.head), heard.turned.shape[2], window_gaussian.pose_design(window)[-1]
    by = np.zeros((heard.slopes.shape[2], len(window.covariance)))
    by[:3, :HEAD], by[:3, size:], by[3, HEAD - 1] = design[:, :HEAD], design[:, HEAD:], 1.0
    by[POSE:, HEAD:size] = np.eye(size - HEAD)
    slots = window.slots.hessian.copy()
    slots[-1] = 0.0
    others = window._replace(slots=window.slots._replace(hessian=slots))
    rows = np.concatenate([heard.slopes @ by, heard.turned], axis=2) * np.sqrt(trust(heard.left))[:, None, None]
    rows = rows.reshape(-1, rows.shape[2])
    information = rows.T @ rows + np.diag(np.append(np.zeros(len(by[0])), 1.0 / state.nuisance_variance[-1]))
    information[:-axes, :-axes] += window_gaussian._normal(others)[0]
    height = np.concatenate([by[2], np.zeros(axes - 1), [1.0]])
    return height @ np.linalg.solve(information, height)


def test_the_height_is_as_uncertain_as_floor_and_heave_are_together():
    """Not as both are apart: what a cycle tells of their sum parts them."""
    _, (*_, state) = bobbing(0.0)
    inside = state._replace(cycle=state.cycle - 1)
    for _ in range(5):  # what is estimated and what it is linearised at agree
        inside, _ = relinearise(inside, 0)
        inside = inside._replace(window=window_gaussian.solve(inside.window))
    state = inside._replace(cycle=state.cycle)
    mean, covariance, excess = window_gaussian.now_with_excess(state.window)
    slope, own = heave_now(state)
    by = np.eye(len(mean))[2] - slope
    assert by @ covariance @ by + own == pytest.approx(height_variance(inside), rel=1e-4)
    stated = slam.estimate(state, CONFIG).covariance[2, 2]
    assert stated == pytest.approx(height_variance(inside) + by[:6] @ excess @ by[:6], rel=1e-4)
    assert stated < 0.25 * (covariance[2, 2] + own)
