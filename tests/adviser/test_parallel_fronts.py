"""A board before a wall is named if both are heard along the way, as nothing else is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.adviser.link_budget import survey
from rislam_rt.adviser.return_warnings import LEAST, SWERVE, parallel_front_warnings, return_warnings
from rislam_rt.model import Reflector
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
WALL = 4.0


def way(x, y):
    """Places (15, 3) [m] of the agent's way, at 1.1 m."""
    return np.column_stack(np.broadcast_arrays(np.atleast_1d(x), np.atleast_1d(y), 1.1))


ALONG = way(np.linspace(1.0, 1.6, 15), 2.3)


def looked(*boards, place=ALONG, turned=0.0, changed=()):
    """Survey of the empty box with boards from x to x at y [m], 1.2 m high, `turned` [rad] about their upper edge."""
    scene = load_scene(ROOT / "scenes" / "empty_box")
    agent = replace(scene.agent[:15], position=place, heading=np.zeros(15))
    meshes = []
    for number, (left, right, across) in enumerate(boards):
        low = across - 1.2 * turned
        corners = np.array([[left, low, 0.5], [right, low, 0.5], [right, across, 1.7], [left, across, 1.7]])
        faces = np.array([[0, 1, 2], [0, 2, 3]])
        meshes.append(Reflector(f"board{number}", corners, faces, scene.reflectors[0].material))
    settings = build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml", changed))
    return survey(replace(scene, agent=agent, reflectors=(*scene.reflectors, *meshes)), settings)


def lines(found):
    return [finding.line for finding in parallel_front_warnings(found, "scene.toml")]


@pytest.mark.parametrize("gap", [0.015, 0.12])
def test_a_board_before_a_wall_is_named(gap):
    found = looked((1.3, 2.1, WALL - gap))
    (line,) = lines(found)
    assert line.startswith(f"scene.toml: reflector: 'board0' stands {1e3 * gap:.0f} mm before 'wall_y4', and both are")
    assert line in [finding.line for finding in return_warnings(found, "scene.toml")]


@pytest.mark.parametrize(
    ("boards", "options"),
    [
        ([], {}), ([(1.3, 2.1, WALL - SWERVE - 0.01)], {}), ([(1.3, 2.1, WALL - LEAST + 0.001)], {}),
        ([(3.0, 3.8, WALL - 0.03)], {}), ([(1.3, 2.1, WALL - 0.03)], {"turned": 0.05}),
    ],
    ids=["none", "too far off", "too near", "not passed", "not parallel"],
)  # fmt: skip
def test_no_other_is(boards, options):
    assert lines(looked(*boards, **options)) == []


def test_who_throws_wall_returns_away_is_not_warned():
    found = looked((1.3, 2.1, WALL - 0.03), changed=["slam.use_vt=false"])
    assert len(lines(found)) == 1
    assert [*return_warnings(found, "scene.toml")] == []


def test_the_farthest_of_several_is_named_and_how_many_there_are():
    (line,) = lines(looked((1.2, 1.35, WALL - 0.03), (1.4, 1.7, WALL - 0.05)))
    assert "'board1' stands 50 mm before 'wall_y4' (and 2 other pairs likewise), and" in line


def test_the_two_faces_of_a_partition_are_heard_from_their_own_sides():
    """Through the gap beside it the agent comes from the one to the other."""
    y = np.r_[np.full(5, 1.2), np.linspace(1.4, 2.8, 5), np.full(5, 3.0)]
    place = way(np.r_[np.linspace(1.0, 1.6, 5), np.full(5, 1.8), np.linspace(1.6, 1.0, 5)], y)
    faces = looked((0.9, 1.65, 2.0), (0.9, 1.65, 2.1), place=place)
    assert lines(faces) == []
    (line,) = lines(looked((0.9, 1.35, 2.0), (1.35, 1.65, 2.05), place=place))  # two boards, before and behind both
    assert "50 mm before" in line


def test_a_room_of_too_many_triangles_for_walls_on_the_way_is_looked_at():
    found = looked()
    paths = found.paths
    none = np.zeros((paths.num_paths, 0), dtype=np.int64)
    direct = replace(paths, tx_walls=none, rx_walls=none)
    assert [*return_warnings(found._replace(paths=direct), "scene.toml")] == []


def test_the_shipped_rooms_have_none():
    settings = build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml"))
    for room in ("paper_room", "office", "shaded_room"):
        assert lines(survey(load_scene(ROOT / "scenes" / room), settings)) == []
