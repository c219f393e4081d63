"""Outlines of the planes of a scan: where points are, gaps of the scan filled, edges laid where two planes meet."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_closing, binary_fill_holes, label
from scipy.spatial import cKDTree

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.geometry.planes import plane_tangents
from rislam_rt.scene.importing.scans.point_cloud import PointCloud
from rislam_rt.scene.importing.scans.scan_planes import ScanPlane
from rislam_rt.scene.meshes import Mesh, joined
from rislam_rt.scene.polygons import inside_loop, outline_loops, signed_area, simplify_loop, triangulate

CELL = 0.1
"""Side [m] of the cells in which the points of a scanned plane are counted."""
BRIDGE = 2
"""Half the width [cells] of the gaps of a scanned plane that are closed before holes are looked for."""
LEAST_PART = 0.2
"""Least area [m^2] of a connected part of a scanned plane; smaller ones are left out."""
MEET = 2.5
"""Distance [cells] up to which an edge near the line where two planes meet is laid on it."""
SHORT = 4.0
"""Length [cells] of an outline's steps up to which they are the grid's, or too fine to tell from it."""
BREAK = 1.0
"""Length [m] along the line where two planes meet up to which what both lack is a hole of the scan."""
SLANT = np.cos(np.radians(20.0))
"""Least cosine of the angle between an outline's edge and the line where two planes meet, for it to be laid there."""


class Outline(NamedTuple):
    """Outline of a scanned plane as a mesh, and the area [m^2] of the scan's holes filled that no bridge closed."""

    mesh: Mesh
    filled: float


class _Meeting(NamedTuple):
    """Line where a scanned plane meets another, `normal . x = offset` in the plane, and what the other one is."""

    normal: Floats
    offset: float
    slope: float
    """Sine of the angle between the two planes."""
    tree: cKDTree


class _Sheet(NamedTuple):
    """A scanned plane whose outline is drawn: its two tangents (3, 2), and the lines where it meets the others."""

    frame: Floats
    foot: Floats
    """(3,) [m] of the plane, the zero of its outline: the point nearest to the origin."""
    meetings: list[_Meeting]


class _Edge(NamedTuple):
    """Edge of a scanned plane's outline, `normal . x = offset` in the plane, and whether another plane gives it."""

    normal: Floats
    offset: float
    length: float
    met: bool


def outline_planes(planes: list[ScanPlane], cloud: PointCloud, fill: float) -> list[Outline | None]:
    """Outlines of a scan's planes as meshes, holes up to `fill` [m^2] closed; None where too little is left."""
    trees = [cKDTree(cloud.points[plane.members]) for plane in planes]
    outlines = []
    for plane in planes:
        frame = np.stack(plane_tangents(plane.normal), axis=-1)
        others = zip(planes, trees, strict=True)
        meetings = [_meeting(plane, other, frame, tree) for other, tree in others if other is not plane]
        sheet = _Sheet(frame, plane.offset * plane.normal, meetings)
        outlines.append(_outline(sheet, cloud.points[plane.members] @ frame, fill))
    return outlines


def _outline(sheet: _Sheet, flat: Floats, fill: float) -> Outline | None:
    """Mesh of the outline of one scanned plane about its points (N, 2): its cells, small holes filled, edges moved to
    where planes meet."""
    low = flat.min(axis=0) - (BRIDGE + 1.5) * CELL
    size = np.ceil((flat.max(axis=0) - low) / CELL).astype(int) + BRIDGE + 2
    there = np.zeros(size, dtype=np.bool_)
    there[tuple(((flat - low) / CELL).astype(int).T)] = True
    there, filled = _filled_cells(there, _meeting_cells(sheet, low, there.shape), fill)
    meshes = []
    for loops in _loops(there):
        corners = [low + CELL * loop for loop in loops]
        mesh = _mesh([_snapped(loop, sheet) for loop in corners], sheet) or _mesh(corners, sheet)
        if mesh is not None:
            meshes.append(mesh)
    return Outline(joined(meshes), filled) if meshes else None


def _meeting(plane: ScanPlane, other: ScanPlane, frame: Floats, tree: cKDTree) -> _Meeting:
    """Line where a scanned plane's outline ends at another plane, in its frame (3, 2)."""
    line = frame.T @ other.normal
    slope = float(np.linalg.norm(line))
    rest = other.offset - plane.offset * float(plane.normal @ other.normal)
    scale = slope if slope > 0.0 else 1.0
    return _Meeting(line / scale, rest / scale, slope, tree)


