"""Halts, starting and stopping, and headings along waypoints, held to the closed forms of a trapezoidal speed."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import SceneError
from rislam_rt.model import Body, Trajectory
from rislam_rt.scene import check_scene, load_scene
from rislam_rt.scene.motion.agent_motion import travel
from rislam_rt.scene.motion.waypoints import round_corners

CYCLE = 0.01
LINE = "waypoints = [[1.0, 1.0, 0.5], [4.0, 1.0, 0.5]]\n"
CORNER = "waypoints = [[1.0, 1.0, 0.5], [4.0, 1.0, 0.5], [4.0, 3.0, 0.5]]\n"
BACK = "waypoints = [[1.0, 1.0, 0.5], [4.0, 1.0, 0.5], [1.0, 1.0, 0.5]]\n"


@pytest.fixture
def folder(damaged: Callable[[str, str], Path]) -> Callable[[str], Path]:
    """The folder of the paper's room with another motion."""

    def _folder(motion: str) -> Path:
        damaged("start = [0.5, 0.7, 0.5]\n", "")
        damaged("cycles = 600\ncycle_s = 0.1\n", f"cycle_s = {CYCLE}\n" if "cycle_s" not in motion else "")
        return damaged("velocity = [0.0707, 0.0707, 0.0]", motion)

    return _folder


@pytest.fixture
def moved(folder: Callable[[str], Path]) -> Callable[[str], Trajectory]:
    """The agent's trajectory with another motion."""
    return lambda motion: load_scene(folder(motion)).agent


def speed_of(agent: Trajectory) -> np.ndarray:
    return np.asarray(np.linalg.norm(agent.velocity, axis=1))


def push_of(agent: Trajectory) -> np.ndarray:
    """Acceleration (K - 1,) [m/s^2] by differences."""
    return np.asarray(np.linalg.norm(np.diff(agent.velocity, axis=0), axis=1) / CYCLE)


@pytest.mark.parametrize(
    ("speed", "acceleration", "takes", "peak"),
    [
        (0.5, 0.25, 3.0 / 0.5 + 0.5 / 0.25, 0.5),  # a trapezoid: L / v + v / a
        (2.0, 0.5, 2.0 * np.sqrt(3.0 / 0.5), np.sqrt(3.0 * 0.5)),  # too short for its speed: a triangle
    ],
)
def test_a_leg_from_rest_to_rest_takes_the_time_of_its_trapezoid(
    moved: Callable[[str], Trajectory], speed: float, acceleration: float, takes: float, peak: float
) -> None:
    agent = moved(f"{LINE}speed_m_s = {speed}\nacceleration_m_s2 = {acceleration}\nfrom_rest = true")
    assert len(agent) == int(takes / CYCLE + 1e-9) + 1
    t = agent.time
    ramp = peak / acceleration
    want = np.minimum(peak, acceleration * np.minimum(t, takes - t))
    np.testing.assert_allclose(speed_of(agent), want, rtol=0, atol=1e-12)
    early, late = t < ramp, t > takes - ramp
    gone = np.where(early, 0.5 * acceleration * t**2, peak * (t - 0.5 * ramp))
    gone = np.where(late, 3.0 - 0.5 * acceleration * (takes - t) ** 2, gone)
    np.testing.assert_allclose(agent.position[:, 0] - 1.0, gone, rtol=0, atol=1e-12)
    assert push_of(agent).max() == pytest.approx(acceleration, rel=1e-9)
    assert not agent.heading.any()


