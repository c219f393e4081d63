"""Motion from CSV files, waypoints and random walks, and recordings whose clock is not the cycle's."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import SceneError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.model import Scene
from rislam_rt.scene import load_scene
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.meshes import ply_bytes
from rislam_rt.scene.motion.agent_motion import at_cycles
from rislam_rt.scene.motion.random_walk import draw_walk
from rislam_rt.scene.motion.recorded_poses import RecordedPoses, parse_csv
from rislam_rt.scene.motion.waypoints import along_heading, round_corners
from rislam_rt.scene.shapes import block

EPOCH = 1_700_000_000.0
CSV = "stamp_ns,px_mm,py_mm,pz_mm,yaw_deg,note\n"
CSV += "".join(f"{int(1e8) * k},{500 + 10 * k},700,500,{k},x\n" for k in range(5))


@pytest.fixture
def moved(damaged: Callable[[str, str], Path]) -> Callable[..., Scene]:
    """The paper's room with another motion."""

    def _moved(motion: str, **files: str) -> Scene:
        damaged("start = [0.5, 0.7, 0.5]\n", "")
        damaged("cycles = 600\ncycle_s = 0.1\n", "")
        room = damaged("velocity = [0.0707, 0.0707, 0.0]", motion)
        for name, content in files.items():
            (room / name.replace("_", ".")).write_text(content)
        return load_scene(room)

    return _moved


@pytest.mark.parametrize(
    ("motion", "key"),
    [
        ("start = [3, 3, 0.5]\nvelocity = [0.1, 0, 0]\ncycles = 3\ncycle_s = 0.1", r"agent\.start"),
        ("waypoints = [[3, 3, 0.5], [3.2, 3, 0.6]]\nspeed_m_s = 0.1\ncycle_s = 0.1", r"agent\.waypoints\[0\]"),
        ('trajectory = "walk.tum"', r"agent\.trajectory"),
    ],
)
def test_a_bad_start_is_told_by_the_key_that_gives_it(
    moved: Callable[..., Scene], damaged: Callable[[str, str], Path], motion: str, key: str
) -> None:
    tum = "".join(f"{0.1 * k} {3 + 0.01 * k} 3 0.5 0 0 0 1\n" for k in range(3))
    room = damaged("[ris]", '[[reflector]]\nname = "table"\nmesh = "table.ply"\nmaterial.reflection = 0.9\n\n[ris]')
    (room / "table.ply").write_bytes(ply_bytes(*block([2.5, 2.5, 0.2], [3.5, 3.5, 0.8])))
    with pytest.raises(SceneError, match=rf"scene\.toml: {key}: \[3\.0, 3\.0, 0\.5\] lies inside the object 'table'"):
        moved(motion, walk_tum=tum)
    (room / "table.ply").write_bytes(ply_bytes(*block([2.5, 2.5, 0.2], [3.5, 3.5, 0.5])))
    with pytest.raises(SceneError, match=rf"scene\.toml: {key}: agent at .* lies on 'table'"):
        load_scene(room)


def test_a_csv_file_says_what_its_columns_are(moved: Callable[..., Scene]) -> None:
    columns = '{ time = "stamp_ns", x = "px_mm", y = "py_mm", z = "pz_mm", heading = "yaw_deg" }'
    agent = moved(f'trajectory = "way.csv"\ncolumns = {columns}', way_csv=CSV).agent
    np.testing.assert_allclose(agent.time, 0.1 * np.arange(5), rtol=0, atol=1e-15)
    np.testing.assert_allclose(agent.position, [[0.5 + 0.01 * k, 0.7, 0.5] for k in range(5)], rtol=0, atol=1e-15)
    np.testing.assert_allclose(agent.heading, np.radians(np.arange(5)), rtol=0, atol=1e-15)
    np.testing.assert_allclose(agent.velocity, np.tile([0.1, 0.0, 0.0], (5, 1)), rtol=0, atol=1e-12)


