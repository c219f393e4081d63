"""Rooms from floor plans: corners, GeoJSON and SVG; walls joined, doors and windows cut out and closed."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rislam_rt.errors import SceneError
from rislam_rt.model import RadioConfig, Scene
from rislam_rt.scene import check_scene, load_scene
from rislam_rt.scene.check.mesh_queries import crossings, winding
from rislam_rt.scene.importing import ImportOptions, import_corners, import_room
from rislam_rt.scene.importing.materials import parse_choices

WALL, DOOR, WINDOW = (0.1, 0.9, 2.0), (1.0, 1.9, 2.0), (3.0, 4.5, 2.1)


def area(triangles: np.ndarray) -> float:
    a, b, c = triangles.swapaxes(0, 1)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def surface(scene: Scene, *names: str) -> np.ndarray:
    found = [r.triangles for r in scene.reflectors if not names or r.name in names]
    return np.concatenate(found)


@pytest.mark.parametrize("corners", ["0,0 4,0 4,3 0,3", "0,3 4,3 4,0 0,0"])
def test_one_room_from_its_corners(tmp_path: Path, corners: str) -> None:
    import_corners(corners, tmp_path / "room", ImportOptions(), height=2.5)
    scene = load_scene(tmp_path / "room")
    names = ["floor", "ceiling", "wall_south", "wall_east", "wall_north", "wall_west"]
    assert {r.name for r in scene.reflectors} == set(names)
    assert area(surface(scene)) == pytest.approx(2 * (12.0 + 2.5 * 7.0))
    assert np.ptp(surface(scene, "wall_north")[..., 1]) == 0.0
    assert surface(scene, "wall_north")[0, 0, 1] == 3.0


@pytest.mark.parametrize("ghz", [2.4, 5.0, 10.0, 28.0])
def test_the_proposed_panel_is_one_that_the_check_finds_nothing_against_at_its_carrier(
    tmp_path: Path, ghz: float
) -> None:
    """Elements half a wavelength apart, which reflect no more than a plate."""
    import_corners("0,0 4,0 4,3 0,3", tmp_path / "room", ImportOptions(carrier_ghz=ghz))
    (panel,) = load_scene(tmp_path / "room").panels
    assert panel.spec.element == "energy"
    assert panel.spec.spacing == pytest.approx((0.5 * 0.299792458 / ghz,) * 2, rel=5e-3)  # three digits
    assert f"for a carrier of {ghz:g} GHz" in (tmp_path / "room/README.md").read_text()
    radio = RadioConfig(carrier=1e9 * ghz, bandwidth=min(1e9, 1e9 * ghz))
    assert not [f.line for f in check_scene(tmp_path / "room", radio) if f.field in ("ris.element", "ris.spacing_m")]


def test_a_room_of_any_shape_is_closed(tmp_path: Path) -> None:
    import_corners("0,0 6,0 6,3 4,3 4,5 1,6 0,4", tmp_path / "room", ImportOptions())
    scene = load_scene(tmp_path / "room")
    start = scene.agent.position[0]
    ends = start + 20.0 * np.random.default_rng(1).normal(size=(500, 3))
    rays, _ = crossings(np.broadcast_to(start, ends.shape), ends, surface(scene))
    assert len(np.unique(rays)) == 500
    shoelace = 0.5 * abs(sum(a * d - b * c for (a, b), (c, d) in [
        ((0, 0), (6, 0)), ((6, 0), (6, 3)), ((6, 3), (4, 3)), ((4, 3), (4, 5)), ((4, 5), (1, 6)), ((1, 6), (0, 4)),
        ((0, 4), (0, 0)),
    ]))  # fmt: skip
    assert area(surface(scene, "floor")) == pytest.approx(shoelace)


def feature(kind: str, coordinates: Any, **about: Any) -> dict[str, Any]:
    geometry = {"type": "Polygon" if kind == "room" else "LineString", "coordinates": coordinates}
    return {"type": "Feature", "properties": {"kind": kind, **about}, "geometry": geometry}


def box(x0: float, y0: float, x1: float, y1: float) -> list[list[list[float]]]:
    return [[[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]]


@pytest.fixture
def two_rooms(tmp_path: Path) -> Path:
    """Two rooms that share a wall with an open door and have a window and a closed door."""
    features = [
        feature("room", box(0, 0, 4, 3)), feature("room", box(4, 0, 7, 3)),
        feature("door", [[4, 1.0], [4, 1.9]]),
        feature("window", [[1.0, 3.0], [2.5, 3.0]], bottom=1.0, top=2.0, name="skylight"),
        feature("door", [[7, 1.0], [7, 2.0]], material="itu:metal"),
    ]  # fmt: skip
    path = tmp_path / "plan.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def test_doors_are_holes_and_windows_glass(two_rooms: Path, tmp_path: Path) -> None:
    import_room(two_rooms, tmp_path / "room", ImportOptions(), height=2.5)
    scene = load_scene(tmp_path / "room")
    material = {r.name: r.material.itu for r in scene.reflectors}
    assert (material["skylight"], material["door"]) == ("glass", "metal")
    # the wall between both rooms is one, with a hole of 0.9 x 2 m
    assert area(surface(scene, "partition")) == pytest.approx(3.0 * 2.5 - 0.9 * 2.0)
    assert area(surface(scene, "wall_north", "skylight")) == pytest.approx(7.0 * 2.5)
    assert area(surface(scene, "skylight")) == pytest.approx(1.5)
    assert area(surface(scene, "wall_east", "door")) == pytest.approx(3.0 * 2.5)
    through = np.array([[[2.0, 1.5, 1.0], [6.0, 1.5, 1.0]], [[2.0, 1.5, 2.2], [6.0, 1.5, 2.2]]])
    blocked, _ = crossings(through[:, 0], through[:, 1], surface(scene))
    assert blocked.tolist() == [1]


def test_the_name_of_a_material_is_found_in_any_capitals_and_as_written_first(tmp_path: Path) -> None:
    """The file's own spelling was `nothing has that name`."""
    features = [
        feature("room", box(0, 0, 4, 3)), feature("wall", [[0.5, 1.5], [2.0, 1.5]], name="Trennwand"),
        feature("wall", [[2.5, 2.0], [3.5, 2.0]], name="Tafel"),
    ]  # fmt: skip
    (tmp_path / "plan.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    given = parse_choices(["Trennwand=reflection:0.5", "TAFEL=itu:brick", "tafel=itu:metal", "T*=itu:brick"])
    with pytest.raises(SceneError, match=r"--material T\*: nothing has that name"):
        import_room(tmp_path / "plan.geojson", tmp_path / "room", ImportOptions(materials=given))
    del given["T*"], given["TAFEL"]
    import_room(tmp_path / "plan.geojson", tmp_path / "room", ImportOptions(materials=given))
    material = {r.name: r.material for r in load_scene(tmp_path / "room").reflectors}
    assert (material["trennwand"].reflection, material["tafel"].itu) == (0.5, "metal")


SVG = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 720 320">
<g id="rooms" transform="translate(10,10)"><rect width="400" height="300"/><path d="m 410 0 h 300 v 300 h -300 z"/></g>
<g class="doors"><rect x="408" y="100" width="14" height="90"/></g>
<g class="layer windows"><line x1="110" y1="10" x2="260" y2="10" data-bottom="1"/></g></svg>"""


def test_thick_walls_have_frames(tmp_path: Path) -> None:
    """Two rooms 10 cm apart in centimetres, y down: the door goes through both faces, and nobody looks between them."""
    (tmp_path / "plan.svg").write_text(SVG)
    import_room(tmp_path / "plan.svg", tmp_path / "room", ImportOptions(units="cm"), height=2.5)
    scene = load_scene(tmp_path / "room")
    assert np.allclose(scene.bounds, [[0, 0, 0], [7.1, 3.0, 2.5]], rtol=0, atol=1e-9)
    assert area(surface(scene, "wall_east", "wall_west_2")) > 0.0
    frame = surface(scene, "door_frame")
    assert area(frame) == pytest.approx(2 * 0.1 * 2.0 + 0.1 * 0.9)  # jambs and lintel
    assert np.allclose(surface(scene, "window")[..., 1], 3.0, rtol=0, atol=1e-9)  # the top of the drawing is north
    start = np.array([2.0, 1.5, 1.0])
    ends = start + 20.0 * np.random.default_rng(2).normal(size=(500, 3))
    assert len(np.unique(crossings(np.broadcast_to(start, ends.shape), ends, surface(scene))[0])) == 500
    assert abs(winding(start, surface(scene, "floor", "ceiling"))) < 1.0


@pytest.mark.parametrize(
    ("corners", "says"),
    [
        ("0,0 4,0", "2 corners"), ("0,0 4,4 4,0 0,4", "crosses itself"), ("0,0 4,0 x,3", "is no corner"),
        ("", "0 corners"), ("0,0 1e9,0 4,3", "measure 1e.09 m across; no unit makes a room"),
        ("0,0 1e30,0 4,3", "beyond 100 km"), ("0,0 nan,0 4,3", "not finite"),
        ("0,0 400,0 400,300 0,300", "--floorplan: in metres it would measure 500 m across; give --units cm"),
        ("0,0 0.2,0 0.2,2 0,2", "no free place"),
    ],
)  # fmt: skip
def test_corners_that_enclose_nothing(tmp_path: Path, corners: str, says: str) -> None:
    with pytest.raises(SceneError, match=says) as caught:
        import_corners(corners, tmp_path / "room", ImportOptions())
    assert str(caught.value).isprintable()
    assert list(tmp_path.iterdir()) == []


def test_corners_lie_where_the_origin_says(tmp_path: Path) -> None:
    import_corners("10,20 14,20 14,23 10,23", tmp_path / "room", ImportOptions(origin=(10.0, 20.0, 0.0)))
    assert np.allclose(load_scene(tmp_path / "room").bounds, [[0.0, 0.0, 0.0], [4.0, 3.0, 2.7]], atol=0.2)


@pytest.mark.parametrize("name", ["up", "scan"])
def test_what_says_how_a_mesh_lies_is_refused_of_a_floor_plan(tmp_path: Path, name: str) -> None:
    """Both were passed over in silence."""
    options = ImportOptions(up="y") if name == "up" else ImportOptions(scan=True)
    with pytest.raises(SceneError, match=rf"--floorplan: --{name}: .*; leave it out"):
        import_corners("0,0 4,0 4,3 0,3", tmp_path / "room", options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("far.svg", '<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0 L4 0 L4 3 L0 1e3083 Z"/></svg>'),
        ("far.geojson", '{"type": "Polygon", "coordinates": [[[0, 0], [4, 0], [4, 3], [0, 1e300], [0, 0]]]}'),
    ],
)
def test_a_plan_with_a_number_beyond_all_measure_is_one_line(tmp_path: Path, name: str, content: str) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(SceneError, match="a coordinate is not finite or beyond 100 km"):
        import_room(tmp_path / name, tmp_path / "room", ImportOptions())
    assert not (tmp_path / "room").exists()


def test_a_plan_comes_back_from_its_own_triangles(two_rooms: Path, tmp_path: Path) -> None:
    """As a soup of quads whose corners meet edges: every wall is found again, in full, and so is the doorway."""
    import trimesh

    import_room(two_rooms, tmp_path / "plan", ImportOptions(), height=2.5)
    soup = surface(load_scene(tmp_path / "plan"))
    trimesh.Trimesh(soup.reshape(-1, 3), np.arange(3 * len(soup)).reshape(-1, 3), process=False).export(
        tmp_path / "soup.stl"
    )
    import_room(tmp_path / "soup.stl", tmp_path / "again", ImportOptions())
    again = load_scene(tmp_path / "again")
    assert area(surface(again)) == pytest.approx(area(soup), rel=1e-6)  # float32 in the file
    assert {r.name for r in again.reflectors} >= {"floor", "ceiling", "wall_north", "wall_south"}
    assert len(again.reflectors) == 7  # the wall between the rooms is a wall of its own