def test_a_halt_stands_still_for_its_seconds_and_turns_the_whole_time(moved: Callable[[str], Trajectory]) -> None:
    agent = moved(CORNER + "speed_m_s = 0.5\nacceleration_m_s2 = 0.25\nhalt_s = [1.0, 4.0, 2.0]")
    arrives, leaves = 1.0 + 8.0, 1.0 + 8.0 + 4.0  # legs of 3 m and 2 m take 8 s and 6 s
    assert agent.time[-1] == pytest.approx(leaves + 6.0 + 2.0, abs=1e-9)
    t, speed = agent.time, speed_of(agent)
    for begin, end, place in ((0.0, 1.0, [1, 1]), (arrives, leaves, [4, 1]), (leaves + 6.0, 99.0, [4, 3])):
        stands = (t > begin - 1e-9) & (t < end + 1e-9)
        np.testing.assert_allclose(agent.position[stands], np.tile([*place, 0.5], (stands.sum(), 1)), atol=1e-12)
        np.testing.assert_allclose(speed[stands], 0.0, rtol=0, atol=1e-9)
        assert (speed[~stands] < 0.5 + 1e-12).all()
    assert (speed > 1e-9).sum() == pytest.approx(14.0 / CYCLE, abs=3)
    assert push_of(agent).max() <= 0.25 * (1 + 1e-9)
    want = np.pi / 2 * np.clip((t - arrives) / 4.0, 0.0, 1.0)
    np.testing.assert_allclose(agent.heading, want, rtol=0, atol=1e-9)


def test_velocities_are_the_derivative_of_positions(moved: Callable[[str], Trajectory]) -> None:
    """Through ramps, halts and an arc: central differences of a cubic at most, but for kinks of one cycle."""
    way = "waypoints = [[1.0, 1.0, 0.5], [2.5, 1.0, 0.5], [4.0, 1.0, 1.0], [4.0, 3.0, 1.0], [2.0, 4.0, 0.6]]\n"
    agent = moved(way + "speed_m_s = 0.5\nacceleration_m_s2 = 0.5\nhalt_s = [0.0, 1.5, 0.0, 2.0, 0.0]")
    slope = (agent.position[2:] - agent.position[:-2]) / (2.0 * CYCLE)
    np.testing.assert_allclose(slope, agent.velocity[1:-1], rtol=0, atol=0.5 * CYCLE)
    # an arc at full speed has the acceleration across, a ramp along: nowhere more than both together
    assert push_of(agent).max() <= 0.5 * np.sqrt(2.0) * (1 + 1e-3)


def test_turns_on_the_spot_have_their_rate_and_end_with_the_halt(moved: Callable[[str], Trajectory]) -> None:
    agent = moved(BACK + "speed_m_s = 0.5\nacceleration_m_s2 = 0.25\nhalt_s = [0.0, 5.0, 0.0]\nturn_deg_s = 45")
    t, leaves = agent.time, 8.0 + 5.0
    want = np.pi * np.clip((t - leaves + 4.0) / 4.0, 0.0, 1.0)  # half a turn goes to the left
    np.testing.assert_allclose(np.cos(agent.heading - want), 1.0, rtol=0, atol=1e-12)
    rate = np.diff(np.unwrap(agent.heading)) / CYCLE
    assert np.abs(rate).max() == pytest.approx(np.pi / 4, rel=1e-9)
    assert speed_of(agent)[np.append(np.abs(rate) > 1e-6, False)].max() < 1e-9
    assert np.abs(agent.heading).max() <= np.pi


def test_a_lift_keeps_its_heading_until_the_way_is_level_again(moved: Callable[[str], Trajectory]) -> None:
    way = "waypoints = [[1.0, 1.0, 0.5], [2.0, 1.0, 0.5], [2.0, 1.0, 2.0], [2.0, 0.5, 2.0]]\n"
    agent = moved(way + "speed_m_s = 0.5\nhalt_s = [0.0, 1.0, 2.0, 0.0]\nturn_deg_s = 90")
    rises = (agent.velocity[:, 2] > 0.0).nonzero()[0]
    assert not agent.heading[: rises[-1] + 1].any()
    assert agent.heading[-1] == pytest.approx(-np.pi / 2)
    assert np.abs(np.diff(agent.heading)).max() == pytest.approx(np.pi / 2 * CYCLE, rel=1e-6)