def test_usual_names_need_no_naming_and_a_heading_follows_the_way() -> None:
    found = parse_csv(b"timestamp, X, y, z, extra\n0,0,0,1,a\n0.1,0,1,1,\n\n", {})
    assert found.heading is None
    assert found.position.tolist() == [[0, 0, 1], [0, 1, 1]]
    turned = parse_csv(b"t_ms,x_cm,y_cm,z_cm,qx,qy,qz,qw\n0,100,0,0,0,0,0.70710678,0.70710678\n", {})
    assert turned.heading is not None
    assert turned.heading[0] == pytest.approx(np.pi / 2)
    assert turned.position[0, 0] == 1.0
    courses = np.array([[0.0, 0, 1], [0, 2, 0], [0, 0, 0], [-1, 0, 0]])
    np.testing.assert_allclose(along_heading(courses), [np.pi / 2, np.pi / 2, np.pi / 2, np.pi])
    still = np.array([[1e-17, 0, 0], [0.3, 0, 0], [-1e-17, 1e-17, 0], [0, 1e-16, 0], [0, 0.3, 0]])  # rounding at a stop
    np.testing.assert_allclose(along_heading(still), [0.0, 0.0, 0.0, 0.0, np.pi / 2])
    assert not along_heading(np.zeros((3, 3))).any()


@pytest.mark.parametrize(
    ("content", "named", "says"),
    [
        ("t,x,y\n0,1,2\n", {}, "no column 'z' in the trajectory; name it in agent.columns"),
        ("t,x,y,z\n0,1,2,3\n", {"heading": "yaw"}, "no column 'yaw' for 'heading' in the trajectory; it has 't', 'x'"),
        ("t,x,y,z\n0,1,2,a\n", {}, "line 2 of the trajectory is not 4 finite numbers"),
        ("t,x,y,z\n0,1,2\n", {}, "line 2 of the trajectory is not 4 finite numbers"),
        ("t,x,y,z\n0,1,2,3\n0,1,2,3\n", {}, "time does not grow at pose 1"),
        ("t,x,y,z\n", {}, "holds no pose"),
        ("", {}, "does not begin with column names; give 'time,x,y,z'"),
        ("\ntime,x,y,z\n0,1,2,3\n", {}, "does not begin with column names"),
        ("time;x;y;z\n0,1;1;2;3\n", {}, "semicolons between the columns of the trajectory; separate columns by commas"),
        ("time\tx\ty\tz\n0\t1\t2\t3\n", {}, "tabs between the columns"),
        ("# my walk\ntime,x,y,z\n0,1,2,3\n", {}, "no column 'time' in the trajectory"),
        ("t,x,y,z\n0,0,0,5,1,0,0,7\n", {}, "line 2 of the trajectory has 8 entries for 4 columns; separate columns by"),
        ("t,x,y,z\n0,1,2,2024-01-01\n", {}, "not 4 finite numbers (0, 1, 2, 2024-01-01)"),
        ("t,x,y,z\n0,1,2,3\0\n", {}, "is not text in UTF-8; save it as CSV in UTF-8"),
        ('t,x,y,z\n0,1,2,"' + "3" * 200_000, {}, "is no CSV file (field larger than field limit"),
    ],
)
def test_a_bad_csv_file_is_one_line(content: str, named: dict[str, str], says: str) -> None:
    with pytest.raises(Fault, match=r".") as caught:
        parse_csv(content.encode(), named)
    assert says in str(caught.value)


@pytest.mark.parametrize("since", [0.0, EPOCH])
def test_a_recording_of_another_clock_is_interpolated_to_the_cycle(since: float) -> None:
    rng = np.random.default_rng(3)
    time = np.sort(rng.uniform(0.0, 10.0, 400))
    time[0], time[-1] = 0.0, 10.0
    place = np.column_stack([np.cos(time), np.sin(time), np.full(400, 0.5)])
    even = at_cycles(RecordedPoses(since + time, place, time + np.pi / 2), 0.1)
    assert len(even.time) == 101
    np.testing.assert_allclose(np.diff(even.time), 0.1, rtol=0, atol=5e-7 if since else 1e-12)  # float64 at the epoch
    t = 0.1 * np.arange(101)
    # a monotone cubic between poses 0.2 s apart at most: a hundredth of the square of that, times the curvature
    assert np.diff(time).max() < 0.2
    np.testing.assert_allclose(even.position[:, :2], np.column_stack([np.cos(t), np.sin(t)]), rtol=0, atol=2e-3)
    assert even.heading is not None
    np.testing.assert_allclose(even.heading, t + np.pi / 2, rtol=0, atol=1e-6)  # the epoch's float64 in time


