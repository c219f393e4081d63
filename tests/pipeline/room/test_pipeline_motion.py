"""The true motion: white acceleration of the size asked for, inside the room, from the run's own seed."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import ConfigError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.room.true_motion import CLEARANCE, draw_looks, draw_motion, draw_walks
from rislam_rt.pipeline.run import cut_scene, prepare_setup
from rislam_rt.pipeline.specification.pipeline_spec import build_settings

PIPELINE = Path(__file__).parents[3] / "pipelines" / "trace_then_slam.toml"


def test_no_acceleration_leaves_the_trajectory_as_it_is(room):
    assert draw_motion(room, 0.0, rng=np.random.default_rng(0)) is room.agent


def test_steps_are_those_of_white_acceleration():
    """`x_k+1 - x_k - v_k dt = a dt^2 / 2` and `v_k+1 - v_k = a dt`, with one and the same `a` of the size asked for."""
    time = np.array([0.0, 0.1, 0.2, 0.5, 0.6])
    dt = np.diff(time)[:, None]
    shift, speed = draw_walks(time, 0.3, 20_000, rng=np.random.default_rng(1))
    pushed = np.diff(speed, axis=1) / dt
    np.testing.assert_allclose(np.diff(shift, axis=1) - speed[:, :-1] * dt, 0.5 * pushed * dt**2, atol=1e-12)
    # 160 000 independent normal numbers: their standard deviation has a relative error of 1/sqrt(2 n) = 0.18 %
    assert pushed.std() == pytest.approx(0.3, rel=0.01)
    assert abs(np.corrcoef(pushed[:, 0, 0], pushed[:, 1, 0])[0, 1]) < 5.0 / np.sqrt(20_000)
    assert not shift[:, 0].any()
    assert not speed[:, 0].any()


def test_motion_stays_inside_and_keeps_heading_and_height(room):
    walls = build_walls(room)
    for seed in range(3):
        motion = draw_motion(room, 0.05, rng=np.random.default_rng(seed))
        assert distance_to_triangles(motion.position, walls.triangles).min() >= CLEARANCE - 1e-9
        np.testing.assert_array_equal(motion.heading, room.agent.heading)
        np.testing.assert_array_equal(motion.position[:, 2], room.agent.position[:, 2])
        np.testing.assert_array_equal(motion.position[0], room.agent.position[0])
        assert np.abs(motion.position - room.agent.position).max() > 0.1
        moved = np.diff(motion.position, axis=0) / np.diff(motion.time)[:, None]
        np.testing.assert_allclose(moved, 0.5 * (motion.velocity[1:] + motion.velocity[:-1]), atol=1e-9)


def test_looks_turn_the_body_and_not_its_way(room):
    assert draw_looks(room.agent, 0.0, rng=np.random.default_rng(0)) is room.agent
    looks = [draw_looks(room.agent, 0.3, rng=np.random.default_rng(seed)) for seed in range(300)]
    off = np.array([look.heading - room.agent.heading for look in looks])
    # 300 draws of three phases: the mean square over them is known to about 1/sqrt(300) of itself
    assert np.sqrt(np.mean(off**2)) == pytest.approx(0.3, rel=0.05)
    assert np.abs(np.diff(off, axis=1) / np.diff(room.agent.time)).max() < 0.3 * np.sqrt(6.0) * 2.0 * np.pi / 3.0
    np.testing.assert_array_equal(looks[0].position, room.agent.position)
    np.testing.assert_array_equal(looks[0].velocity, room.agent.velocity)


@pytest.mark.slow
def test_too_much_acceleration_for_the_room_is_refused(room):
    with pytest.raises(ConfigError, match="sigma_a_m_s2: 1000 received"):
        draw_motion(room, 1000.0, rng=np.random.default_rng(0))


def test_every_seed_has_a_motion_of_its_own_and_keeps_it(room):
    spec = load_spec(PIPELINE, ["channel=image_source", "cycles=20", "depth=0", "motion.sigma_a_m_s2=0.1"])
    one, again, other = (prepare_setup(room, spec, rng=np.random.default_rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.scene.agent.position, again.scene.agent.position)
    np.testing.assert_array_equal(one.paths.tau, again.paths.tau)
    assert (one.scene.agent.position != other.scene.agent.position).any()
    looked = load_spec(PIPELINE, ["channel=image_source", "cycles=20", "depth=0", "motion.look_std_deg=20"])
    turned = prepare_setup(room, looked, rng=np.random.default_rng(1)).scene.agent.heading
    assert np.abs(turned - cut_scene(room, 20).agent.heading).max() > np.radians(1.0)
    still = prepare_setup(
        room, spec.model_copy(update={"motion": load_spec(PIPELINE).motion}), rng=np.random.default_rng(1)
    )
    np.testing.assert_array_equal(still.scene.agent.position, cut_scene(room, 20).agent.position)


def test_estimators_are_told_the_acceleration_unless_the_file_says_otherwise():
    told = build_settings(load_spec(PIPELINE, ["motion.sigma_a_m_s2=0.1"]))
    assert (told.slam.sigma_a, told.bp_slam.sigma_a) == (0.1, 0.1)
    own = build_settings(load_spec(PIPELINE, ["motion.sigma_a_m_s2=0.1", "slam.sigma_a=0.2", "bp_slam.sigma_a=0.3"]))
    assert (own.slam.sigma_a, own.bp_slam.sigma_a) == (0.2, 0.3)
    plain = build_settings(load_spec(PIPELINE, ["slam.height=estimated"]))
    assert (plain.slam.sigma_a, plain.bp_slam.sigma_a, plain.bp_slam.height) == (0.01, 0.01, "estimated")
