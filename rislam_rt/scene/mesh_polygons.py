"""Faces of mesh files (OBJ, PLY) with more than three corners, cut into triangles that cover each as it is drawn.

Those of OBJ files are found in `obj_polygons`.
"""

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.triangles import triangle_heights
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.polygons import signed_area, triangulate

SLIVER = 1e-6
"""Height of a triangle, as a fraction of its polygon's size, up to which it is no more than a line."""
MARGIN = 1e-3
"""How far edges must cross to be a fault, as a fraction of the polygon's size: millimetres on a wall.

Less is what rounding and careless snapping leave in a drawing, and what is drawn is still plain.
"""
MOST_CORNERS = 4000
"""Corners of a polygon up to which its ears are clipped: a second and 0.3 GB, which grow with their square."""
FLAT = 0.05
"""Spread of a polygon across its mean plane, as a fraction of its width, up to which crossings seen in it are real."""
_PLY_HEAD = re.compile(
    rb"ply\r?\nformat binary_(little|big)_endian 1\.0\r?\n((?:(?:element|property)[ \t][^\n]*\n)*)end_header\r?\n"
)
_PLY_ELEMENT = re.compile(rb"element (\w+) (\d{1,9})\s*\n((?:property [^\n]*\n)+)")
_PLY_TYPES = {
    b"char": "i1", b"uchar": "u1", b"short": "i2", b"ushort": "u2", b"int": "i4", b"uint": "u4", b"float": "f4",
    b"double": "f8", b"int8": "i1", b"uint8": "u1", b"int16": "i2", b"uint16": "u2", b"int32": "i4", b"uint32": "u4",
    b"float32": "f4", b"float64": "f8",
}  # fmt: skip
_CORNERS = ("vertex_index", "vertex_indices")
"""Names that exporters of PLY files give to the corners of a face."""
MEND = "cut it into triangles where the mesh is made"
"""What to do about a face of a mesh file that crosses itself."""


def polygon_triangles(points: Floats, polygons: Sequence[Sequence[int]]) -> list[Integers]:
    """Triangulate a mesh file's polygons: corner numbers within each polygon (T, 3), turned like it, in their order.

    A fan from the first corner where that covers the polygon, else ears clipped off in its mean plane. A polygon that
    is no more than a line stays a fan, of faces without area; so does one that no repair lets clip.

    Parameters
    ----------
    points
        (V, 3) in the file's unit, finite.
    polygons
        Each of three or more indices into `points`.

    Raises
    ------
    Fault
        One that is nearly flat crosses itself by more than `MARGIN` (`PolygonFault`), or has more than `MOST_CORNERS`
        which no fan covers.
    """
    sizes = np.array([len(polygon) for polygon in polygons])
    fans = {int(size): fan(int(size)) for size in np.unique(sizes)}
    found = [fans[int(size)] for size in sizes]
    for size in fans:
        if size > 3:
            rows = np.flatnonzero(sizes == size)
            corners = points[np.array([polygons[int(row)] for row in rows])]
            uncovered = np.flatnonzero(~covered_by_fan(corners))
            if size > MOST_CORNERS and len(uncovered):
                raise Fault(f"a face of {size} corners; {MOST_CORNERS} are allowed where a fan does not cover it", MEND)
            for k in uncovered:
                cut = _clipped(corners[k])
                if cut is None:
                    raise PolygonFault(int(rows[k]), size, corners[k, 0])
                found[rows[k]] = cut
    return found


class PolygonFault(Fault):
    """A face of a mesh file that crosses itself."""

    def __init__(self, number: int, size: int, first: Floats) -> None:
        self.number = number
        self.what = f"of {size} corners, the first at {', '.join(f'{x:g}' for x in first)}, crosses itself"
        super().__init__(f"face {number} {self.what}", MEND)


@lru_cache(maxsize=64)
def fan(size: int) -> Integers:
    """Fan of triangles from the first corner of a mesh file's polygon: corner numbers (size - 2, 3), read only."""
    found = np.array([[0, i, i + 1] for i in range(1, size - 1)], dtype=np.int64)
    found.setflags(write=False)
    return found


def is_fan(cut: Integers, size: int) -> bool:
    """Whether the triangles of a mesh file's polygon are its fan."""
    return cut is fan(size) or np.array_equal(cut, fan(size))


def covered_by_fan(corners: Floats) -> Booleans:
    """Whether fans from the first corner cover a mesh file's polygons (n, k, 3): all turn one way, none is a line."""
    n, k, _ = corners.shape
    spokes = corners[:, 1:] - corners[:, :1]
    size = np.linalg.norm(np.ptp(corners, axis=1), axis=-1)
    turn = np.cross(spokes[:, :-1], spokes[:, 1:])
    normal = turn.sum(axis=1)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    sine = np.einsum("nti,ni->nt", turn, normal / np.where(length > 0.0, length, 1.0))
    angle = np.arctan2(sine, np.einsum("nti,nti->nt", spokes[:, :-1], spokes[:, 1:])).sum(axis=1)
    heights = triangle_heights(corners[:, fan(k)].reshape(-1, 3, 3)).reshape(n, k - 2)
    return np.asarray((sine > 0.0).all(axis=1) & (heights > SLIVER * size[:, None]).all(axis=1) & (angle < 2.0 * np.pi))