def test_angles_are_interpolated_the_short_way_and_gaps_are_refused() -> None:
    poses = np.zeros((2, 3))
    turn = at_cycles(RecordedPoses(np.array([0.0, 1.0]), poses, np.array([3.0, -3.0])), 0.5).heading
    assert turn is not None
    assert turn[1] == pytest.approx(np.pi)
    with pytest.raises(Fault, match=r"7 s without a pose after pose 1.*cut the file"):
        at_cycles(RecordedPoses(np.array([0.0, 0.1, 7.1]), np.zeros((3, 3)), None), 0.1)


def test_steps_that_are_the_cycle_up_to_the_stamps_last_digit_are_kept(moved: Callable[..., Scene]) -> None:
    lines = [f"{EPOCH + 0.1 * k:.6f} {0.5 + 0.01 * k} 0.7 0.5 0 0 0 1" for k in range(4)]
    agent = moved('trajectory = "way.tum"\ncycle_s = 0.1', way_tum="\n".join(lines)).agent
    assert agent.position[:, 0].tolist() == [0.5, 0.51, 0.52, 0.53]
    assert agent.time[0] == EPOCH


def test_a_way_along_waypoints_keeps_speed_and_acceleration(moved: Callable[..., Scene]) -> None:
    motion = "waypoints = [[1.0, 1.0, 0.5], [4.0, 1.0, 0.5], [4.0, 3.0, 1.0], [1.5, 4.5, 1.0]]\n"
    agent = moved(motion + "speed_m_s = 0.5\nacceleration_m_s2 = 0.4\ncycle_s = 0.01").agent
    assert agent.position[0].tolist() == [1.0, 1.0, 0.5]
    assert np.linalg.norm(agent.position[-1] - [1.5, 4.5, 1.0]) < 0.5 * 0.01
    np.testing.assert_allclose(np.linalg.norm(agent.velocity, axis=1), 0.5, rtol=0, atol=1e-12)
    # chords on arcs of radius 0.625 m are short by (s / r)^2 / 24 of themselves
    np.testing.assert_allclose(np.linalg.norm(np.diff(agent.position, axis=0), axis=1), 0.005, rtol=3e-6)
    push = np.linalg.norm(np.diff(agent.velocity, axis=0), axis=1) / 0.01
    assert push.max() == pytest.approx(0.4, rel=1e-4)
    assert (push < 1e-9).sum() > 100
    np.testing.assert_allclose(agent.heading, np.arctan2(agent.velocity[:, 1], agent.velocity[:, 0]))
    # what a corner cuts off: the arc stays this far from the waypoint
    turn = np.pi / 2
    assert np.linalg.norm(agent.position[:, :2] - [4.0, 1.0], axis=1).min() < 0.625 * (1 / np.cos(turn / 2) - 1) + 5e-3


def test_a_way_without_corners_is_its_leg() -> None:
    way = round_corners(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0]]), 0.5)
    assert way.total == pytest.approx(3.0)
    place, along = way.at(np.array([0.0, 1.0, 2.5]))
    np.testing.assert_allclose(place[:, 0], [0.0, 1.0, 2.5])
    np.testing.assert_allclose(along, np.tile([1.0, 0.0, 0.0], (3, 1)))


def test_a_random_walk_keeps_clear_and_is_its_seeds(moved: Callable[..., Scene]) -> None:
    walk = "start = [1.0, 1.0, 0.8]\nrandom_walk = { seed = 5, clearance_m = 0.6 }\nspeed_m_s = 0.4\n"
    scene = moved(walk + "cycles = 300\ncycle_s = 0.1")
    agent = scene.agent
    triangles = np.concatenate([wall.triangles for wall in scene.reflectors])
    assert distance_to_triangles(agent.position, triangles).min() >= 0.6
    np.testing.assert_allclose(np.linalg.norm(agent.velocity, axis=1), 0.4, rtol=0, atol=1e-12)
    assert np.ptp(agent.position[:, 2]) == 0.0
    assert np.linalg.norm(np.diff(agent.velocity, axis=0), axis=1).max() / 0.1 < 0.5 * (1 + 1e-9)
    first, same, other = (
        draw_walk(agent.position[0], 9.0, 0.3, 0.6, triangles, rng=np.random.default_rng(seed)) for seed in (5, 5, 6)
    )
    assert np.array_equal(first.start, same.start)
    assert not np.array_equal(first.along[0], other.along[0])


