"""Unit mistakes are named, whatever else is wrong with a scene."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from rislam_rt.scene import check_scene, load_scene, write_scene
from rislam_rt.scene.check.units import unit_warnings

Damage = Callable[[str, str], Path]
ROOM = Path(__file__).parents[2] / "scenes" / "paper_room"
BOX = np.array([[0.0, 0.0, 0.0], [6.0, 6.0, 3.0]])


def said(table: dict[str, object], bounds: np.ndarray | None = BOX) -> list[str]:
    return [finding.line for finding in unit_warnings("scene.toml", table, bounds)]


def test_a_room_drawn_in_millimetres_is_named_beside_the_errors_that_it_causes(tmp_path: Path) -> None:
    scene = load_scene(ROOM)
    large = tuple(replace(wall, vertices=1000.0 * wall.vertices) for wall in scene.reflectors)
    findings = check_scene(write_scene(replace(scene, reflectors=large), tmp_path / "large"))
    assert any(finding.severity == "error" for finding in findings)
    line = next(finding.line for finding in findings if finding.field == "meshes.units")
    assert "6e+03 x 6e+03 x 3e+03 m; in millimetres it would be 6 x 6 x 3 m" in line
    assert 'units = "mm"' in line


def test_a_number_in_millimetres_is_named_though_a_key_is_missing(damaged: Damage) -> None:
    damaged('name = "paper_room"\n', "")
    findings = check_scene(damaged("spacing_m = [0.015, 0.015]", "spacing_m = [15.0, 15.0]"))
    assert [finding.severity for finding in findings] == ["error", "warning"]
    assert "name: missing" in findings[0].line
    assert "ris.spacing_m: 15 m; in millimetres it would be 0.015 m" in findings[1].line


def test_a_start_in_millimetres_is_named_beside_being_outside(damaged: Damage) -> None:
    errors, units = check_scene(damaged("start = [0.5, 0.7, 0.5]", "start = [500.0, 700.0, 500.0]"))
    assert "lies outside" in errors.line
    assert "agent.start: [500.0, 700.0, 500.0] is far outside the room; in millimetres" in units.line
    assert "[0.5, 0.7, 0.5] m" in units.line


def test_a_start_that_fits_in_several_units_is_told_all_of_them() -> None:
    """One in centimetres was told that it was in millimetres."""
    (line,) = said({"agent": {"start": [150.0, 120.0, 100.0]}}, np.array([[0.0, 0.0, 0.0], [5.0, 4.0, 2.8]]))
    words = "in centimetres it would be [1.5, 1.2, 1.0] m, in millimetres [0.15, 0.12, 0.1] m, in inches [3.81, 3.048,"
    assert words in line
    assert line.endswith("; give metres: multiply by 0.01 or 0.001 or 0.0254")


def test_waypoints_in_millimetres_are_named_one_by_one() -> None:
    lines = said({"agent": {"waypoints": [[1.0, 1.0, 0.5], [4000.0, 1000.0, 500.0], "there", [4, 1]]}})
    assert len(lines) == 1
    assert "agent.waypoints[1]: [4000.0, 1000.0, 500.0] is far outside the room; in millimetres" in lines[0]


def test_each_quantity_is_named_with_its_place() -> None:
    wall = {"material": {"itu": "concrete", "thickness_m": 200.0}}
    agent = {"cycle_s": 100, "velocity": [0, 70.7, 0]}
    table = {"reflector": [{"material": {"reflection": 0.5}}, wall], "agent": agent}
    lines = said(table | {"scatterer": [{"radius": 0.05}, {"radius": 5}]})
    assert any("scatterer[1].radius: 5 m; in millimetres it would be 0.005 m" in line for line in lines)
    assert any("reflector[1].material.thickness_m: 200 m; in millimetres it would be 0.2 m" in line for line in lines)
    assert any("agent.cycle_s: 100 s; in milliseconds it would be 0.1 s" in line for line in lines)
    assert any("agent.velocity: 70.7 m/s" in line for line in lines)
    assert len(lines) == 4


def test_usual_numbers_wrong_types_and_points_lost_for_other_reasons_are_left_alone() -> None:
    assert not said({"agent": {"start": [7.0, 1.0, 1.0], "cycle_s": 0.1}, "ris": {"spacing_m": [0.015, 0.015]}})
    assert not said({"agent": {"start": "500", "cycle_s": True, "velocity": [None]}, "ris": [3], "reflector": 7})
    assert not said({"agent": {"start": [9e4, 9e4, 9e4]}})
    assert not said({"agent": {"start": [500.0, 700.0, 500.0]}}, None)


def test_a_mesh_in_another_unit_than_the_others_is_named(tmp_path: Path) -> None:
    scene = load_scene(ROOM)
    walls = [
        replace(wall, vertices=(1000.0 if n == 2 else 1.0) * wall.vertices) for n, wall in enumerate(scene.reflectors)
    ]
    found = check_scene(write_scene(replace(scene, reflectors=tuple(walls)), tmp_path / "mixed"))
    (line,) = [one.line for one in found if ".units" in one.field]
    assert f"reflector[2].units ({walls[2].name}): it reaches 6e+03 m from the room's zero, most others 6 m" in line
    assert 'in millimetres it would be 6 m; say units = "mm" beside it, or mend its origin' in line


def test_the_size_of_a_room_in_millimetres_is_said_once(tmp_path: Path) -> None:
    scene = load_scene(ROOM.parent / "empty_box")
    walls = tuple(replace(wall, vertices=1000.0 * wall.vertices) for wall in scene.reflectors)
    agent = replace(scene.agent, position=1000.0 * scene.agent.position, velocity=1000.0 * scene.agent.velocity)
    found = check_scene(write_scene(replace(scene, reflectors=walls, agent=agent), tmp_path / "large"))
    assert not [one for one in found if one.severity == "error"]
    assert [one.field for one in found if one.message.startswith("the room ")] == ["meshes.units"]


def test_a_recording_in_millimetres_or_milliseconds_is_named(damaged: Damage) -> None:
    damaged("start = [0.5, 0.7, 0.5]\n", "")
    damaged("cycles = 600\ncycle_s = 0.1\n", "")
    room = damaged("velocity = [0.0707, 0.0707, 0.0]", 'trajectory = "w.csv"')

    def found(time: int, place: int) -> list[str]:
        rows = "".join(f"{time * k},{(1 + 0.01 * k) * place},{place},{place}\n" for k in range(4))
        (room / "w.csv").write_text(f"time,x,y,z\n{rows}")
        warnings = [one for one in check_scene(room) if one.severity == "warning"]
        return [one.line for one in warnings if one.field == "agent.trajectory"]

    assert not found(1, 1)
    assert (
        "[1000.0, 1000.0, 1000.0] is far outside the room; in millimetres it would be [1.0, 1.0," in found(1, 1000)[0]
    )
    assert "100 s between poses; in milliseconds it would be 0.1 s; give seconds, or end" in found(100, 1)[0]


def test_a_toy_and_a_city_are_named() -> None:
    assert "enlarged" in said({}, BOX / 1000.0)[0]
    assert said({}, BOX * 1e5)[0].endswith("the room is 6e+05 x 6e+05 x 3e+05 m; give metres")


def test_the_rooms_that_come_with_the_package_have_no_such_warning() -> None:
    for file in sorted(ROOM.parent.glob("*/scene.toml")):
        assert not [f for f in check_scene(file) if "would be" in f.message], file
