"""Files that are no rooms: each ends in one line that names the file and the mend, and nothing is written."""

import base64
import json
import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from built_in_rooms.parts import box_walls

from rislam_rt.errors import RislamError
from rislam_rt.scene import load_scene
from rislam_rt.scene.importing import ImportOptions, import_room
from rislam_rt.scene.meshes import joined, ply_bytes

BOX = joined(list(box_walls(4.0, 3.0, 2.5).values()))
OBJ = "".join(f"v {x} {y} {z}\n" for x, y, z in BOX.vertices) + "".join(
    f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in BOX.faces
)
STL_HEAD = b"\0" * 80


def stl(triangles: np.ndarray, count: int | None = None) -> bytes:
    """A binary STL file that says it has `count` triangles."""
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in triangles)
    return STL_HEAD + struct.pack("<I", len(triangles) if count is None else count) + body


def gltf(**changes: Any) -> dict[str, Any]:
    """A glTF document of the box, its buffer inside; `changes` replace parts of it."""
    data = BOX.vertices.astype("<f4").tobytes() + BOX.faces.astype("<u4").tobytes()
    size = 12 * len(BOX.vertices)
    document: dict[str, Any] = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(BOX.vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": BOX.faces.size, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": size},
            {"buffer": 0, "byteOffset": size, "byteLength": len(data) - size},
        ],
        "buffers": [{"byteLength": len(data), "uri": "data:;base64," + base64.b64encode(data).decode()}],
    }  # fmt: skip
    return document | changes


