"""Meshes read from the content of files (PLY, OBJ, STL, GLB) and checked, and written as PLY."""

import io
import json
import logging
import re
import struct
import warnings
from codecs import BOM_UTF8
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import PurePosixPath
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.scene.findings import Fault, one_line
from rislam_rt.scene.mesh_polygons import mixed_ply_faces, ply_faces
from rislam_rt.scene.obj_polygons import obj_with_triangles

FORMATS = (".ply", ".obj", ".stl", ".glb")
"""Endings of the mesh files that can be read."""
MAX_MESH_BYTES = 200_000_000
"""Most bytes of a mesh file."""
MAX_FACES = 50_000
"""Most faces of a scene by default: what check and trace serve within minutes; a scene file can raise it."""
MAX_COORDINATE = 1e5
"""Largest coordinate [m] of a mesh in the room."""
MAX_NODES = 1_000
"""Most nodes of a GLB file by default: reading takes time in proportion to their square."""
MAX_HEADER = 100_000
"""Most bytes of a PLY file's header."""

_PLY_NOTE = re.compile(rb"^(?:comment|obj_info)(?:[ \t][^\r\n]*)?(?:\r\n|\r|\n)", re.MULTILINE)
_PLY_HEADER = re.compile(
    rb"ply\nformat binary_little_endian 1\.0\n"
    rb"element vertex (\d{1,9})\nproperty (double|float) x\nproperty \2 y\nproperty \2 z\n"
    rb"element face (\d{1,9})\nproperty list uchar int vertex_ind(?:ices|ex)\nend_header\n"
)
_PLY_FACE = np.dtype([("count", "u1"), ("corner", "<i4", 3)])


class Mesh(NamedTuple):
    """A triangle mesh, vertices and faces as they stand in the file: neither merged nor reordered."""

    vertices: Floats
    """(V, 3) [m]."""
    faces: Integers
    """(F, 3) indices into `vertices`."""

    @property
    def triangles(self) -> Floats:
        """Corners (F, 3, 3) [m] of a mesh's faces: face, corner, xyz."""
        return self.vertices[self.faces]


def as_mesh(triangles: Floats) -> Mesh:
    """Make triangles (T, 3, 3) a mesh with shared corners."""
    vertices, index = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return Mesh(vertices, index.reshape(-1, 3).astype(np.int64))


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Join several meshes into one, their vertices and faces in order."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


_EMPTY = Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))


class MeshReader:
    """Parser of mesh files that keeps the last file parsed: a scene picks many nodes of one GLB file."""

    def __init__(self) -> None:
        self._key: tuple[str, bytes] = ("", b"")
        self._loaded: Any = None

    def parse(
        self, content: bytes, name: str, node: str | None = None, max_faces: int = MAX_FACES,
        max_nodes: int = MAX_NODES, reach: float = MAX_COORDINATE,
    ) -> Mesh:  # fmt: skip
        """Parse a mesh file's content into triangles; `node` picks one named node of a GLB file.

        What is too large is refused before it is unfolded: a GLB file may name one mesh in thousands of nodes. `reach`
        is the largest coordinate in the file's unit. Polygons of OBJ and PLY files become triangles, concave ones too.

        Raises
        ------
        Fault
            The content is not a mesh of that format, or it is damaged, empty or too large.
        """
        suffix = PurePosixPath(name).suffix.lower()
        if suffix not in FORMATS:
            raise Fault(f"'{name[:80]}' is of no known mesh format", f"give one of {', '.join(FORMATS)}")
        if node is not None and suffix != ".glb":
            raise Fault(f"'{name[:80]}#{node[:40]}' picks a node, which only GLB files have", "leave the '#' part out")
        if suffix == ".ply":
            content = without_comments(content)
        elif suffix == ".obj":
            # keywords and numbers are ASCII, comments are anything
            content = obj_with_triangles(content.removeprefix(BOM_UTF8)).decode("latin-1").encode()
        elif suffix == ".glb":
            check_glb(content, max_faces, max_nodes)
        mesh = _own_ply(content) if suffix == ".ply" else None
        if mesh is None and suffix == ".ply":
            mixed = mixed_ply_faces(content)  # first: trimesh may read these at the wrong places without an error
            mesh = Mesh(*mixed) if mixed else None
        if mesh is None:
            if self._key != (suffix, content):
                self._loaded, self._key = unfold(content, suffix[1:]), (suffix, content)
            with _errors_as_faults(suffix[1:], _mend(content, suffix[1:])):
                cut = ply_faces(self._loaded) if suffix == ".ply" else None
                mesh = Mesh(*cut) if cut else _flatten(self._loaded, node)
        return sound_mesh(mesh, max_faces, reach)