def _meeting_cells(sheet: _Sheet, low: Floats, shape: tuple[int, ...]) -> Booleans:
    """Cells of a scanned plane along its lines with other planes, where those have points: holes end there."""
    found = np.zeros(shape, dtype=np.bool_)
    reach = float(np.hypot(shape[0], shape[1])) * CELL
    ends: list[tuple[Floats, Booleans]] = []
    for line, offset, slope, tree in sheet.meetings:
        if slope < 0.5:
            continue
        middle = low + 0.5 * CELL * np.array(shape)
        foot = middle + (offset - float(line @ middle)) * line
        steps = np.arange(-reach, reach, 0.5 * CELL)
        flat = foot + steps[:, None] * np.array([-line[1], line[0]])
        near = tree.query(flat @ sheet.frame.T + sheet.foot)[0] < 1.5 * CELL
        if not near.any():
            continue
        near = binary_closing(np.pad(near, 20), np.ones(2 * int(BREAK / CELL) + 1))[20:-20]
        ends.append((flat, near))
    for flat, near in ends:
        for other_flat, other_near in ends:
            near |= _to_corner(flat, near, other_flat, other_near)
        cells = np.floor((flat[near] - low) / CELL).astype(int)
        cells = cells[((cells >= 0) & (cells < np.array(shape))).all(axis=1)]
        found[tuple(cells.T)] = True
    return found


def _to_corner(flat: Floats, near: Booleans, other_flat: Floats, other_near: Booleans) -> Booleans:
    """Whether (S,) points (S, 2) of an outline's meeting line lie between its end and the crossing of another."""
    distance, at = cKDTree(other_flat).query(flat)
    meet = int(np.argmin(distance))
    steps = int(BREAK / (0.5 * CELL))
    mine, theirs = np.flatnonzero(near), np.flatnonzero(other_near)
    added = np.zeros(len(near), dtype=np.bool_)
    if distance[meet] > CELL or abs(flat[1] - flat[0]) @ abs(other_flat[1] - other_flat[0]) > 0.9 * (0.5 * CELL) ** 2:
        return added
    last = int(mine[np.argmin(np.abs(mine - meet))])
    if abs(last - meet) <= steps and np.abs(theirs - at[meet]).min() <= steps:
        added[min(last, meet) : max(last, meet) + 1] = True
    return added


def _filled_cells(there: Booleans, meeting: Booleans, fill: float) -> tuple[Booleans, float]:
    """Cells of a scanned plane with gaps bridged and small holes filled; also the area [m^2] of the holes."""
    solid = binary_closing(there, iterations=BRIDGE)
    walled = solid | meeting
    holes, count = label(binary_fill_holes(walled) & ~walled)
    small = [k for k in range(1, count + 1) if (holes == k).sum() * CELL**2 <= fill]
    patched = solid | np.isin(holes, small)
    patched |= binary_closing(patched, iterations=BRIDGE) & meeting
    parts, count = label(patched)
    keep = [k for k in range(1, count + 1) if (parts == k).sum() * CELL**2 >= LEAST_PART]
    kept = np.isin(parts, keep)
    return kept, float((kept & ~solid).sum()) * CELL**2


def _loops(there: Booleans) -> list[list[Floats]]:
    """Outer outline and holes (n, 2) [cells] of each connected part of a scanned plane, simplified."""
    shape = (there.shape[0] + 1, there.shape[1] + 1)
    corners = np.arange(shape[0] * shape[1]).reshape(shape)
    points = np.moveaxis(np.indices(shape), 0, -1).reshape(-1, 2).astype(np.float64)
    parts, count = label(there)
    found = []
    for k in range(1, count + 1):
        i, j = np.nonzero(parts == k)
        a, b, c, d = corners[i, j], corners[i + 1, j], corners[i + 1, j + 1], corners[i, j + 1]
        faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)])
        free = np.zeros(len(points), dtype=np.bool_)
        solid = np.column_stack([points, np.zeros(len(points))])
        thin = [points[simplify_loop(loop, solid, free, 1.2)] for loop in outline_loops(faces)]
        thin = [loop for loop in thin if len(loop) > 2]
        found.append(sorted(thin, key=lambda loop: -signed_area(loop)))
    return [loops for loops in found if loops]