def glb(document: dict[str, Any], version: int = 2, cut: int = 0) -> bytes:
    """A GLB file of a document."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    whole = struct.pack("<4sIII4s", b"glTF", version, 20 + len(text), len(text), b"JSON") + text
    return whole[: len(whole) - cut]


def ply(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    return ply_bytes(vertices, faces)


def replaced(array: np.ndarray, at: tuple[int, int], value: float) -> np.ndarray:
    changed = array.copy()
    changed[at] = value
    return changed


LAUGHS = '<!DOCTYPE svg [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]><svg><text>&b;</text></svg>'
FAR = {"uri": "../secret.bin", "byteLength": 4}
BAD: dict[str, tuple[str, bytes | str | dict[str, Any], str]] = {
    "kind": ("room.fbx", "x", "give one of .glb"),
    "zip": ("room.zip", b"PK\x03\x04" + b"\0" * 100, "give one of .glb"),
    "no suffix": ("room", "x", "give one of .glb"),
    **{f"empty {s}": (f"room.{s}", b"", "the file is empty") for s in ("glb", "gltf", "obj", "stl", "ply", "svg")},
    "garbage glb": ("room.glb", b"garbage" * 9, "not a GLB file"),
    "short glb": ("room.glb", b"glTF", "too short"),
    "old glb": ("room.glb", glb(gltf(), version=1), "version 1"),
    "cut glb": ("room.glb", glb(gltf(), cut=300), "the file ends after"),
    "packed glb": ("room.glb", glb(gltf(extensionsRequired=["KHR_draco_mesh_compression"])), "without compression"),
    "glb without meshes": ("room.glb", glb({"asset": {"version": "2.0"}}), ""),
    "garbage gltf": ("room.gltf", "{", "JSON cannot be read"),
    "gltf is a list": ("room.gltf", "[1]", "JSON cannot be read"),
    "no bin": ("room.gltf", gltf(buffers=[{"uri": "room.bin", "byteLength": 9}]), "'room.bin' does not exist"),
    "bin elsewhere": ("room.gltf", gltf(buffers=[FAR]), "does not stay inside"),
    "bin on the net": ("room.gltf", gltf(buffers=[FAR | {"uri": "https://x/y.bin"}]), "does not exist"),
    "bin damaged": ("room.gltf", gltf(buffers=[FAR | {"uri": "data:;base64,@@"}]), "damaged"),
    "bin short": ("room.gltf", gltf(buffers=[{"uri": "data:;base64,AAAA", "byteLength": 9999}]), "ends after 3 of"),
    "buffer number": ("room.gltf", gltf(bufferViews=[{"buffer": 7}]), "names buffer 7 of 1"),
    "accessor too long": (
        "room.gltf", gltf(accessors=[{"bufferView": 0, "componentType": 5126, "count": 10**9, "type": "VEC3"}] * 2),
        "faces",
    ),
    "node bomb": ("room.gltf", gltf(nodes=[{"mesh": 0}] * 6000), "6000 nodes"),
    "face bomb": ("room.gltf", gltf(
        nodes=[{"mesh": 0}] * 4000, meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}] * 60}]
    ), "faces"),
    "obj index": ("room.obj", OBJ + "f 1 2 999\n", "names corner 999 of"),
    "obj index 0": ("room.obj", OBJ + "f 0 1 2\n", "names corner 0 of"),
    "obj negative index": ("room.obj", OBJ + "f -1 -2 -999\n", "names corner -999 of"),
    "obj nan": ("room.obj", OBJ.replace("v 0.0", "v nan", 1), "not finite"),
    "obj inf": ("room.obj", OBJ.replace("v 0.0", "v inf", 1), "not finite"),
    "obj short line": ("room.obj", OBJ + "v 1 2\n", "line"),
    "obj words": ("room.obj", OBJ + "v a b c\n", "cannot be read"),
    "obj points": ("room.obj", "v 0 0 0\nv 1 0 0\n", "no triangles"),
    "obj is binary": ("room.obj", bytes(range(256)) * 20, "no triangles"),
    "stl cut": ("room.stl", stl(BOX.vertices[BOX.faces], 99), ""),
    "stl nan": ("room.stl", stl(replaced(BOX.vertices, (0, 0), np.nan)[BOX.faces]), "not finite"),
    "stl text": ("room.stl", "solid\nfacet\nendsolid\n", ""),
    "ply cut": ("room.ply", ply(BOX.vertices, BOX.faces)[:-40], ""),
    "ply index": ("room.ply", ply(BOX.vertices, replaced(BOX.faces, (0, 0), 999)), "names vertex 999 of"),
    "ply nan": ("room.ply", ply(replaced(BOX.vertices, (0, 0), np.nan), BOX.faces), "not finite"),
    "ply far": ("room.ply", ply(replaced(BOX.vertices, (0, 0), 1e30), BOX.faces), "and 1e+09 is the most"),
    "millimetres": ("room.ply", ply(1e3 * BOX.vertices, BOX.faces), "--units mm"),
    "kilometres": ("room.ply", ply(1e-3 * BOX.vertices, BOX.faces), "give --units"),
    "lines only": ("room.ply", ply(BOX.vertices * [1.0, 0.0, 0.0], BOX.faces), "no triangle of the file has an area"),
    "one wall": ("room.ply", ply(BOX.vertices * [1.0, 1.0, 0.0], BOX.faces), ""),
    "svg laughs": ("room.svg", LAUGHS, "defines entities"),
    "svg laughs in UTF-16": ("room.svg", LAUGHS.encode("utf-16"), "defines entities"),
    "svg is html": ("room.svg", "<html></html>", "is no SVG"),
    "svg broken": ("room.svg", "<svg><g>", "not readable SVG"),
    "svg curves": ("room.svg", '<svg><path d="M 0 0 C 1 1 2 2 3 3"/></svg>', "curves"),
    "svg nothing": ("room.svg", "<svg><text>room</text></svg>", "no lines"),
    "svg points": ("room.svg", '<svg><polygon points="1,2 3"/></svg>', "give x,y pairs"),
    "svg skew": ("room.svg", '<svg><rect width="4" height="3" transform="skewX(3)"/></svg>', "transform 'skewX'"),
    "svg circle": ("room.svg", '<svg><circle class="room" r="3"/></svg>', "a circle"),
    "svg copy": ("room.svg", '<svg><defs><rect id="r" width="4" height="3"/></defs><use href="#r"/></svg>', "'use'"),
    "svg in svg": ("room.svg", '<svg><svg x="3"><rect width="4" height="3"/></svg></svg>', "within the drawing"),
    "svg round": ("room.svg", '<svg><rect width="4" height="3" rx="1"/></svg>', "round corners"),
    "svg percent": ("room.svg", '<svg><rect width="60%" height="3"/></svg>', "width = '60%'"),
    "svg hidden": ("room.svg", '<svg><g style="display:none"><rect width="4" height="3"/></g></svg>', "no lines"),
    "svg deep": ("room.svg", "<svg>" + "<g>" * 300 + "</g>" * 300 + "</svg>", "groups 200 deep"),
    "svg door in the air": (
        "room.svg", '<svg><rect width="4" height="3"/><line class="door" x1="1" y1="1.5" x2="2" y2="1.5"/></svg>',
        "lies on no wall",
    ),
    "geojson words": ("room.geojson", "hello", "not readable GeoJSON"),
    "geojson point": ("room.geojson", '{"type": "Point", "coordinates": [1, 2]}', "type 'Point'"),
    "geojson no numbers": ("room.geojson", '{"type": "LineString", "coordinates": [["a", "b"]]}', "coordinates"),
    "geojson degrees": (
        "room.geojson",
        '{"type": "Polygon", "coordinates": [[[13.4, 52.5], [13.40005, 52.5], [13.40005, 52.50004]]]}',
        "longitude and latitude",
    ),
    "geojson material": (
        "room.geojson", '{"type": "Feature", "properties": {"kind": "wall", "material": "itu:cheese"}, "geometry": '
        '{"type": "LineString", "coordinates": [[0, 0], [4, 0]]}}', "give one of ",
    ),
    "geojson kind": (
        "room.geojson", '{"type": "Feature", "properties": {"kind": "sofa"}, "geometry": '
        '{"type": "Polygon", "coordinates": [[[0, 0], [4, 0], [4, 3]]]}}', "no room and no wall",
    ),
}  # fmt: skip


@pytest.fixture
def refuses(tmp_path: Path) -> Callable[[Path, str], None]:
    """Importing a file ends in one line of exit code 2 that names it, and the folder is as before."""

    def check(file: Path, says: str) -> None:
        before = sorted(path.name for path in tmp_path.iterdir())
        with pytest.raises(RislamError) as caught:
            import_room(file, tmp_path / "made", ImportOptions())
        line = str(caught.value)
        assert says in line
        assert line.startswith(str(file))
        assert "; " in line  # the mend
        assert line.isprintable()
        assert len(line) < 600
        assert caught.value.exit_code == 2
        assert sorted(path.name for path in tmp_path.iterdir()) == before

    return check


@pytest.mark.parametrize("case", BAD)
def test_bad_file(case: str, tmp_path: Path, refuses: Callable[[Path, str], None]) -> None:
    name, content, says = BAD[case]
    text = json.dumps(content) if isinstance(content, dict) else content
    (tmp_path / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    refuses(tmp_path / name, says)


def test_no_file_a_folder_and_too_large_a_one(tmp_path: Path, refuses: Callable[[Path, str], None]) -> None:
    refuses(tmp_path / "missing.glb", "no such file")
    (tmp_path / "folder.glb").mkdir()
    refuses(tmp_path / "folder.glb", "is a folder")
    os.mkfifo(tmp_path / "pipe.obj")
    refuses(tmp_path / "pipe.obj", "is a pipe or a device")
    with (tmp_path / "large.stl").open("wb") as file:
        file.truncate(200_000_001)
    refuses(tmp_path / "large.stl", "larger than")


def test_what_lies_on_a_map_is_brought_near_as_the_line_says(
    tmp_path: Path, refuses: Callable[[Path, str], None]
) -> None:
    """Coordinates of UTM, of a mesh and of a floor plan: an origin is proposed, and with it the room is made."""
    place = np.array([500_000.0, 5_400_000.0, 120.0])
    (tmp_path / "far.obj").write_text(
        "".join("v {:.3f} {:.3f} {:.3f}\n".format(*point) for point in BOX.vertices + place)
        + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in BOX.faces)
    )
    corners = [[500_000 + x, 5_400_000 + y] for x, y in ((0, 0), (4, 0), (4, 3), (0, 3), (0, 0))]
    (tmp_path / "far.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [corners]}))
    for name, origin in (("far.obj", (500_000.0, 5_400_000.0, 120.0)), ("far.geojson", (500_000.0, 5_400_000.0, 0.0))):
        said = ",".join(f"{value:.0f}" for value in origin)
        refuses(tmp_path / name, f"from the zero of its coordinates, and 100000 m are the most; give --origin {said}, ")
        folder = tmp_path / f"room-{name}"
        import_room(tmp_path / name, folder, ImportOptions(origin=origin))
        low, high = load_scene(folder).bounds
        assert np.abs(np.stack([low, high])).max() < 10.0


def test_a_name_that_is_no_text_is_written_as_well_as_it_goes(tmp_path: Path) -> None:
    file = tmp_path / os.fsdecode(b"B\xfcro.obj")
    file.write_text(OBJ)
    import_room(file, tmp_path / "made", ImportOptions())
    assert "Made from `B?ro.obj`" in (tmp_path / "made" / "README.md").read_text()


def test_the_same_box_sound_is_a_room(tmp_path: Path) -> None:
    """What the cases above are damaged copies of; a material library that is missing is a remark alone."""
    files = {"a.gltf": json.dumps(gltf()).encode(), "b.stl": stl(BOX.vertices[BOX.faces])}
    files |= {"c.ply": ply(BOX.vertices, BOX.faces), "d.obj": ("mtllib gone.mtl\nusemtl Oak\n" + OBJ).encode()}
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        remarks = import_room(tmp_path / name, tmp_path / name[0], ImportOptions())
        assert len(load_scene(tmp_path / name[0]).reflectors) == 6
    assert any("gone.mtl" in line for line in remarks)
    assert load_scene(tmp_path / "d").reflectors[0].material.itu == "wood"


def test_a_folder_that_exists_stays_as_it_is(tmp_path: Path, refuses: Callable[[Path, str], None]) -> None:
    (tmp_path / "room.ply").write_bytes(ply(BOX.vertices, BOX.faces))
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "mine.txt").write_text("mine")
    with pytest.raises(RislamError, match="exists already"):
        import_room(tmp_path / "room.ply", tmp_path / "made", ImportOptions())
    assert [path.name for path in (tmp_path / "made").iterdir()] == ["mine.txt"]
