"""Checks of mesh files (GLB, PLY) before they are parsed: how much they hold, and what they refer to."""

import json
import re
import struct
from collections import Counter
from typing import Any

from rislam_rt.scene.findings import Fault

MAX_HEADER = 100_000
"""Most bytes of a PLY file's header."""

_PLY_NOTE = re.compile(rb"^(?:comment|obj_info)(?:[ \t][^\r\n]*)?(?:\r\n|\r|\n)", re.MULTILINE)


def without_comments(content: bytes) -> bytes:
    """Content of a PLY file without its header's comments: the reader would look for a texture named there."""
    end = content.find(b"end_header", 0, MAX_HEADER)
    return content if end < 0 else _PLY_NOTE.sub(b"", content[:end]) + content[end:]


def too_many_faces(count: int, limit: int) -> Fault:
    """Error for a mesh with more faces than the scene file's limit."""
    return Fault(
        f"{count} faces, and check and trace take time in proportion to them",
        f"simplify the mesh, or raise limits.faces = {limit} in the scene file",
    )


def check_glb(content: bytes, max_faces: int, max_nodes: int) -> None:
    """Refuse a GLB mesh file whose nodes are too many, or, each mesh counted as often as a node names it, have too many
    faces.

    What cannot be read as a GLB file passes: the reader will say what is wrong with it.

    Raises
    ------
    Fault
        There are too many.
    """
    document = _document(content)
    try:
        nodes, meshes, accessors = (list(document.get(key, [])) for key in ("nodes", "meshes", "accessors"))
        uses = Counter(node["mesh"] for node in nodes if isinstance(node, dict) and "mesh" in node)
        faces = sum(times * _num_faces(meshes[mesh], accessors) for mesh, times in uses.items())
    except (TypeError, KeyError, IndexError, AttributeError, ValueError, OverflowError):
        return
    if len(nodes) > max_nodes:
        raise Fault(
            f"{len(nodes)} nodes, and reading takes time in proportion to their square",
            f"join them, or raise limits.nodes = {max_nodes} in the scene file",
        )
    if faces > max_faces:
        raise too_many_faces(faces, max_faces)


def _document(content: bytes) -> dict[str, Any]:
    """Table of contents (JSON chunk) of a GLB mesh file; empty if there is none."""
    try:
        magic, _, _, length, kind = struct.unpack_from("<4sIII4s", content)
        found = json.loads(content[20 : 20 + length]) if (magic, kind) == (b"glTF", b"JSON") else {}
    except (struct.error, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _num_faces(mesh: Any, accessors: list[Any]) -> int:
    """Number of triangles of a GLB file's mesh: a third of its indices, or of its corners where it has none."""
    total = 0
    for part in mesh["primitives"]:
        number = part["indices"] if "indices" in part else part["attributes"]["POSITION"]
        total += max(int(accessors[number]["count"]), 0) // 3
    return total