def _snapped(loop: Floats, sheet: _Sheet) -> Floats:
    """Outline (n, 2) of a scanned plane, edges laid on the lines where other planes meet it."""
    edges = [_edge(start, end, sheet) for start, end in zip(loop, np.roll(loop, -1, axis=0), strict=True)]
    # a short edge beside one that another plane gives is the grid's cut through a corner
    kept = []
    for k, edge in enumerate(edges):
        beside = edges[k - 1].met or edges[(k + 1) % len(edges)].met
        if edge.met or edge.length > SHORT * CELL or not beside:
            kept.append(edge)
    kept = [edge for k, edge in enumerate(kept) if not _same(edge, kept[k - 1]) or len(kept) < 4]
    corners = []
    for k, edge in enumerate(kept):
        before = kept[k - 1]
        system = np.stack([before.normal, edge.normal])
        if abs(float(np.linalg.det(system))) < 0.3:
            return loop
        corners.append(np.linalg.solve(system, np.array([before.offset, edge.offset])))
    moved = np.array(corners)
    far = cKDTree(loop).query(moved)[0].max() if len(moved) > 2 else np.inf
    return _snapped_corners(moved if far < (SHORT + 1.0) * CELL else loop, sheet)


def _snapped_corners(corners: Floats, sheet: _Sheet) -> Floats:
    """Outline (n, 2) of a scanned plane, corners that nearly lie on other planes put on them (on two at most)."""
    moved = corners.copy()
    for k, corner in enumerate(corners):
        place = sheet.frame @ corner + sheet.foot
        near = sorted(
            (abs(float(line @ corner) - offset), tuple(line), offset)
            for line, offset, slope, tree in sheet.meetings
            if slope >= 0.3 and abs(float(line @ corner) - offset) < 1.5 * CELL and tree.query(place)[0] <= 4.0 * CELL
        )
        if not near:
            continue
        system, wanted = [np.array(near[0][1])], [near[0][2]]
        for _, direction, offset in near[1:]:
            if abs(float(np.linalg.det(np.stack([system[0], direction])))) > 0.3 and len(system) < 2:
                system.append(np.array(direction))
                wanted.append(offset)
        step = np.linalg.lstsq(np.stack(system), np.array(wanted) - np.stack(system) @ corner, rcond=None)[0]
        moved[k] = corner + step
    return moved


def _same(a: _Edge, b: _Edge) -> bool:
    """Whether two edges of a scanned plane's outline lie on its line with one and the same other plane."""
    parallel = abs(float(a.normal @ b.normal)) > 0.999
    return bool(a.met and b.met and parallel and abs(abs(a.offset) - abs(b.offset)) < 1e-9)


def _edge(start: Floats, end: Floats, sheet: _Sheet) -> _Edge:
    """Line of one edge of a scanned plane's outline: where the nearest other plane cuts this one, if near all along."""
    along, middle = end - start, 0.5 * (start + end)
    length = float(np.linalg.norm(along))
    normal = np.array([along[1], -along[0]]) / length
    # cells with a point in them reach half a cell beyond what is there, on average; the solid lies to the left
    place = sheet.frame @ middle + sheet.foot
    nearest, best = MEET * CELL, _Edge(normal, float(normal @ middle) - 0.5 * CELL, length, False)
    for line, offset, slope, tree in sheet.meetings:
        far = max(abs(float(line @ p) - offset) for p in (start, end))
        meets = slope >= 0.3 and abs(float(line @ normal)) >= SLANT and far < nearest
        if meets and tree.query(place)[0] <= 4.0 * CELL + 0.5 * length:
            nearest, best = far, _Edge(line, offset, length, True)
    return best


def _mesh(loops: list[Floats], sheet: _Sheet) -> Mesh | None:
    """Mesh of a scanned plane from its outer outline and holes (n, 2); None if they make no polygon."""
    outer, holes = loops[0], loops[1:]
    if signed_area(outer) <= 0.0 or any(signed_area(h) >= 0.0 or not inside_loop(outer, h.mean(axis=0)) for h in holes):
        return None
    faces = triangulate(outer, holes)
    return None if faces is None else Mesh(np.concatenate(loops) @ sheet.frame.T + sheet.foot, faces)
