"""Rooms from one mesh: the same walls from every format, unit and axis, and what becomes of things and round ones."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
from built_in_rooms.parts import box_walls, grid

from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import RislamError, SceneError
from rislam_rt.model import Material, Scene
from rislam_rt.model.slab import normal_reflection
from rislam_rt.scene import load_scene
from rislam_rt.scene.check.mesh_queries import winding
from rislam_rt.scene.check.meshes import FAINT
from rislam_rt.scene.importing import ImportOptions, import_room
from rislam_rt.scene.importing.materials import THICKNESS, itu_by_word, parse_choices, parse_material
from rislam_rt.scene.meshes import joined
from rislam_rt.scene.schema import ItuMaterial
from rislam_rt.scene.shapes import block

SHELL = {"floor", "ceiling", "wall_north", "wall_south", "wall_east", "wall_west"}


def imported(file: Path, **options: object) -> tuple[Scene, list[str]]:
    folder = file.parent / "room"
    remarks = import_room(file, folder, ImportOptions(**options))  # type: ignore[arg-type]
    return load_scene(folder), remarks


@pytest.mark.parametrize(
    ("suffix", "unit", "options"),
    [
        (".glb", 1e-3, {"units": "mm"}),
        (".gltf", 1.0, {}),
        (".obj", 1e-2, {"units": "cm", "up": "y"}),
        (".ply", 1.0, {"up": "y"}),
        (".stl", 0.0254, {"units": "in", "up": "y"}),
    ],
)
def test_every_format_gives_the_same_room(
    mesh_file: Callable[..., Path], suffix: str, unit: float, options: dict[str, object]
) -> None:
    scene, _ = imported(mesh_file(suffix, unit, "y"), **options)
    by_name = {reflector.name: reflector for reflector in scene.reflectors}
    assert set(by_name) == SHELL | {"table_top", "cabinet"}
    assert np.allclose(scene.bounds, [[0, 0, 0], [5.0, 4.0, 2.6]], rtol=0, atol=1e-6)  # float32 in the file
    assert np.allclose(by_name["wall_north"].vertices[:, 1], 4.0, rtol=0, atol=1e-6)
    assert np.allclose(by_name["wall_east"].vertices[:, 0], 5.0, rtol=0, atol=1e-6)
    assert len(by_name["floor"].faces) <= 3  # of 8; the cabinet touches its edge in a corner
    # the cabinet stands on the floor and at the wall: four of its faces are left; the table has two that are wide
    assert [len(build_walls(_only(scene, name))) for name in ("cabinet", "table_top")] == [4, 2]
    assert "column_clutter" in [shade.name for shade in scene.occluders]
    assert scene.ris is not None
    assert scene.ris.host == "ceiling"


def _only(scene: Scene, name: str) -> Scene:
    from dataclasses import replace

    return replace(scene, reflectors=tuple(r for r in scene.reflectors if r.name == name), occluders=(), ris=None)


def test_a_cylinder_keeps_its_shadow_or_becomes_planes(mesh_file: Callable[..., Path]) -> None:
    file = mesh_file(".glb", 1.0, "y")
    shading, remarks = imported(file)
    shade = next(s for s in shading.occluders if s.name == "column_clutter")
    girth = np.unique(np.round(shade.vertices[:, :2], 9), axis=0)
    angle = np.argsort(np.arctan2(*(girth - girth.mean(axis=0)).T))
    around = np.linalg.norm(np.diff(girth[np.append(angle, angle[0])], axis=0), axis=1).sum()
    assert around == pytest.approx(2.0 * np.pi * 0.2, rel=0.01)  # the drawing has 40 sides, 0.1 % less
    assert any("a cylinder of 0.2 m became" in line and "that shade" in line for line in remarks)
    file.rename(file.parent / "again.glb")
    (file.parent / "room").rename(file.parent / "first")
    planes, remarks = imported(file.parent / "again.glb", curved="planes")
    assert {"column"} | SHELL <= {r.name for r in planes.reflectors}
    corners = _only(planes, "column").reflectors[0].vertices[:, :2] - [4.2, 3.1]
    error = float(next(line for line in remarks if "a cylinder" in line).split("within ")[1].split()[0])
    assert np.abs(np.linalg.norm(corners, axis=1) - 0.2).max() <= 1e-3 * error + 1e-4


def test_nodes_and_materials_keep_their_names(node_file: Path) -> None:
    scene, remarks = imported(node_file, materials=parse_choices(["wall_*=itu:brick:0.3", "floor=reflection:0.5"]))
    material = {r.name: r.material for r in scene.reflectors}
    assert {"meeting_table", "locker"} | SHELL == set(material)
    assert material["meeting_table"].itu == "wood"
    assert material["locker"].itu == "metal"
    assert (material["wall_north"].itu, material["wall_north"].thickness) == ("brick", 0.3)
    assert material["floor"].reflection == 0.5
    assert material["ceiling"].itu == "plasterboard"
    assert not any("unknown" in line for line in remarks)


def test_a_name_that_one_surface_has_is_kept(tmp_path: Path) -> None:
    """Also one that the importer would give to another surface; where several bear it, each is named by its place, but
    for what spans less than the room, as the sides of an opening."""
    import trimesh

    given = {
        "floor": "Floor_0", "ceiling": "ceiling_0", "wall_x0": "wall_north", "wall_x5": "Wall.003", "wall_y0": "walls",
        "wall_y4": "walls",
    }  # fmt: skip
    scene: Any = trimesh.Scene()
    parts = box_walls(5.0, 4.0, 2.6)
    for node in dict.fromkeys(given.values()):
        mesh = joined([parts[name] for name in given if given[name] == node])
        scene.add_geometry(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False), node_name=node, geom_name=node)
    sides = joined([grid([2, 2, 0], [1, 0, 0], [0, 0, 2], 1, 1), grid([3, 2, 0], [0, 1, 0], [0, 0, 1], 1, 1)])
    scene.add_geometry(trimesh.Trimesh(sides.vertices, sides.faces, process=False), node_name="wall reveal")
    file = tmp_path / "named.glb"
    file.write_bytes(scene.export(file_type="glb"))
    room, _ = imported(file, up="z")
    middle = {wall.name: wall.vertices.mean(axis=0) for wall in room.reflectors}
    by_place = {"wall_south", "wall_north_2"}
    kept = {"floor_0", "ceiling_0", "wall_north", "wall_003", "wall_reveal", "wall_reveal_2"}
    assert set(middle) == kept | by_place
    assert middle["wall_north"][0] == pytest.approx(0.0, abs=1e-6)
    assert middle["wall_north_2"][1] == pytest.approx(4.0, abs=1e-6)


def test_the_proposal_is_inside_and_free(node_file: Path) -> None:
    scene, _ = imported(node_file)
    shell = np.concatenate([r.triangles for r in scene.reflectors if r.name in SHELL])
    assert abs(winding(scene.agent.position[0], shell)) == pytest.approx(1.0)
    assert abs(winding(scene.agent.position[-1], shell)) == pytest.approx(1.0)
    assert np.linalg.norm(scene.agent.position[-1] - scene.agent.position[0]) > 2.0


def test_origin_moves_the_room(mesh_file: Callable[..., Path]) -> None:
    scene, _ = imported(mesh_file(".stl"), origin=(1.0, -2.0, 0.5))
    assert np.allclose(scene.bounds[0], [-1.0, 2.0, -0.5], rtol=0, atol=1e-6)


def test_more_walls_than_wanted_become_shades(mesh_file: Callable[..., Path]) -> None:
    scene, remarks = imported(mesh_file(".stl"), max_walls=8)
    assert len(build_walls(scene)) <= 8
    assert {r.name for r in scene.reflectors} >= SHELL
    assert any("--max-walls" in line for line in remarks)


@pytest.mark.parametrize(("unit", "says"), [(1e-3, "give --units mm (6.9 m)"), (1e3, "give --units mm, cm, m or in")])
def test_a_wrong_unit_is_named_and_nothing_is_written(mesh_file: Callable[..., Path], unit: float, says: str) -> None:
    file = mesh_file(".stl", unit)
    with pytest.raises(SceneError, match="would measure") as caught:
        imported(file)
    assert says in str(caught.value)
    assert [path.name for path in file.parent.iterdir()] == [file.name]


def test_a_given_unit_in_which_nobody_has_room_is_answered_with_the_one_that_fits(
    mesh_file: Callable[..., Path],
) -> None:
    with pytest.raises(
        SceneError, match=r"with --units mm it would measure 0\.006911 m across; give --units m \(6\.9 m\)$"
    ):
        imported(mesh_file(".stl"), units="mm")


def test_a_given_unit_in_which_the_room_is_vast_may_be_meant(mesh_file: Callable[..., Path], tmp_path: Path) -> None:
    said = "with --units m it would measure 6911 m across: give --units mm (6.9 m) if that is not meant"
    assert said in imported(mesh_file(".stl", 1e-3), units="m")[1]
    plan = tmp_path / "plan" / "plan.json"
    plan.parent.mkdir()
    ring = [[0, 0], [500, 0], [500, 400], [0, 400], [0, 0]]
    room = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring]}}
    plan.write_text(json.dumps({"type": "FeatureCollection", "features": [room]}))
    assert any("give --units cm (6.4 m) or" in remark for remark in imported(plan, units="m")[1])
    with pytest.raises(SceneError, match=r"with --units mm it would measure 0\.6403 m across; give --units cm"):
        imported(plan, units="mm")


@pytest.mark.parametrize(("carrier_ghz", "faint"), [(10.0, True), (7.5, False)])
def test_an_import_remarks_on_a_pane_of_half_a_wave(node_file: Path, carrier_ghz: float, faint: bool) -> None:
    glass = parse_choices(["wall_north=itu:glass:0.006", "wall_east=itu:glass:0.006"])
    _, remarks = imported(node_file, materials=glass, carrier_ghz=carrier_ghz)
    found = [remark for remark in remarks if "and 1 more): 6 mm of 'glass' reflect 0.04" in remark]
    assert len(found) == faint
    mend = "(--material NAME=itu:MATERIAL:THICKNESS_M or NAME=reflection:VALUE)"
    assert all(remark.endswith(mend) for remark in found)


@pytest.mark.parametrize("itu", sorted(THICKNESS))
def test_no_usual_thickness_lets_the_carrier_through(itu: str) -> None:
    """At 10 GHz, which an import takes without an option, no thickness that nobody chose is one that `check` warns
    of."""
    try:
        found = normal_reflection(Material(itu=itu, thickness=THICKNESS[itu]), 10e9)
    except RislamError:
        return  # not specified at the carrier: an import takes another
    assert found is not None
    assert found.slab >= FAINT * found.half_space


def test_a_guessed_material_is_specified_at_the_carrier(tmp_path: Path) -> None:
    """P.2040 knows floorboards from 50 GHz on: a floor of planks is wood below, and a remark names the option."""
    mesh = block([0.0, 0.0, 0.0], [5.0, 4.0, 2.6])
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices] + ["o planks"]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces]
    for carrier, itu in ((10.0, "wood"), (60.0, "floorboard")):
        (tmp_path / itu).mkdir()
        (tmp_path / itu / "planks.obj").write_text("\n".join(lines))
        scene, remarks = imported(tmp_path / itu / "planks.obj", carrier_ghz=carrier)
        assert {(r.material.itu, r.material.thickness) for r in scene.reflectors} == {(itu, 0.02)}
        said = "'floorboard' is not specified at 10 GHz, taken as wood, 0.02 (--material NAME=...)"
        assert (said in remarks) == (itu == "wood")


def test_names_speak_of_materials() -> None:
    names = {"Oak.003": "wood", "itu_concrete": "concrete", "Window Glass": "glass", "Stahl-blank": "metal",
             "M_Ceiling_Board": "ceiling_board", "Material.004": None, "": None, "wooden chest": "wood",
             "floor vinyl": "vinyl_tile", "Carpet.001": "carpet_tile", "linoleum": "vinyl_tile", "wardrobe": None,
             "Dry wall": "plasterboard", "Ceiling tiles": "ceiling_board", "ceiling tile": "ceiling_board",
             "bath mirror": "metal"}  # fmt: skip
    assert {name: itu_by_word(name) for name in names} == names
    assert set(THICKNESS) == set(get_args(ItuMaterial))
    assert parse_material("itu:glass") == {"itu": "glass", "thickness_m": 0.004}
    with pytest.raises(RislamError, match=r"is no ITU material; did you mean .concrete.\?"):
        parse_material("itu:Concreet")
    for wrong in ("itu:cheese", "reflection:1.5", "concrete", "itu:wood:-1", "reflection:nan"):
        with pytest.raises(RislamError, match="--material"):
            parse_material(wrong)
    with pytest.raises(RislamError, match="NAME=itu:concrete"):
        parse_choices(["itu:wood"])