def _clipped(corners: Floats) -> Integers | None:
    """Triangulate a mesh file's polygon (k, 3) by clipping ears in its mean plane; None where it crosses itself.

    What cannot be clipped and does not cross itself is clipped without repeated corners and spikes, else a fan.
    """
    centred = corners - corners.mean(axis=0)
    _, spread, axes = np.linalg.svd(centred)
    if spread[1] <= SLIVER * spread[0]:
        return fan(len(corners))
    flat = centred @ axes[:2].T
    size = float(np.linalg.norm(np.ptp(corners, axis=0)))
    ears = _ears(flat, np.arange(len(corners)))
    if ears is None:
        depth = spread[2] if len(spread) > 2 else 0.0
        if depth <= FLAT * spread[1] and _crosses_itself(flat, MARGIN * size):
            return None
        for level in (SLIVER, MARGIN):
            ears = _ears(*_simplified(flat, level * size)) if ears is None else ears
    if ears is None:
        return fan(len(corners))
    return ears[triangle_heights(corners[ears]) > SLIVER * size]


def _ears(flat: Floats, ring: Integers) -> Integers | None:
    """Triangles (T, 3) of a mesh file's polygon, a ring of corners (n, 2), turned like it; None where ears cannot be
    clipped."""
    turned = len(ring) > 2 and signed_area(flat[ring]) < 0.0
    order = ring[::-1] if turned else ring
    ears = triangulate(flat[order], []) if len(ring) > 2 else None
    if ears is None:
        return None
    return np.asarray(order[ears[:, ::-1] if turned else ears])


def _crosses_itself(flat: Floats, margin: float) -> bool:
    """Whether two edges of a mesh file's polygon (n, 2) cross, each with both ends further than a margin off the
    other's line."""
    ends = np.roll(flat, -1, axis=0)
    along = ends - flat
    length = np.linalg.norm(along, axis=1)
    along /= np.where(length > 0.0, length, 1.0)[:, None]
    for a, b, way in zip(flat, ends, along, strict=True):
        one, other = (way[0] * (p - a)[:, 1] - way[1] * (p - a)[:, 0] for p in (flat, ends))
        start, end = (along[:, 0] * (p - flat)[:, 1] - along[:, 1] * (p - flat)[:, 0] for p in (a, b))
        parted = (one * other < 0.0) & (start * end < 0.0)
        if (parted & (np.minimum.reduce(np.abs([one, other, start, end])) > margin)).any():
            return True
    return False


def _simplified(flat: Floats, near: float) -> tuple[Floats, Integers]:
    """Corners (n, 2) of a mesh file's polygon, those nearer than a length made one point, and its ring without repeats
    and spikes.

    A spike is a corner at which the outline turns back along itself.
    """
    flat = flat.copy()
    for k in range(1, len(flat)):
        flat[k] = flat[np.flatnonzero(np.linalg.norm(flat[: k + 1] - flat[k], axis=1) <= near)[0]]
    ring, at = list(range(len(flat))), 0
    while len(ring) > 2 and at < len(ring):
        before, here, after = (flat[ring[(at + k) % len(ring)]] for k in (-1, 0, 1))
        back, on = before - here, after - here
        short, long = sorted((back, on), key=lambda side: float(side @ side))
        across = abs(float(short[0] * long[1] - short[1] * long[0]))
        if not short.any() or (back @ on > 0.0 and across <= near * float(np.linalg.norm(long))):
            ring.pop(at)
            at = max(at - 2, 0)
        else:
            at += 1
    return flat, np.array(ring, dtype=np.int64)


def ply_faces(loaded: Any) -> tuple[Floats, Integers] | None:
    """Vertices (V, 3) and triangles (F, 3) of a PLY file that trimesh has read, where its fans would not cover a face.

    None where they do, or where the file has no faces or names vertices that it does not have.

    Raises
    ------
    Fault
        A face crosses itself, or is read at the wrong place.
    """
    raw: dict[str, Any] = next((one.metadata.get("_ply_raw", {}) for one in loaded.geometry.values()), {})
    data, at = (raw.get(key, {}).get("data") for key in ("face", "vertex"))
    if data is None or at is None:
        return None
    names = list(data) if isinstance(data, dict) else list(data.dtype.names)
    name = next((name for name in names if name in _CORNERS), names[0])
    rows = data[name] if isinstance(data, dict) else data[name]["f1"]
    if not isinstance(data, dict) and (data[name]["f0"] != rows.shape[1]).any():
        raise Fault("its faces have different numbers of corners", "export it as text (ASCII), or of triangles alone")
    if isinstance(rows, np.ndarray) and rows.ndim == 2 and rows.shape[1] < 4:
        return None
    polygons = [row for row in (np.asarray(row, dtype=np.int64).reshape(-1) for row in rows) if len(row) > 2]
    points = np.column_stack([np.asarray(at[axis], dtype=np.float64).reshape(-1) for axis in "xyz"])
    cuts = _ply_cuts(points, polygons)
    if all(is_fan(cut, len(polygon)) for cut, polygon in zip(cuts, polygons, strict=True)):
        return None
    return points, np.concatenate([polygon[cut] for polygon, cut in zip(polygons, cuts, strict=True)])