@pytest.mark.parametrize(
    ("motion", "says"),
    [
        ("waypoints = [[1.0, 1.0, 0.5], [2.0, 1.0, 0.5]]\ncycle_s = 0.1", "'waypoints' needs 'speed_m_s' beside it"),
        (
            "waypoints = [[1.0, 1, 1], [3.0, 1, 0.0]]\nspeed_m_s = 0.5\ncycle_s = 0.1",
            "agent.waypoints[1]: [3.0, 1.0, 0.0] lies on a surface; keep 1 mm away",
        ),
        (
            "waypoints = [[1.0, 1, 1], [3, 1, 1]]\nspeed_m_s = 0.5\ncycle_s = 0.1\nhalt_s = [0, 2]\nfrom_rest = false",
            "'halt_s' halts at an end, and 'from_rest = false' moves there; give 0, or leave that out",
        ),
        (
            "trajectory = 'way.csv'\ncolumns = { x = 'y', y = 'y' }",
            "column 'y' of the trajectory is named for 'x' and 'y'; give each",
        ),
        ("waypoints = [[1.0, 1.0, 0.5]]\nspeed_m_s = 1.0\ncycle_s = 0.1", "at least 2 items"),
        ("waypoints = [[1.0, 1.0, 0.5], [1.0, 1.0, 0.5]]\nspeed_m_s = 1.0\ncycle_s = 0.1", "are the same point"),
        ("waypoints = [[1.0, 1, 1], [3.0, 1, 1], [1.0, 1, 1]]\nspeed_m_s = 0.1\ncycle_s = 0.1", "turns back by 180"),
        ("waypoints = [[1.0, 1, 1], [2.0, 1, 1], [2.0, 1.2, 1]]\nspeed_m_s = 0.5\ncycle_s = 0.1", "lower agent.speed"),
        (
            "waypoints = [[1.0, 1, 1], [2.0, 1, 1]]\nspeed_m_s = 0.5\ncycle_s = 0.1\ncycles = 99",
            "99 cycles wanted, the way of 1 m ends after 21",
        ),
        ("random_walk = { seed = 1 }\nspeed_m_s = 0.1\ncycles = 9\ncycle_s = 0.1", "'random_walk' needs 'start'"),
        (
            "start = [0.5, 0.5, 0.2]\nrandom_walk = { seed = 1 }\nspeed_m_s = 0.1\ncycles = 9\ncycle_s = 0.1",
            "the start is 0.2 m from a surface",
        ),
        (
            "start = [3.0, 3.0, 1.5]\nrandom_walk = { seed = 1, clearance_m = 1.4 }\nspeed_m_s = 5.0\n"
            "cycles = 99\ncycle_s = 0.1",
            "no way of 49 m found that stays 1.4 m from all surfaces",
        ),
        ('trajectory = "a.tum"\nspeed_m_s = 1.0', "'speed_m_s' means nothing with 'trajectory'"),
        ('trajectory = "a.csv"\ncolumns = { speed = "v" }', "'speed' is none of time, x"),
        ('trajectory = "a.csv"\nvelocity = [0.1, 0.0, 0.0]', "'velocity' and 'trajectory' given; give one of"),
        ('trajectory = "way.tum"\ncycles = 9', "'way.tum'"),
        ('trajectory = "bad.tum"', "agent.trajectory: 'bad.tum': line 1 of the trajectory is not eight finite numbers"),
        ('trajectory = "way.tum"\ncolumns = { x = "v" }', "is no CSV file, and agent.columns is given"),
    ],
)
def test_a_bad_motion_is_one_line(moved: Callable[..., Scene], motion: str, says: str) -> None:
    with pytest.raises(SceneError) as caught:
        moved(motion, way_tum="0 1 1 1 0 0 0 1\n", bad_tum="0 1\n", way_csv=CSV)
    assert says in str(caught.value)


def test_what_to_do_about_a_bad_motion_is_said_once(moved: Callable[..., Scene]) -> None:
    with pytest.raises(SceneError, match=r"means nothing with 'trajectory'; leave it out$"):
        moved('trajectory = "a.tum"\nspeed_m_s = 1.0')
