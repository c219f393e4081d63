"""Hostile and broken input: always a SceneError with one line that names the file and the field."""

import contextlib
import os
import struct
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rislam_rt.errors import SceneError
from rislam_rt.scene import check_scene, load_scene
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.meshes import FORMATS, MeshReader, ply_bytes
from rislam_rt.scene.schema import parse_spec, validate_spec

Damage = Callable[[str, str], Path]
CORNERS = np.array([[0.0, 0.0, 0.0], [6.0, 0.0, 0.0], [6.0, 6.0, 0.0], [0.0, 6.0, 0.0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])
MESH = 'mesh = "meshes/floor.ply"'


def refusal(folder: Path) -> str:
    """The one line that both the loader and the check answer with."""
    with pytest.raises(SceneError) as caught:
        load_scene(folder)
    line = str(caught.value)
    assert "\n" not in line
    assert line.isprintable()
    assert line.startswith(f"{folder}/scene.toml: ")
    assert len(line) < 1000
    errors = [finding.line for finding in check_scene(folder) if finding.severity == "error"]
    assert line.startswith(errors[0])
    return line


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('name = "paper_room"', "", "name: missing"),
        ('name = "paper_room"', "name = 3", "name: 3 received"),
        ('name = "paper_room"', 'name = "a\\nb"', "name: 'a\\nb' received, give letters"),
        ('name = "paper_room"', 'name = "paper_room"\nretangle = 1', "retangle: unknown key"),
        ("host =", "hots =", "ris.hots: unknown key (did you mean 'host'?)"),
        ("radius = 0.05", "radius = -0.05", "scatterer[0].radius: -0.05 received"),
        ("radius = 0.05", "", "scatterer[0]: give 'radius' or 'rcs_m2'"),
        ("radius = 0.05", "rcs_m2 = nan", "scatterer[0].rcs_m2: nan received"),
        ("reflection = 0.85", "reflection = 1.5", "reflector[0].material.reflection: 1.5 received"),
        (
            "reflection = 0.85",
            "",
            "reflector[0].material: give one of 'reflection', 'itu', 'permittivity' and 'reflection_te'",
        ),
        ("reflection = 0.85", 'itu = "cheese"', "reflector[0].material.itu: 'cheese' received"),
        ("rows = 6", "rows = 0", "ris.rows: 0 received"),
        ("rows = 6", "rows = 6.5", "ris.rows: 6.5 received"),
        ("rows = 6", "rows = true", "ris.rows: True received"),
        ("rows = 6", f"rows = {10**30}", "ris.rows: 1000"),
        ("spacing_m = [0.015, 0.015]", "spacing_m = [0.015]", "ris.spacing_m"),
        ("spacing_m = [0.015, 0.015]", "spacing_m = [-0.015, 0.015]", "ris.spacing_m[0]: -0.015 received"),
        ("levels = 4", "levels = 1", "ris.levels: 1 received"),
        ('element = "tang"', 'element = "tong"', "ris.element: 'tong' received"),
        ("normal = [0.0, 0.0, -1.0]", "normal = [0.0, 0.0, 0.0]", "has no length"),
        ("up = [0.0, 1.0, 0.0]", "up = [0.0, 1.0, 1.0]", "135.000 degrees from ris.normal"),
        ("start = [0.5, 0.7, 0.5]", "start = [inf, 0.7, 0.5]", "agent.start[0]: inf received"),
        ("start = [0.5, 0.7, 0.5]", 'start = ["a", 0.7, 0.5]', "agent.start[0]: 'a' received"),
        ("start = [0.5, 0.7, 0.5]", "start = [1e300, 0.7, 0.5]", "agent.start[0]: 1e+300 received"),
        ("start = [0.5, 0.7, 0.5]", "start = {x = 1}", "agent.start"),
        ("cycles = 600", "cycles = 100000000000", "agent.cycles"),
        ("cycle_s = 0.1", "cycle_s = 0.0", "agent.cycle_s: 0.0 received"),
        (
            "velocity = [0.0707, 0.0707, 0.0]",
            "",
            "agent: give one of 'velocity', 'trajectory', 'waypoints', 'random_walk'",
        ),
        ("tx_offset_m = [-0.04388, -0.02397, 0.0]", "tx_offset_m = [0.04388, 0.02397, 0.0]", "Tx and Rx coincide"),
        ('name = "paper_room"', "name = ", "not valid TOML"),
        ('name = "paper_room"', "x = " + "[" * 5000, "not valid TOML"),
        ('name = "paper_room"', "x = " + "9" * 5000, "not valid TOML"),
    ],
)
def test_bad_field(damaged: Damage, old: str, new: str, says: str) -> None:
    assert says in refusal(damaged(old, new))