@pytest.mark.parametrize("rest", ["", "from_rest = true\n", "halt_s = [0, 1.0, 0]\n"])
def test_a_fixed_heading_is_kept_whatever_the_motion(moved: Callable[[str], Trajectory], rest: str) -> None:
    agent = moved(f"{CORNER}speed_m_s = 0.3\n{rest}heading_deg = -30.0")
    assert (agent.heading == np.radians(-30.0)).all()


def test_halts_at_the_ends_and_passing_without_rest(moved: Callable[[str], Trajectory]) -> None:
    agent = moved(CORNER + "speed_m_s = 0.5\nacceleration_m_s2 = 0.25\nhalt_s = [0, 2.0, 0]\nfrom_rest = false")
    assert speed_of(agent)[0] == speed_of(agent)[-1] == 0.5
    # each leg has one ramp: L / v + v / 2 a
    assert agent.time[-1] == pytest.approx(7.0 + 2.0 + 5.0, abs=1e-9)


def test_files_without_the_new_keys_move_as_ever(moved: Callable[[str], Trajectory]) -> None:
    agent = moved(CORNER + "speed_m_s = 0.5\nacceleration_m_s2 = 0.4\ncycles = 700\ncycle_s = 0.01")
    way = round_corners(np.array([[1.0, 1.0, 0.5], [4.0, 1.0, 0.5], [4.0, 3.0, 0.5]]), 0.5**2 / 0.4)
    place, along = way.at(0.5 * (np.arange(700) * 0.01))
    assert np.array_equal(agent.position, place)
    assert np.array_equal(agent.velocity, 0.5 * along)
    assert np.array_equal(agent.heading, np.arctan2(along[:, 1], along[:, 0]))
    assert np.array_equal(travel(way, 0.5, 0.01, 700, Body()).position, place)


def test_no_halt_and_no_rest_are_the_constant_speed(moved: Callable[[str], Trajectory]) -> None:
    agent = moved(CORNER + "speed_m_s = 0.5\nacceleration_m_s2 = 0.4\nhalt_s = [0, 0, 0]\nfrom_rest = false")
    way = round_corners(np.array([[1.0, 1.0, 0.5], [4.0, 1.0, 0.5], [4.0, 3.0, 0.5]]), 0.5**2 / 0.4)
    plain = travel(way, 0.5, CYCLE, None, Body())
    np.testing.assert_allclose(agent.position, plain.position, rtol=0, atol=1e-12)


def test_a_room_with_halts_passes_its_check(folder: Callable[[str], Path]) -> None:
    motion = CORNER + "speed_m_s = 0.4\nhalt_s = [1.0, 2.0, 1.0]\nturn_deg_s = 90\ncycle_s = 0.1"
    findings = check_scene(folder(motion))
    assert not [finding.line for finding in findings if finding.field.startswith("agent")]


