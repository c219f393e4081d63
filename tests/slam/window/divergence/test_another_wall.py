"""What comes in front of a wall moves all returns over it as a jump of the agent would, and is none."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.measurement import ReceiverConfig, build_sensor, measure
from rislam_rt.model import RadioConfig
from rislam_rt.scene import load_scene
from rislam_rt.slam import SlamConfig, StartPrior, estimate, init, step
from rislam_rt.slam.step_info import LossCause
from rislam_rt.slam.window import filter as window_filter
from rislam_rt.slam.window.divergence import divergence_monitor
from rislam_rt.slam.window.smoother import window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import HEAD

RADIO, CYCLES = RadioConfig(noise_psd=3.52e-13), 10


CONFIG = SlamConfig()


def _lead(cycles, more, by, seed=4):
    """States of the filter in the paper's room, from cycle `cycles` on, when the agent jumps by `by` (3,) [m], and what
    it is given in each, in `more` cycles; its true places, and its heading."""
    rng, receiver, room = (
        np.random.default_rng(seed),
        ReceiverConfig("bound", clutter_rate=0.0),
        load_scene("paper_room"),
    )
    motion = room.agent[60 : 60 + cycles + more]
    place = motion.position.copy()
    place[cycles:] += by
    motion = replace(motion, position=place)
    paths = ImageSourceChannel(room, RADIO, 1).paths(motion)
    heading = float(motion.heading[0])
    start = StartPrior(place[0], motion.velocity[0], heading)
    state, states, given = init(start, motion.body, None, build_sensor(RADIO, receiver), CONFIG, rng=rng), [], []
    for cycle in range(cycles + more):
        given.append(measure(paths.of_cycle(cycle), 0, heading, RADIO, receiver, None, rng=rng)[0])
        states.append(state)
        state, _ = step(state, given[-1], None, 0.1 if cycle else 0.0, heading, CONFIG, rng=rng)
    assert len(states[cycles].landmarks.walls) >= 2
    return [*states[cycles + 1 :], state], states[cycles], given[cycles], place[cycles:], heading


@pytest.fixture(scope="module")
def led():
    """State of the filter after ten cycles, when it knows walls, and what it is given next."""
    _, state, heard, _, heading = _lead(CYCLES, 1, np.zeros(3))
    return state, heard, heading, CONFIG


def _distances(window, landmarks, place):
    """Distances [m] of the map's walls from a place."""
    image = window.head[HEAD:].reshape(-1, 3)[landmarks.walls]
    anchor = landmarks.anchor[landmarks.walls]
    normal = (image - anchor) / np.linalg.norm(image - anchor, axis=1, keepdims=True)
    return np.abs(np.vecdot(normal, 0.5 * (image + anchor) - place))


def test_one_wall_at_a_time_is_heard_as_after_the_jump(led):
    state, landmarks = led[0], led[0].landmarks
    here, by = window_gaussian.poses(state.window)[-1, :3], np.array([0.3, 0.4, 0.0])
    before, after = _distances(state.window, landmarks, here), _distances(state.window, landmarks, here + by)
    others = divergence_monitor.with_another_wall(state.window, landmarks, by)
    moves = np.abs(after - before) > divergence_monitor.CELL
    assert 1 <= moves.sum() == len(others)
    for row, window in zip(moves.nonzero()[0], others, strict=True):
        wanted = np.where(np.arange(len(before)) == row, after, before)
        np.testing.assert_allclose(_distances(window, landmarks, here), wanted, atol=1e-9)


@pytest.mark.parametrize(("score", "jumps"), [(140.0, False), (120.0, True)])
def test_a_jump_is_believed_if_no_other_wall_explains_what_is_heard_as_well(led, score, jumps, monkeypatch):
    """Of a cycle that the map explains by 100, and a jump by 135: that is as much more likely than another wall as
    their priors leave of it."""
    state, heard, heading, config = led
    real, first = window_filter.associate_cycle, state.window.head

    def scored(window, *given, **options):
        view = real(window, *given, **options)
        if np.abs(window.head - first).max() > 1.0:  # [m] twice as far as the wall went
            return view._replace(score=score, surprise=0.0)
        moved = np.abs(window.accel).max() > 10.0
        return view._replace(score=135.0 if moved else 100.0, surprise=2.0)

    monkeypatch.setattr(window_filter, "associate_cycle", scored)
    monkeypatch.setattr(divergence_monitor, "jump", lambda *_: np.array([1.2, 0.0, 0.0]))
    assert divergence_monitor.log_jump() < divergence_monitor.log_another_wall()
    _, info = step(state, heard, None, 0.1, heading, config, rng=np.random.default_rng(0))
    assert (info.cause == LossCause.JUMP) == jumps


@pytest.mark.parametrize("by", [[0.35, 0.35, 0.0], [0.5, 0.0, 0.0]])
def test_a_jump_among_walls_is_landed_from(by):
    """No wall that stays put explains it: of the others all would have to be silent. The second is found by a second
    step alone, as the first is centimetres off."""
    states, _, _, place, _ = _lead(25, 4, np.array(by))
    for state, true in zip(states, place, strict=True):
        np.testing.assert_allclose(estimate(state, CONFIG).position, true, atol=0.01)