def test_every_bad_field_is_a_line(damaged: Damage) -> None:
    damaged("rows = 6", "rows = -6")
    damaged("levels = 4", "levls = 4")
    with pytest.raises(SceneError) as caught:
        load_scene(damaged("radius = 0.05", "radius = -1.0"))
    lines = caught.value.lines
    assert len(lines) == 3
    for field in ("ris.rows: -6", "ris.levls: unknown", "scatterer[0].radius: -1.0"):
        assert sum(field in line for line in lines) == 1, field
    assert str(caught.value).endswith("(and 2 more)")


@pytest.mark.parametrize(
    ("mesh", "says"),
    [
        ("meshes/none.ply", "does not exist"),
        ("../outside.ply", "does not stay inside"),
        ("meshes/../../outside.ply", "does not stay inside"),
        ("/etc/passwd", "does not stay inside"),
        ("..\\\\outside.ply", "does not stay inside"),
        ("", "does not stay inside"),
        ("meshes/a\\u0000b.ply", "does not stay inside"),
        ("meshes", "is not a file"),
        ("scene.toml", "no known mesh format"),
        ("meshes/floor.ply#node", "only GLB files have"),
        ("x" * 5000 + ".ply", "cannot be read"),
    ],
)
def test_mesh_path(damaged: Damage, mesh: str, says: str) -> None:
    room = damaged(MESH, f'mesh = "{mesh}"')
    (room.parent / "outside.ply").write_bytes(ply_bytes(CORNERS, FACES))
    line = refusal(room)
    assert "reflector[0].mesh (floor)" in line
    assert says in line


def test_mesh_behind_a_link(room: Path) -> None:
    inside, outside = room / "meshes/floor.ply", room.parent / "outside.ply"
    inside.rename(outside)
    inside.symlink_to(outside)
    assert "leads out of the scene's folder" in refusal(room)
    inside.unlink()
    inside.symlink_to(inside)
    assert "reflector[0].mesh (floor)" in refusal(room)
    inside.unlink()
    inside.symlink_to(room / "meshes/ceiling.ply")  # a link within the folder is the user's own business
    assert len(load_scene(room).reflectors) == 6


def test_mesh_is_a_pipe(room: Path) -> None:
    (room / "meshes/floor.ply").unlink()
    os.mkfifo(room / "meshes/floor.ply")
    assert "is not a file" in refusal(room)


def _ply(header: str, body: bytes = b"") -> bytes:
    return b"ply\nformat binary_little_endian 1.0\n" + header.encode() + b"end_header\n" + body


