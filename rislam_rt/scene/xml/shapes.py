"""Shapes of a Mitsuba scene file (XML) as triangles in the room's frame, and their clipping to a window of the plan."""

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_about
from rislam_rt.scene.findings import Fault, one_line
from rislam_rt.scene.meshes import MAX_MESH_BYTES, Mesh, MeshReader
from rislam_rt.scene.scene_folder import read_inside
from rislam_rt.scene.xml.untrusted_xml import children

FILES = {"ply": ".ply", "obj": ".obj"}
"""Types of an XML scene's shapes that name a mesh file, and that file's ending."""
SHAPES = ("ply", "obj", "rectangle", "cube")
"""Types of an XML scene's shapes that can be read."""

_RECTANGLE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=np.float64)
_CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
_CUBE_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def shape_mesh(shape: Element, folder: Path, max_faces: int) -> Mesh:
    """Mesh of a `<shape>` element of an XML scene file, its `to_world` applied; mesh files lie in the scene's folder.

    Raises
    ------
    Fault
        A shape of another type, a transform or a mesh file that cannot be used.
    """
    kind = shape.get("type", "")
    if kind in FILES:
        mesh = _from_file(shape, folder, FILES[kind], max_faces)
    elif kind == "rectangle":
        mesh = Mesh(_RECTANGLE, np.array([[0, 1, 2], [0, 2, 3]]))
    elif kind == "cube":
        mesh = Mesh(_CUBE, _CUBE_FACES)
    else:
        raise Fault(f"a shape of type '{one_line(kind)[:40]}'", f"make it one of {', '.join(SHAPES)}")
    matrix = to_world(shape)
    vertices = mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    if not (np.isfinite(vertices).all() and np.abs(vertices).max() <= 1e5):
        raise Fault("to_world: corners beyond 100 km", "give metres, near the origin")
    return Mesh(vertices, mesh.faces)


def to_world(shape: Element) -> Floats:
    """Matrix (4, 4) of a shape's transform `to_world` in an XML scene file; its parts apply in the order of the file.

    Raises
    ------
    Fault
        A part of unknown kind, or numbers that make no transform.
    """
    matrix = np.eye(4)
    for transform in children(shape, "transform"):
        if transform.get("name") == "to_world":
            for part in transform:
                matrix = _part(part) @ matrix
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-12:
        raise Fault("to_world: it makes everything flat, or has no numbers", "mend the transform")
    return matrix


def number(element: Element, name: str, default: float | None = None) -> float:
    """Number in an attribute of a shape's element in an XML scene file.

    Raises
    ------
    Fault
        It is none, or missing without a default.
    """
    text = element.get(name)
    if text is None and default is not None:
        return default
    try:
        value = float(text or "")
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        got = one_line(repr(text))[:40]
        raise Fault(f"<{element.tag}> has {name} = {got}", "give a finite number")
    return value


def _from_file(shape: Element, folder: Path, suffix: str, max_faces: int) -> Mesh:
    """Mesh of a shape of an XML scene file that names a PLY or OBJ file."""
    names = [e.get("value", "") for e in children(shape, "string") if e.get("name") == "filename"]
    if len(names) != 1:
        raise Fault(f"{len(names)} strings called 'filename'", "name one mesh file")
    if not names[0].lower().endswith(suffix):
        raise Fault(f"'{one_line(names[0])[:80]}' for a shape of type '{suffix[1:]}'", f"give a {suffix} file")
    content = read_inside(folder, names[0], MAX_MESH_BYTES)
    return MeshReader().parse(content, names[0], max_faces=max_faces)


def _part(part: Element) -> Floats:
    """Matrix (4, 4) of one element of a shape's transform in an XML scene file."""
    matrix = np.eye(4)
    if part.tag == "translate":
        matrix[:3, 3] = _triple(part, 0.0)
    elif part.tag == "scale":
        matrix[:3, :3] = np.diag(_triple(part, 1.0))
    elif part.tag == "rotate":
        matrix[:3, :3] = _rotation(_triple(part, 0.0), np.radians(number(part, "angle")))
    elif part.tag == "matrix":
        values = _numbers(part)
        size = {9: 3, 16: 4}.get(len(values))
        if size is None or (size == 4 and values[12:] != [0.0, 0.0, 0.0, 1.0]):
            raise Fault(f"<matrix> of {len(values)} numbers", "give 9, or 16 of which the last row is 0 0 0 1")
        matrix[:size, :size] = np.array(values).reshape(size, size)
    else:
        raise Fault(f"<{one_line(str(part.tag))[:40]}> in to_world", "use translate, rotate, scale or matrix")
    return matrix


def _triple(part: Element, default: float) -> Floats:
    """Three numbers of a shape's element in an XML scene file, from `value` (one for all, or three) or x, y, z."""
    if part.get("value") is None:
        return np.array([number(part, axis, default) for axis in "xyz"])
    values = _numbers(part)
    if len(values) not in (1, 3):
        raise Fault(f"<{part.tag}> has value = '{one_line(part.get('value', ''))[:40]}'", "give one number or three")
    return np.broadcast_to(np.array(values), 3)


def _numbers(part: Element) -> list[float]:
    """Numbers in the `value` of a shape's element in an XML scene file."""
    text = part.get("value", "")
    try:
        return [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        raise Fault(f"<{part.tag}> has value = '{one_line(text)[:40]}'", "give numbers") from None


def _rotation(axis: Floats, angle: float) -> Floats:
    """Rotation (3, 3) of a shape by an angle [rad] about an axis (3,), as `<rotate>` of an XML scene asks for it."""
    length = np.linalg.norm(axis)
    if not length > 0.0:
        raise Fault("<rotate> without an axis", "give x, y and z of one")
    return rotation_about(axis / length, angle)


def clip_mesh(mesh: Mesh, window: Floats) -> Mesh:
    """Clip the shapes of an XML scene to a window of the plan, lowest and highest x and y (2, 2) [m]: faces outside go,
    those across are cut.

    Sutherland and Hodgman (Commun. ACM 1974), side by side; a cut triangle comes back as a fan of triangles.
    """
    corners = mesh.triangles
    low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)
    touched = ((high > window[0]) & (low < window[1])).all(axis=1)
    inside = touched & ((low >= window[0]) & (high <= window[1])).all(axis=1)
    polygons = [_clipped(triangle, window) for triangle in corners[touched & ~inside]]
    cut = [polygon[[0, k, k + 1]] for polygon in polygons for k in range(1, len(polygon) - 1)]
    kept = mesh.faces[inside]
    vertices = np.concatenate([mesh.vertices, np.array(cut, dtype=np.float64).reshape(-1, 3)])
    added = len(mesh.vertices) + np.arange(3 * len(cut)).reshape(-1, 3)
    return Mesh(vertices, np.concatenate([kept, added]))


def _clipped(polygon: Floats, window: Floats) -> Floats:
    """Clip a convex polygon (n, 3) of an XML scene's shape to a window of the plan."""
    for axis in (0, 1):
        for sign, limit in ((1.0, window[0, axis]), (-1.0, window[1, axis])):
            depth = sign * (polygon[:, axis] - limit)
            found = []
            for k in range(len(polygon)):
                here, after = depth[k - 1], depth[k]
                if (here >= 0.0) != (after >= 0.0):
                    found.append(polygon[k - 1] + here / (here - after) * (polygon[k] - polygon[k - 1]))
                if after >= 0.0:
                    found.append(polygon[k])
            polygon = np.array(found).reshape(-1, 3)
    return polygon
