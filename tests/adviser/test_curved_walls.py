"""A curved wall of small facets is named if three of them are heard along the way, as nothing else is."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.adviser.link_budget import survey
from rislam_rt.adviser.return_warnings import BEND, curved_wall_warnings, return_warnings
from rislam_rt.model import Reflector
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
MIDDLE = np.array([3.0, 2.0])
"""[m] of the circle on which the facets stand, and of the arc of 100 degrees that the agent walks, both to the east."""


def looked(step: float, span: float = 100.0, radius: float = 1.9, walked: float = 1.0, gap: float = 0.0):
    """Survey of the empty box with a curved wall of facets of `step` degrees over `span` degrees, `gap` [m] apart,
    past which the agent goes at a distance of `walked` [m] from its middle."""
    scene = load_scene(ROOT / "scenes" / "empty_box")
    angle = np.deg2rad(np.arange(-span / 2.0, span / 2.0 + 0.1, step))
    foot = MIDDLE + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    corners, faces = [], []
    for one, other in pairwise(foot):
        inset = gap * (other - one) / np.linalg.norm(other - one)
        base = len(corners)
        corners += [(*(one + inset), 0.4), (*(other - inset), 0.4), (*(other - inset), 2.2), (*(one + inset), 2.2)]
        faces += [(base, base + 1, base + 2), (base, base + 2, base + 3)]
    curve = Reflector("curve", np.array(corners), np.array(faces), scene.reflectors[0].material)
    way = np.linspace(-0.9, 0.9, 15)
    place = np.column_stack([MIDDLE + walked * np.column_stack([np.cos(way), np.sin(way)]), np.full(15, 1.1)])
    agent = replace(scene.agent[:15], position=place, heading=way + np.pi / 2.0)
    settings = build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml"))
    return survey(replace(scene, agent=agent, reflectors=(*scene.reflectors, curve)), settings)


def lines(found) -> list[str]:
    return [finding.line for finding in curved_wall_warnings(found, "scene.toml")]


@pytest.mark.parametrize("step", [5.0, 10.0])
def test_a_curved_wall_is_named_with_its_angle(step: float) -> None:
    found = looked(step)
    (line,) = lines(found)
    assert line.startswith("scene.toml: reflector: 'curve#")
    assert f"turn by {step:g} degrees from one to the next" in line
    assert f"facets that turn by {np.rad2deg(BEND):.0f} degrees or more" in line
    assert line in [finding.line for finding in return_warnings(found, "scene.toml")]


@pytest.mark.parametrize("step", [10.0, 30.0])
def test_a_round_room_is_named_up_to_larger_angles(step: float) -> None:
    (line,) = lines(looked(step, span=360.0))
    assert "curved walls that close round the agent" in line
    assert "a round wall by facets that turn by 36 degrees or more" in line


@pytest.mark.parametrize(
    "options",
    [
        {"step": 20.0},
        {"step": 10.0, "span": 20.0},
        {"step": 1.5, "span": 9.0},
        {"step": 10.0, "gap": 0.01},
        {"step": 40.0, "span": 360.0},
        {"step": 20.0, "span": 320.0},
        {"step": 20.0, "span": 360.0, "radius": 0.4, "walked": 1.2},
    ],
    ids=["large facets", "one kink", "hardly curved", "apart", "few facets", "open", "pillar"],
)
def test_what_is_no_curved_wall_is_not_named(options: dict[str, float]) -> None:
    assert not lines(looked(**options))


def test_a_curved_wall_that_is_not_heard_is_not_named() -> None:
    found = looked(10.0)
    silent = replace(found.paths, valid=np.zeros_like(found.paths.valid))
    assert not lines(found._replace(paths=silent))


def test_walls_in_parts_and_kinks_apart_are_no_curved_wall() -> None:
    """Walls of the box in two even halves each; and three walls with a kink of ten degrees of their own."""
    found = looked(20.0)
    plain = found.scene.reflectors[0]
    for depth in (0.0, 0.075):  # 0.86 tan(5 degrees)
        parts = []
        for turn in (-1.2, 0.0, 1.2):
            cos, sin = np.cos(turn), np.sin(turn)
            foot = np.array([[1.7, -0.86], [1.7 + depth, 0.0], [1.7, 0.86]]) @ np.array([[cos, sin], [-sin, cos]])
            foot = MIDDLE + foot
            corners = np.array([(*at, z) for at in foot for z in (0.4, 2.2)])
            faces = np.array([[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]])
            name = f"part{len(parts)}"
            parts += [
                Reflector(f"{name}a", corners[:4], faces[:2], plain.material),
                Reflector(f"{name}b", corners[2:], faces[2:] - 2, plain.material),
            ]
        room = replace(found.scene, reflectors=(*found.scene.reflectors[:-1], *parts))
        again = survey(room, found.settings)
        assert not lines(again)