def mixed_ply_faces(content: bytes) -> tuple[Floats, Integers] | None:
    """Vertices (V, 3) and triangles (F, 3) of a binary PLY file whose faces have different numbers of corners, which
    trimesh does not read, or reads at the wrong places; None for any other file, and where the header says otherwise.

    Raises
    ------
    Fault
        A face crosses itself.
    """
    head = _PLY_HEAD.match(content)
    if head is None:
        return None
    order, at, found = "<" if head[1] == b"little" else ">", head.end(), dict[bytes, Any]()
    for name, count, lines in _PLY_ELEMENT.findall(head[2]):
        properties = [line.split()[1:] for line in lines.splitlines()]
        try:
            if any(words[0] == b"list" for words in properties):
                found[name], at = _list_rows(content, at, int(count), properties, order)
            else:
                row = np.dtype([(words[1].decode("latin-1"), order + _PLY_TYPES[words[0]]) for words in properties])
                found[name], at = np.frombuffer(content, row, int(count), at), at + int(count) * row.itemsize
        except (LookupError, ValueError, TypeError):
            return None
    vertices, faces = found.get(b"vertex"), found.get(b"face")
    if not isinstance(vertices, np.ndarray) or not isinstance(faces, list) or len({*map(len, faces)}) < 2:
        return None
    if not {"x", "y", "z"} <= set(vertices.dtype.names or ()):
        return None
    polygons = [face for face in faces if len(face) > 2]
    points = np.column_stack([vertices[axis].astype(np.float64) for axis in "xyz"])
    cuts = _ply_cuts(points, polygons)
    none = np.zeros((0, 3), dtype=np.int64)
    return points, np.concatenate([none, *(polygon[cut] for polygon, cut in zip(polygons, cuts, strict=True))])


def _list_rows(
    content: bytes, at: int, count: int, properties: list[list[bytes]], order: str
) -> tuple[list[Integers], int]:
    """Corners of each face of a binary PLY file's element with lists, and where it ends; errors where it is damaged."""
    table = _equal_rows(content, at, count, properties, order) if count else None
    if table is not None:
        return [row for name in _CORNERS if name in table.dtype.names for row in table[name]], at + table.nbytes
    rows: list[Integers] = []
    for _ in range(count):
        for words in properties:
            size = 1
            if words[0] == b"list":
                sizes = np.dtype(order + _PLY_TYPES[words[1]])
                size, at = int(np.frombuffer(content, sizes, 1, at)[0]), at + sizes.itemsize
            kind = np.dtype(order + _PLY_TYPES[words[-2]])
            if size < 0 or at + size * kind.itemsize > len(content):
                raise ValueError("the file ends within a list")
            if words[-1].decode("latin-1") in _CORNERS:
                rows.append(np.frombuffer(content, kind, size, at).astype(np.int64))
            at += size * kind.itemsize
    return rows, at


def _equal_rows(content: bytes, at: int, count: int, properties: list[list[bytes]], order: str) -> Any:
    """Table of a binary PLY file's element, its lists all as long as those of the first row; None where they are not.

    Exact: where a row is as long as the first the next one starts where it is looked for.
    """
    fields = list[Any]()
    sizes = dict[str, int]()
    here = at
    for words in properties:
        shape: tuple[int, ...] = ()
        name, kind = words[-1].decode("latin-1"), np.dtype(order + _PLY_TYPES[words[-2]])
        if words[0] == b"list":
            counter = np.dtype(order + _PLY_TYPES[words[1]])
            size = int(np.frombuffer(content, counter, 1, here)[0])
            if not 0 <= size * count <= len(content):
                return None
            sizes[f"{name} "], shape, here = size, (size,), here + counter.itemsize
            fields.append((f"{name} ", counter))
        fields.append((name, kind, shape))
        here += kind.itemsize * int(np.prod(shape))
    row = np.dtype(fields)
    if at + count * row.itemsize > len(content):
        return None
    table = np.frombuffer(content, row, count, at)
    return table if all((table[name] == size).all() for name, size in sizes.items()) else None


def _ply_cuts(points: Floats, polygons: Sequence[Integers]) -> list[Integers]:
    """Triangles within each face of a PLY file; fans where a face cannot be looked at, of which the mesh is told."""
    named = np.concatenate([*polygons, np.zeros(0, dtype=np.int64)])
    if not np.isfinite(points).all() or named.min(initial=0) < 0 or named.max(initial=-1) >= len(points):
        return [fan(len(polygon)) for polygon in polygons]
    return polygon_triangles(points, [polygon.tolist() for polygon in polygons])
