"""Hostile and broken input that is no text, or random: one line that names the file; the rest is in `tests/corpus`."""

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
from rislam_rt.scene.read_scene_file import parse_spec, validate_spec

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


def test_a_lone_number_for_a_list_is_told_a_list_that_works(damaged: Damage) -> None:
    folder = damaged("spacing_m = [", "spacing_m = 0.015 # [")
    assert "spacing_m: 0.015 received; give 2 numbers, spacing_m = [0.015, 0.015]" in refusal(folder)


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
        (bytes(range(256)) * 40, "not a readable PLY"),
        (ply_bytes(CORNERS, FACES)[:-1], "not a readable PLY mesh (it ends after 293 of at least 294 bytes)"),
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
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9 -2 -1\n",
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


ALPHABET = st.characters(exclude_categories=("Cs",))
"""All that UTF-8 can say, as is the default, for which a new clone reckons a second long."""
_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(ALPHABET, max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(ALPHABET, max_size=8), inner, max_size=4),
    max_leaves=8,
)
_TABLE = tomllib.loads(
    'name = "a"\nreflector = [{name = "f", mesh = "f.ply", material = {reflection = 0.5}}]\n'
    'scatterer = [{name = "s", position = [1, 1, 1], radius = 0.1}]\n'
    "agent = {start = [1, 1, 1], velocity = [0, 0, 0], cycles = 2, cycle_s = 0.1}\n"
    "[ris]\ncenter = [1, 1, 1]\nnormal = [0, 0, 1]\nup = [0, 1, 0]\nrows = 2\ncols = 2\nspacing_m = [0.1, 0.1]\n"
)


@settings(max_examples=75, deadline=None)
@given(section=st.sampled_from(["reflector", "scatterer", "ris", "agent"]), data=st.data(), value=_JSON)
def test_any_value_in_any_field_is_refused_or_read(section: str, data: st.DataObject, value: object) -> None:
    table = {key: [dict(v[0])] if isinstance(v, list) else v for key, v in _TABLE.items()}
    target = table[section][0] if isinstance(table[section], list) else dict(table[section])
    target[data.draw(st.sampled_from([*target, "unknown"]))] = value
    table[section] = [target] if isinstance(table[section], list) else target
    with contextlib.suppress(Fault):
        validate_spec(table)


@settings(max_examples=100, deadline=None)
@given(content=st.binary(max_size=200) | st.text(ALPHABET, max_size=200).map(str.encode))
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


def test_what_lies_beside_a_missing_scene_is_proposed_and_a_pipeline_is_none(room: Path, tmp_path: Path) -> None:
    assert check_scene(tmp_path / "roomm")[0].mend.startswith("did you mean 'room'? give a scene folder")
    assert check_scene(room / "meshes")[0].mend.startswith("give a scene folder")
    (tmp_path / "mine.toml").write_text('name = "mine"\nscene = "room"\ncycles = 5\n')
    assert [f.message for f in check_scene(tmp_path / "mine.toml")] == ["is a pipeline, not a scene"]


def test_a_scene_file_of_another_editor_is_read_or_told_to_be_saved_as_utf8(room: Path) -> None:
    content = (room / "scene.toml").read_bytes()
    (room / "scene.toml").write_bytes(b"\xef\xbb\xbf" + content.replace(b"\n", b"\r\n"))
    assert load_scene(room).name == "paper_room"
    (room / "scene.toml").write_bytes(content.decode().encode("utf-16"))
    assert "not text in UTF-8 (byte 0); save it as UTF-8" in refusal(room)


def test_an_obj_file_with_a_byte_order_mark_has_all_its_corners() -> None:
    content = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    expected = MeshReader().parse(content, "a.obj")
    assert np.array_equal(MeshReader().parse(b"\xef\xbb\xbf" + content, "a.obj").triangles, expected.triangles)