@pytest.mark.parametrize(
    ("motion", "says"),
    [
        (CORNER + "halt_s = [1.0]", "agent: 'halt_s' has 1 number for 3 waypoints; give one for each, 0 where"),
        (CORNER + "halt_s = 2.0", "agent.halt_s: 2.0 received; give a list, halt_s = [2.0]"),
        (CORNER + "halt_s = [0, 2e5, 0]", "agent.halt_s[1]: 200000.0 received; give at most 100000 s"),
        (CORNER + "halt_s = [0, -1.0, 0]", "agent.halt_s[1]: -1.0 received; give at least 0 s"),
        (CORNER + "halt_s = [0, inf, 0]", "agent.halt_s[1]: inf received; give a finite number"),
        (CORNER + 'from_rest = "yes"', "agent.from_rest: 'yes' received; give true or false"),
        (CORNER + "heading = 0.5", "agent.heading: unknown key; did you mean 'heading_deg'?"),
        (CORNER + "heading_deg = 400", "agent.heading_deg: 400 received; give at most 360 degrees"),
        (CORNER + "turn_deg_s = 0", "agent.turn_deg_s: 0 received; give more than 0 degrees/s"),
        (CORNER + "halt_s = [0, 1, 0]\nturn_deg_s = 9\nheading_deg = 1", "with the fixed 'heading_deg'; leave one"),
        (
            CORNER + "halt_s = [0, 1, 0]\nturn_deg_s = 45",
            "agent.halt_s[1]: 1 s, and the turn of 90 degrees there takes 2 s; halt longer, or raise agent.turn_deg_s",
        ),
        (CORNER + "halt_s = [0, 1, 0]\ncycles = 9999", "9999 cycles wanted, the way of 5 m ends after"),
        (CORNER + "halt_s = [1, 1e5, 1]\ncycle_s = 0.001", "the way of 5 m takes 1000"),
        (
            "waypoints = [[1, 1, 1], [2, 1, 1], [4, 1, 1], [1, 1, 1]]\nhalt_s = [0, 1, 0, 0]",
            "turns back by 180 degrees at waypoint 2 (the first is 0); give a way round (up to 170 degrees at",
        ),
        (
            "waypoints = [[1, 1, 1], [2, 1, 1], [2, 2, 1], [2.2, 2, 1], [2.2, 1, 1]]\nhalt_s = [0, 1, 0, 0, 0]",
            "0.2 m from waypoint 2 to 3 (the first is 0), of which the arcs at both take 1 m (radius 0.5 m, speed "
            "squared over acceleration); halt at 2 and 3 (agent.halt_s, one number of seconds for each waypoint)",
        ),
        (
            "waypoints = [[1, 1, 1], [2, 1, 1], [2, 1.3, 1], [4, 1.3, 1]]\nhalt_s = [0, 1, 0, 0]",
            "0.3 m from waypoint 1 to 2 (the first is 0), of which the arc at waypoint 2 takes 0.5 m (radius 0.5 m, "
            "speed squared over acceleration); halt at 2 (agent.halt_s",
        ),
    ],
)
def test_bad_halts_and_headings_are_one_line(folder: Callable[[str], Path], motion: str, says: str) -> None:
    with pytest.raises(SceneError) as caught:
        load_scene(folder(f"speed_m_s = 0.5\n{motion}"))
    (line,) = caught.value.lines
    assert says in line
    assert "scene.toml: agent" in line


@pytest.mark.parametrize("halts", ["", "halt_s = [1, 0, 1]\n"])
def test_a_turn_without_a_halt_is_a_warning_and_changes_nothing(folder: Callable[[str], Path], halts: str) -> None:
    room = folder(f"speed_m_s = 0.5\n{CORNER}{halts}turn_deg_s = 90")
    (said,) = [finding for finding in check_scene(room) if finding.field == "agent.turn_deg_s"]
    assert said.severity == "warning"
    assert "changes nothing without a halt between the ends" in said.line
    turned, file = load_scene(room).agent, room / "scene.toml"
    file.write_text(file.read_text().replace("turn_deg_s = 90", ""))
    plain = load_scene(room).agent
    assert not [finding for finding in check_scene(room) if finding.field == "agent.turn_deg_s"]
    np.testing.assert_array_equal(turned.position, plain.position)
    np.testing.assert_array_equal(turned.heading, plain.heading)


@pytest.mark.parametrize("key", ["halt_s = [1, 1]", "from_rest = true", "heading_deg = 5", "turn_deg_s = 5"])
def test_other_motions_have_no_halts_and_no_heading(damaged: Callable[[str, str], Path], key: str) -> None:
    room = damaged("cycles = 600\n", f"cycles = 600\n{key}\n")
    name = key.partition(" ")[0]
    with pytest.raises(SceneError, match=f"agent: '{name}' means nothing with 'velocity'; leave it out, or give 'way"):
        load_scene(room)
