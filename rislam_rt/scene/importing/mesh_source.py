"""Source of imported meshes: files (GLB, glTF, OBJ, PLY, STL) as triangles with names of node and material."""

import base64
import json
import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.findings import Fault, one_line
from rislam_rt.scene.importing.obj_files import read_obj
from rislam_rt.scene.meshes import MAX_MESH_BYTES, Mesh, MeshReader, check_glb, node_mesh, sound_mesh, unfold
from rislam_rt.scene.scene_folder import read_inside

MESH_FORMATS = (".glb", ".gltf", ".obj", ".ply", ".stl")
"""Endings of the mesh files that can be imported."""
MAX_IMPORT_FACES = 2_000_000
"""Most triangles of an imported mesh file."""
MAX_IMPORT_NODES = 5_000
"""Most nodes of an imported GLB or glTF file: reading takes time in proportion to their square."""
ANY_UNIT = 1e9
"""Largest coordinate of an imported file whose unit is not known yet: 1000 km in millimetres."""
_COMPRESSED = ("draco", "meshopt", "quantization")


@dataclass(frozen=True, slots=True, eq=False)
class MeshPart:
    """Triangles of one node and one material of an imported mesh file."""

    node: str
    material: str
    triangles: Floats
    """(T, 3, 3) in the file's units and axes."""


def read_source(path: Path) -> tuple[list[MeshPart], list[str]]:
    """Read the parts of a mesh file to import, one a node and material, and remarks on what it names and lacks.

    Raises
    ------
    Fault
        Missing, too large, of no known format, damaged, or without a triangle.
    """
    suffix = path.suffix.lower()
    if suffix not in MESH_FORMATS:
        known = ", ".join((*MESH_FORMATS, ".geojson", ".svg", ".xml"))
        if path.is_dir():
            raise Fault("is a folder", f"give a file: {known}")
        raise Fault(f"files of kind '{one_line(suffix)[:12]}' cannot be read", f"give one of {known}")
    content = read_content(path)
    notes: list[str] = []
    if suffix in (".glb", ".gltf"):
        parts = _from_gltf(content, suffix, path.parent)
    elif suffix == ".obj":
        found, library = read_obj(content)
        loose = [Mesh(t.reshape(-1, 3), np.arange(3 * len(t)).reshape(-1, 3)) for _, _, t in found]
        parts = [_part(group, material, mesh) for (group, material, _), mesh in zip(found, loose, strict=True)]
        if library and not (path.parent / library).is_file():
            notes.append(f"'{library[:60]}' is not there: materials are known by their names in the OBJ file alone")
    else:
        mesh = MeshReader().parse(content, path.name, max_faces=MAX_IMPORT_FACES, reach=ANY_UNIT)
        parts = [MeshPart("", "", mesh.triangles)]
    if not parts:
        raise Fault("the file has no triangles", "export it with its meshes")
    return parts, notes


def read_content(path: Path, limit: int = MAX_MESH_BYTES) -> bytes:
    """Read the content of a mesh file to import, up to a limit [bytes].

    Raises
    ------
    Fault
        There is none, it is too large, or the system refuses.
    """
    if path.is_dir():
        raise Fault("is a folder", "give a file in it")
    if not path.is_file():
        if path.exists():
            raise Fault("is a pipe or a device, not a file", "copy what it gives into a file")
        raise Fault("no such file", "mend the path")
    try:
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            content = file.read(limit + 1) if size <= limit else b""
    except OSError as error:
        raise Fault(f"cannot be read ({error.strerror})", "check its permissions") from None
    if max(size, len(content)) > limit:
        raise Fault(f"larger than {limit} bytes", "simplify it, or export without textures")
    if not content:
        raise Fault("the file is empty", "export it again")
    return content


def _part(node: str, material: str, mesh: Mesh) -> MeshPart:
    """Part of an imported mesh file after a check of its coordinates."""
    return MeshPart(node, material, sound_mesh(mesh, MAX_IMPORT_FACES, ANY_UNIT).triangles)


def _from_gltf(content: bytes, suffix: str, folder: Path) -> list[MeshPart]:
    """Read the parts of a glTF or GLB mesh, its buffers from beside it, pictures left where they are."""
    content = _plain_glb(content) if suffix == ".glb" else _joined_glb(content, folder)
    check_glb(content, MAX_IMPORT_FACES, MAX_IMPORT_NODES)
    loaded = unfold(content, "glb")
    parts = []
    for name in loaded.graph.nodes_geometry:
        mesh, geometry = node_mesh(loaded, name)
        if len(mesh.faces):
            material = getattr(getattr(geometry.visual, "material", None), "name", None)
            parts.append(_part(str(name), str(material or ""), mesh))
    return parts