def unfold(content: bytes, file_type: str) -> Any:
    """Parse a mesh file's content into trimesh's scene of nodes; of bytes, so that it follows no reference to a file.

    Raises
    ------
    Fault
        It cannot be read.
    """
    import trimesh

    with _errors_as_faults(file_type, _mend(content, file_type)):
        return trimesh.load_scene(io.BytesIO(content), file_type=file_type, process=False)


def ply_bytes(vertices: Floats, faces: Integers) -> bytes:
    """Content of a binary PLY file in float64 for a mesh, the same bytes for the same mesh."""
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.empty(len(faces), dtype=_PLY_FACE)
    rows["count"] = 3
    rows["corner"] = faces
    return header.encode() + np.ascontiguousarray(vertices, dtype="<f8").tobytes() + rows.tobytes()


def _own_ply(content: bytes) -> Mesh | None:
    """Mesh from a PLY file of the common binary layout, without trimesh's slow import; None for any other."""
    header = _PLY_HEADER.match(content)
    if header is None:
        return None
    num_vertices, num_faces = int(header[1]), int(header[3])
    real = np.dtype("<f8" if header[2] == b"double" else "<f4")
    body = header.end() + num_vertices * 3 * real.itemsize
    least = body + num_faces * _PLY_FACE.itemsize  # a triangle's; few other faces are shorter
    if len(content) < least and mixed_ply_faces(content) is None:
        what = f"it ends after {len(content)} of at least {least} bytes"
        raise Fault(f"not a readable PLY mesh ({what})", "copy or export the mesh again")
    if len(content) != body + num_faces * _PLY_FACE.itemsize:
        return None
    vertices = np.frombuffer(content, real, num_vertices * 3, header.end()).reshape(-1, 3)
    rows = np.frombuffer(content, _PLY_FACE, num_faces, body)
    if (rows["count"] != 3).any():
        return None
    return Mesh(vertices.astype(np.float64), rows["corner"].astype(np.int64))


def _mend(content: bytes, file_type: str) -> str:
    """What to do with a mesh file that cannot be read: PLY files are read best as text, which this one may be."""
    if file_type != "ply":
        return "export the mesh again"
    as_text = "" if content[:20].split()[1:3] == [b"format", b"ascii"] else "as text (ASCII) or "
    return f"export the mesh again, {as_text}of triangles alone"


@contextmanager
def _errors_as_faults(file_type: str, mend: str) -> Iterator[None]:
    """Turn whatever trimesh raises at a damaged mesh file into one kind of error, and keep warnings and logs back."""
    logged = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            yield
    except Fault:
        raise
    except Exception as error:
        cause = f"{type(error).__name__} {one_line(str(error))[:80]}".strip()
        raise Fault(f"not a readable {file_type.upper()} mesh ({cause})", mend) from None
    finally:
        logging.disable(logged)


def _flatten(loaded: Any, node: str | None) -> Mesh:
    """Join all meshes of a file that holds several (or one node and those below it) into one, transforms applied."""
    graph = loaded.graph
    nodes = list(graph.nodes_geometry)
    if node is not None:
        if node not in graph.nodes:
            known = ", ".join(sorted(str(n) for n in nodes)[:8])
            raise Fault(f"no node '{one_line(node)[:40]}' in the file", f"give one of: {one_line(known)}")
        below = graph.transforms.successors(node)
        nodes = [n for n in nodes if n in below]
    return joined([_EMPTY, *(node_mesh(loaded, name)[0] for name in nodes)])


