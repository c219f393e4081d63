"""Returns of two walls that cancel in the middle between them are named, and the receiver hears neither."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.adviser.link_budget import survey
from rislam_rt.adviser.return_warnings import cancelled_return_warnings, return_warnings
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.measurement import measure
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.specification.pipeline_spec import build_settings
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
MIDDLE = 2.0


def looked(off, heading=0.0, *changed):
    """Survey of the empty box, its agent going along the walls, so far [m], (15,), off the middle between them."""
    scene = load_scene(ROOT / "scenes" / "empty_box")
    along, across = np.linspace(1.0, 1.6, 15), MIDDLE + np.broadcast_to(off, 15)
    way = replace(
        scene.agent[:15], position=np.column_stack([along, across, np.full(15, 1.1)]),
        heading=np.full(15, heading),
    )  # fmt: skip
    settings = build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml", changed))
    return survey(replace(scene, agent=way), settings)


def heard_across(found):
    """Lengths [m] that the receiver reports, at the first place, of the two walls' returns."""
    settings, rng = found.settings, np.random.default_rng(1)
    receiver = replace(settings.receiver, estimator="waveform", alternation=False)
    heard, _ = measure(found.paths, 0, float(found.scene.agent.heading[0]), settings.radio, receiver, rng=rng)
    length, paths = SPEED_OF_LIGHT * heard.tau, found.paths
    walls = [paths.label(path) in ("VT wall_y0", "VT wall_y4") for path in range(paths.num_paths)]
    away = np.abs(length[:, None] - SPEED_OF_LIGHT * paths.tau[0, walls])
    return length[(away < 0.02).any(axis=1)]  # a fifteenth of a resolution cell


def lines(found):
    return [finding.line for finding in cancelled_return_warnings(found, "scene.toml")]


def test_the_middle_between_two_walls_is_named_and_neither_is_heard():
    found = looked(0.0)
    (line,) = lines(found)
    assert line.startswith("scene.toml: agent.trajectory: at 100% of the places along the way")
    assert "('wall_y0' and 'wall_y4')" in line
    assert "at least 0.075 m off the middle" in line
    assert not len(heard_across(found))


@pytest.mark.parametrize(
    "found",
    [looked(0.1), looked(0.0, 0.6), looked(0.0, 0.0, "radio.array.cols=5")],
    ids=["as far off as is told", "turned", "an odd number of antennas"],
)
def test_elsewhere_they_are_heard(found):
    assert lines(found) == []
    assert len(heard_across(found))


def test_who_starts_in_the_middle_or_crosses_it_is_not_warned():
    assert lines(looked(np.linspace(0.0, 0.7, 15))) == []
    assert lines(looked(np.linspace(-0.7, 0.7, 15))) == []
    held = np.where(np.arange(15) < 3, 0.0, 0.3)
    (line,) = lines(looked(held))
    assert "at 20% of the places" in line


def test_doors_beside_the_way_do_not_hide_that_it_keeps_to_the_middle():
    """At every second place one wall is not there: where both are, the way is in their middle."""
    found = looked(0.0)
    valid, labels = found.paths.valid.copy(), [found.paths.label(path) for path in range(found.paths.num_paths)]
    valid[1::2, labels.index("VT wall_y4")] = False
    (line,) = lines(found._replace(paths=replace(found.paths, valid=valid)))
    assert "at 53% of the places" in line
    assert lines(looked(np.where(np.arange(15) % 2, 0.3, 0.0))) == []  # it goes to and fro, and both are heard


def test_the_shipped_rooms_have_none():
    settings = build_settings(load_spec(ROOT / "pipelines" / "trace_then_slam.toml"))
    for room in ("paper_room", "large_hall", "office"):
        assert lines(survey(load_scene(ROOT / "scenes" / room), settings)) == []


def test_who_throws_wall_returns_away_is_not_warned():
    found = looked(0.0, 0.0, "slam.use_vt=false")
    assert len(lines(found)) == 1
    assert [*return_warnings(found, "scene.toml")] == []