def _plain_glb(content: bytes) -> bytes:
    """Content of a GLB mesh file without its pictures: the same chunks, another table of contents."""
    try:
        magic, version, length, size, kind = struct.unpack_from("<4sIII4s", content)
    except struct.error:
        raise Fault("not a GLB file: too short", "export it again") from None
    if magic != b"glTF" or kind != b"JSON":
        raise Fault("not a GLB file: its head says something else", "export it as binary glTF (.glb)")
    if version != 2:
        raise Fault(f"glTF of version {version}", "export it as glTF 2.0")
    if length > len(content):
        raise Fault(f"the file ends after {len(content)} of {length} bytes", "copy or export it again")
    document = _without_pictures(content[20 : 20 + size])
    return _glb(document, content[20 + size : length])


def _joined_glb(content: bytes, folder: Path) -> bytes:
    """Join a glTF mesh file and its buffers into the content of one GLB file."""
    document = _without_pictures(content)
    data, starts = b"", []
    for number, buffer in enumerate(_rows(document, "buffers")):
        uri = buffer.get("uri")
        if not isinstance(uri, str):
            raise Fault(f"buffer {number} names no file", "export it again, or as .glb")
        found = _embedded(uri) if uri.startswith("data:") else read_inside(folder, uri, MAX_MESH_BYTES)
        if len(found) < int(buffer.get("byteLength", 0)):
            raise Fault(f"'{uri[:60]}' ends after {len(found)} of {buffer['byteLength']} bytes", "copy it again")
        starts.append(len(data))
        data += found + b"\0" * (-len(found) % 4)
        if len(data) > MAX_MESH_BYTES:
            raise Fault(f"its buffers are larger than {MAX_MESH_BYTES} bytes", "simplify the mesh")
    for view in _rows(document, "bufferViews"):
        number = view.get("buffer", 0)
        if not isinstance(number, int) or not 0 <= number < len(starts):
            raise Fault(f"a view names buffer {number!r} of {len(starts)}", "export it again")
        view["byteOffset"] = view.get("byteOffset", 0) + starts[number]
        view["buffer"] = 0
    document["buffers"] = [{"byteLength": len(data)}]
    return _glb(document, struct.pack("<I4s", len(data), b"BIN\0") + data)


def _embedded(uri: str) -> bytes:
    """Decode a buffer that stands inside a glTF mesh file in base64."""
    try:
        return base64.b64decode(uri.partition(",")[2], validate=True)
    except ValueError:
        raise Fault("a buffer inside the file is damaged", "export it again, or as .glb") from None


def _glb(document: dict[str, Any], rest: bytes) -> bytes:
    """Content of a GLB mesh file with this table of contents and the rest of its chunks."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest


def _without_pictures(text: bytes) -> dict[str, Any]:
    """Table of contents of a glTF mesh file without pictures; materials keep their names alone."""
    try:
        document = json.loads(text)
        if not isinstance(document, dict):
            raise ValueError("no table")
    except (ValueError, RecursionError) as error:
        raise Fault(f"its JSON cannot be read ({one_line(str(error))[:60]})", "copy or export it again") from None
    wanted = " ".join(str(name) for name in document.get("extensionsRequired", []))
    if any(word in wanted.lower() for word in _COMPRESSED):
        raise Fault(f"the meshes are packed ({one_line(wanted)[:60]})", "export without compression")
    for key in ("images", "textures", "samplers", "animations", "skins", "cameras", "extensionsRequired"):
        document.pop(key, None)
    document["materials"] = [{"name": str(m.get("name", ""))} for m in _rows(document, "materials")]
    for mesh in _rows(document, "meshes"):
        for part in mesh.get("primitives", []):
            if isinstance(part, dict) and isinstance(part.get("attributes"), dict):
                part["attributes"] = {k: v for k, v in part["attributes"].items() if k == "POSITION"}
    return document


def _rows(document: dict[str, Any], key: str) -> list[dict[str, Any]]:
    """List of tables under a key in the table of contents of a glTF mesh file."""
    rows = document.get(key, [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise Fault(f"'{key}' is no list of tables", "export it again")
    return rows