_XYZ = "property double x\nproperty double y\nproperty double z\n"
_LIST = "property list uchar int vertex_indices\n"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "not a readable PLY"),
        (b"ply\n", "not a readable PLY"),
        (bytes(range(256)) * 40, "not a readable PLY"),
        (ply_bytes(CORNERS, FACES)[:-1], ""),
        (ply_bytes(CORNERS, FACES)[:150], "not a readable PLY"),
        (ply_bytes(CORNERS, FACES[:0]), "no faces"),
        (ply_bytes(CORNERS[:0], FACES[:0]), "no faces"),
        (ply_bytes(CORNERS, FACES + 2), "a face names vertex 5 of 4"),
        (ply_bytes(CORNERS, FACES - 1), "a face names vertex -1 of 4"),
        (ply_bytes(CORNERS, FACES * 2**29), "a face names vertex"),
        (ply_bytes(CORNERS * np.nan, FACES), "is not finite"),
        (ply_bytes(np.where(CORNERS > 0, np.inf, CORNERS), FACES), "is not finite"),
        (ply_bytes(CORNERS * 1e30, FACES), "a coordinate of"),
        (ply_bytes(CORNERS * 0.0, FACES), "without area"),
        (_ply(f"element vertex 999999999\n{_XYZ}element face 999999999\n{_LIST}"), "not a readable PLY"),
        (_ply(f"element vertex {10**25}\n{_XYZ}element face 1\n{_LIST}"), "not a readable PLY"),
        (_ply(f"element vertex -3\n{_XYZ}element face 1\n{_LIST}", b"\0" * 99), ""),
        (_ply(f"element vertex 3\n{_XYZ}element face 1\n{_LIST}", b"\0" * 72 + b"\xff" + b"\1" * 40), ""),
        (
            b"ply\nformat ascii 1.0\nelement vertex 3\n" + _XYZ.encode() + b"end_header\n0 0 0\n1 0 0\n0 1 0\n",
            "no faces",
        ),
    ],
)
def test_damaged_ply(room: Path, content: bytes, says: str) -> None:
    (room / "meshes/floor.ply").write_bytes(content)
    line = refusal(room)
    assert "(floor)" in line
    assert says in line


@pytest.mark.parametrize("suffix", [".obj", ".stl", ".glb"])
@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\0" * 84,
        b"\0" * 80 + struct.pack("<I", 2**32 - 1),
        b"solid x\nfacet normal 0 0 1\nouter loop\nvertex nan 0 0\n",
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n",
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9 -2 -1\n",
        b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        b"mtllib /etc/passwd\nusemtl x\n",
        b"glTF" + struct.pack("<II", 2, 2**31) + struct.pack("<I", 2**31 - 1) + b"JSON",
        b"glTF" + struct.pack("<II", 2, 40) + struct.pack("<I", 20) + b"JSON" + b'{"asset":{},"a":[]} ',
        b"glTF" + struct.pack("<II", 2, 1020) + struct.pack("<I", 1000) + b"JSON" + b"[" * 1000,
    ],
)
def test_damaged_mesh_of_other_formats(damaged: Damage, suffix: str, content: bytes) -> None:
    room = damaged(MESH, f'mesh = "meshes/floor{suffix}"')
    (room / f"meshes/floor{suffix}").write_bytes(content)
    assert "(floor)" in refusal(room)


def test_glb_may_not_reach_for_other_files(damaged: Damage) -> None:
    """A buffer outside the file is refused, not followed."""
    room = damaged(MESH, 'mesh = "meshes/floor.glb"')
    (room / "meshes/data.bin").write_bytes(CORNERS[:3].astype("<f4").tobytes() + FACES[:1].astype("<u4").tobytes())
    text = (
        b'{"asset":{"version":"2.0"},"buffers":[{"uri":"data.bin","byteLength":48}],"bufferViews":[{"buffer":0,'
        b'"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":12}],"accessors":[{"bufferView":0,'
        b'"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5125,"count":3,'
        b'"type":"SCALAR"}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],'
        b'"nodes":[{"mesh":0,"name":"n"}],"scenes":[{"nodes":[0]}],"scene":0}'
    )
    text += b" " * (-len(text) % 4)
    head = b"glTF" + struct.pack("<II", 2, 20 + len(text)) + struct.pack("<I", len(text)) + b"JSON"
    (room / "meshes/floor.glb").write_bytes(head + text)
    assert "not a readable GLB" in refusal(room)


@pytest.mark.parametrize("content", [b"\xff\xfe\0", b"", b"[" * 100_000, b"a" * 5_000_000], ids=["utf", "0", "[", "5M"])
def test_scene_file_that_is_none(room: Path, content: bytes) -> None:
    (room / "scene.toml").write_bytes(content)
    refusal(room)


