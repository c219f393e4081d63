"""A board before a wall is named if both are heard along the way, as nothing else is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.adviser.link_budget import survey
from rislam_rt.adviser.parallel_fronts import SWERVE, parallel_front_warnings
from rislam_rt.adviser.return_warnings import return_warnings
from rislam_rt.model import Reflector
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
WALL = 4.0


def looked(*gaps, start=1.3, turned=0.0, changed=()):
    """Survey of the empty box with boards so far [m] before the wall at y = 4, from x = `start` [m] on, 0.8 m wide and
    one above the other, `turned` [rad] about their upper edge; the agent goes from x = 1.0 to 1.6 m."""
    scene = load_scene(ROOT / "scenes" / "empty_box")
    way = replace(
        scene.agent[:15], position=np.column_stack([np.linspace(1.0, 1.6, 15), np.full(15, 2.3), np.full(15, 1.1)]),
        heading=np.zeros(15),
    )  # fmt: skip
    boards = []
    for number, gap in enumerate(gaps):
        low, high = 0.6 + 0.6 * number, 1.2 + 0.6 * number
        x, y = np.array([start, start + 0.8]), np.array([WALL - gap + turned * (high - low), WALL - gap])
        corners = np.array([[x[0], y[0], low], [x[1], y[0], low], [x[1], y[1], high], [x[0], y[1], high]])
        faces = np.array([[0, 1, 2], [0, 2, 3]])
        boards.append(Reflector(f"board{number}", corners, faces, scene.reflectors[0].material))
    settings = build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml", changed))
    return survey(replace(scene, agent=way, reflectors=(*scene.reflectors, *boards)), settings)


def lines(found):
    return [finding.line for finding in parallel_front_warnings(found, "scene.toml")]


@pytest.mark.parametrize("gap", [0.015, 0.12])
def test_a_board_before_a_wall_is_named(gap):
    found = looked(gap)
    (line,) = lines(found)
    assert line.startswith(f"scene.toml: reflector: 'board0' stands {1e3 * gap:.0f} mm before 'wall_y4', and both are")
    assert line in [finding.line for finding in return_warnings(found, "scene.toml")]


@pytest.mark.parametrize(
    "found",
    [
        looked(), looked(SWERVE + 0.01), looked(0.03, start=3.0), looked(0.03, turned=0.05),
        looked(0.03, changed=["slam.use_vt=false"]),
    ],
    ids=["none", "too far off", "not passed", "not parallel", "who throws wall returns away"],
)  # fmt: skip
def test_no_other_is(found):
    assert lines(found) == []


def test_the_farthest_of_several_is_named():
    (line,) = lines(looked(0.03, 0.05))
    assert "'board0' stands 30 mm before 'wall_y4'" in line or "'board1' stands 50 mm before 'wall_y4'" in line


def test_the_shipped_rooms_have_none():
    settings = build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml"))
    for room in ("paper_room", "office", "shaded_room"):
        assert lines(survey(load_scene(ROOT / "scenes" / room), settings)) == []