def node_mesh(loaded: Any, node: str) -> tuple[Mesh, Any]:
    """Mesh of one node of trimesh's scene, its transform applied (no faces of points or lines), and its geometry."""
    matrix, name = loaded.graph[node]
    geometry = loaded.geometry[name]
    faces = getattr(geometry, "faces", None)
    if faces is None or not len(faces):
        return _EMPTY, geometry
    vertices = np.asarray(geometry.vertices, dtype=np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return Mesh(vertices, np.asarray(faces, dtype=np.int64)), geometry


def sound_mesh(mesh: Mesh, max_faces: int, reach: float) -> Mesh:
    """Mesh as read without unused vertices (they would widen the room), after a check of its faces and coordinates.

    Raises
    ------
    Fault
        No faces or too many, a vertex that is not there or not finite, or a coordinate beyond `reach`.
    """
    vertices, faces = mesh
    if len(faces) == 0:
        raise Fault("the mesh has no faces", "export a mesh with triangles")
    if len(faces) > max_faces:
        raise too_many_faces(len(faces), max_faces)
    if faces.min() < 0 or faces.max() >= len(vertices):
        worst = int(faces.min() if faces.min() < 0 else faces.max())
        raise Fault(f"a face names vertex {worst} of {len(vertices)}", "export the mesh again")
    bad = ~np.isfinite(vertices).all(axis=1)
    if bad.any():
        raise Fault(f"vertex {int(np.argmax(bad))} is not finite", "export the mesh again")
    used, compact = np.unique(faces, return_inverse=True)
    largest = float(np.abs(vertices[used]).max())
    if largest > reach:
        raise Fault(f"a coordinate of {largest:.3g}, and {reach:.3g} is the most", "give 'units', near the origin")
    return Mesh(vertices[used], compact.reshape(faces.shape).astype(np.int64))


def without_comments(content: bytes) -> bytes:
    """Content of a PLY file without its header's comments: the reader would look for a texture named there."""
    end = content.find(b"end_header", 0, MAX_HEADER)
    return content if end < 0 else _PLY_NOTE.sub(b"", content[:end]) + content[end:]


def too_many_faces(count: int, limit: int) -> Fault:
    """Error for a mesh with more faces than the scene file's limit."""
    mend = f"simplify the mesh, or raise limits.faces = {limit} in the scene file"
    return Fault(f"{count} faces, and check and trace take time in proportion to them", mend)


def check_glb(content: bytes, max_faces: int, max_nodes: int) -> None:
    """Refuse a GLB mesh file of too many nodes or, each mesh counted as often as a node names it, too many faces.

    What cannot be read as a GLB file passes: the reader will say what is wrong with it.

    Raises
    ------
    Fault
        There are too many.
    """
    try:
        magic, _, _, length, kind = struct.unpack_from("<4sIII4s", content)
        document = json.loads(content[20 : 20 + length]) if (magic, kind) == (b"glTF", b"JSON") else {}
        nodes, meshes, accessors = (list(document.get(key, [])) for key in ("nodes", "meshes", "accessors"))
        uses = Counter(node["mesh"] for node in nodes if isinstance(node, dict) and "mesh" in node)
        faces = sum(times * _num_faces(meshes[mesh], accessors) for mesh, times in uses.items())
    except (struct.error, RecursionError, TypeError, LookupError, AttributeError, ValueError, OverflowError):
        return
    if len(nodes) > max_nodes:
        mend = f"join them, or raise limits.nodes = {max_nodes} in the scene file"
        raise Fault(f"{len(nodes)} nodes, and reading takes time in proportion to their square", mend)
    if faces > max_faces:
        raise too_many_faces(faces, max_faces)


def _num_faces(mesh: Any, accessors: list[Any]) -> int:
    """Triangles of a mesh in a scene's GLB file, counted: a third of its indices, or of its corners without any."""
    parts = mesh["primitives"]
    rows = [part["indices"] if "indices" in part else part["attributes"]["POSITION"] for part in parts]
    return sum(max(int(accessors[row]["count"]), 0) // 3 for row in rows)
