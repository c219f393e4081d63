"""Traced against analytic in every room of `scenes/`: the same paths, and the same numbers."""

from pathlib import Path

import numpy as np
import pytest

from rislam_rt.channel.compare import compare_channels, compare_paths, validate_rooms
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.traced import TracedChannel, shortest_segment
from rislam_rt.model import RadioConfig
from rislam_rt.scene import load_scene

SCENES = Path(__file__).parents[3] / "scenes"
ROOMS = sorted(path.parent.name for path in SCENES.glob("*/scene.toml"))
SELDOM = {"empty_box", "two_scatterers", "itu_room"}
"""Rooms of which others have everything: walls, scatterers, and the materials that the imported ones have."""
DEPTH = {"office": 2, "imported_glb": 2, "large_hall": 1}
"""Bounces, where not 3."""


@pytest.mark.parametrize("name", [pytest.param(x, marks=pytest.mark.slow if x in SELDOM else ()) for x in ROOMS])
def test_no_difference_is_unexplained_and_refined_numbers_agree(name):
    scene = load_scene(SCENES / name)
    depth = DEPTH.get(name, 3)
    report = compare_channels(scene, RadioConfig(), poses=8, depth=depth, rng=np.random.default_rng(20))
    assert report.unexplained == 0
    assert report.matched > 100
    # losses need a reason each, and there are few: a thousandth of the paths at most
    assert sum(report.explained.values()) <= 1e-3 * report.matched
    numbers = report.as_dict()
    assert numbers["max_length_error_m"] <= 1e-9  # both float64
    assert numbers["max_gain_error_db"] <= (0.05 if "itu" in name else 0.01)  # the tracer's field is float32
    assert numbers["max_phase_error_rad"] <= 5e-3
    assert numbers["max_angle_error_rad"] <= 1e-9


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("paper_room", marks=pytest.mark.slow),
        "tilted_room",
        pytest.param("large_hall", marks=pytest.mark.slow),
    ],
)
def test_the_tracers_own_vertices_agree_to_float32(name):
    """Refinement repeats the image construction; the tracer's own lengths are the independent evidence."""
    scene = load_scene(SCENES / name)
    rng = np.random.default_rng(21)
    report = compare_channels(scene, RadioConfig(), poses=16, depth=DEPTH.get(name, 2), rng=rng, refine=False)
    assert report.unexplained == 0
    # float32 about the room's middle: 1e-6 m a vertex, a few of them, amplified by slanting bounces
    assert report.length_error.max() <= 2e-5
    # a direction over a short segment is worse than its vertices; the bulk is not
    assert np.percentile(np.concatenate([report.aod_error, report.aoa_error]), 99) <= 1e-4
    assert np.percentile(report.phase_error, 99) <= 5e-3


def test_a_hall_of_100_m_loses_nothing_without_a_reason(rooms):
    """Corners met within millimetres: what float32 loses there follows from the room's size."""
    scene = rooms.scene(rooms.box((0, 0, 0), (100, 80, 30)), (), name="hall")
    rng = np.random.default_rng(5)
    poses = rng.uniform([5, 5, 2], [95, 75, 28], size=(200, 3))
    lost = 0
    for baseline in (0.003, 0.02):
        trajectory = rooms.at(poses, tx=(-0.5 * baseline, -0.2 * baseline, 0.1 * baseline), rx=(0.5 * baseline, 0, 0))
        traced, analytic = (
            channel.paths(trajectory)
            for channel in (
                TracedChannel(scene, RadioConfig(), 2, refine=False),
                ImageSourceChannel(scene, RadioConfig(), 2),
            )
        )
        report = compare_paths(traced, analytic, scene, trajectory, shortest_segment=shortest_segment(scene))
        assert report.passed
        lost += sum(report.explained.values())
    assert lost > 10


def test_a_rooms_poses_depend_on_seed_and_name_alone():
    rooms = [(load_scene(SCENES / name), 1) for name in ("empty_box", "paper_room")]
    forward = validate_rooms(rooms, RadioConfig(), poses=3, seed=1)
    backward = validate_rooms(rooms[::-1], RadioConfig(), poses=3, seed=1)
    assert [(row.scene, row.numbers) for row in forward[:2]] == [("empty_box", "traced"), ("empty_box", "refined")]
    assert forward[0].report.as_dict() == backward[2].report.as_dict()