def test_no_scene_at_all(tmp_path: Path) -> None:
    assert "no such scene file" in refusal(tmp_path)
    assert "did you mean 'two_scatterers'" in refusal(tmp_path / "two_scaterers")
    (tmp_path / "scene.toml").mkdir()
    assert "no such scene file" in refusal(tmp_path)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (b"", "holds no pose"),
        (b"# only a comment\n", "holds no pose"),
        (b"0 1 1 1 0 0 0\n", "line 1 of the trajectory"),
        (b"0 1 1 1 0 0 0 1\n1 1 nan 1 0 0 0 1\n", "line 2 of the trajectory"),
        (b"0 1 1 1 0 0 0 1\n0 1 1 1 0 0 0 1\n", "time does not grow at pose 1"),
        (b"0 1 1 1 0 0 0 2\n", "quaternion of pose 0"),
        (b"0 1 1 1 0.7071068 0 0 0.7071068\n", "pose 0 is tilted"),
        (b"0 1 1 1e9 0 0 0 1\n", "a coordinate of 1e+09 m"),
        (b"\xff\xfe\x00", "line 1 of the trajectory"),
        (b"0 1 1 1 0 0 0 1\n1 2 1 7 0 0 0 1\n", "outside the meshes' bounds"),
    ],
)
def test_bad_trajectory_file(damaged: Damage, text: bytes, says: str) -> None:
    damaged("start = [0.5, 0.7, 0.5]\n", "")
    damaged("cycles = 600\ncycle_s = 0.1\n", "")
    room = damaged("velocity = [0.0707, 0.0707, 0.0]", 'trajectory = "path.tum"')
    (room / "path.tum").write_bytes(text)
    line = refusal(room)
    assert "agent" in line
    assert says in line


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=8,
)
_TABLE = tomllib.loads(
    'name = "a"\nreflector = [{name = "f", mesh = "f.ply", material = {reflection = 0.5}}]\n'
    'scatterer = [{name = "s", position = [1, 1, 1], radius = 0.1}]\n'
    "agent = {start = [1, 1, 1], velocity = [0, 0, 0], cycles = 2, cycle_s = 0.1}\n"
    "[ris]\ncenter = [1, 1, 1]\nnormal = [0, 0, 1]\nup = [0, 1, 0]\nrows = 2\ncols = 2\nspacing_m = [0.1, 0.1]\n"
)


@settings(max_examples=150, deadline=None)
@given(section=st.sampled_from(["reflector", "scatterer", "ris", "agent"]), data=st.data(), value=_JSON)
def test_any_value_in_any_field_is_refused_or_read(section: str, data: st.DataObject, value: object) -> None:
    table = {key: [dict(v[0])] if isinstance(v, list) else v for key, v in _TABLE.items()}
    target = table[section][0] if isinstance(table[section], list) else dict(table[section])
    target[data.draw(st.sampled_from([*target, "unknown"]))] = value
    table[section] = [target] if isinstance(table[section], list) else target
    with contextlib.suppress(Fault):
        validate_spec(table)


@settings(max_examples=100, deadline=None)
@given(content=st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_any_bytes_are_refused_as_a_scene_file(content: bytes) -> None:
    with pytest.raises(Fault):
        parse_spec(content)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data(), suffix=st.sampled_from(FORMATS))
def test_a_flipped_mesh_is_refused_or_sound(data: st.DataObject, suffix: str) -> None:
    """Bytes changed or cut anywhere: a Fault, or a mesh whose indices and numbers hold."""
    content = bytearray(_samples()[suffix])
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    content = content[: data.draw(st.integers(0, len(content)) | st.just(len(content)))]
    with contextlib.suppress(Fault):
        mesh = MeshReader().parse(bytes(content), "a" + suffix)
        assert len(mesh.faces) > 0
        assert mesh.faces.min() >= 0
        assert mesh.faces.max() < len(mesh.vertices)
        assert np.isfinite(mesh.vertices).all()


def _samples() -> dict[str, bytes]:
    """The same square in every format."""
    if not _SAMPLES:
        import trimesh

        mesh = trimesh.Trimesh(CORNERS, FACES, process=False)
        for suffix in FORMATS:
            content = mesh.export(file_type=suffix[1:])
            _SAMPLES[suffix] = content.encode() if isinstance(content, str) else content
    return _SAMPLES


_SAMPLES: dict[str, bytes] = {}
