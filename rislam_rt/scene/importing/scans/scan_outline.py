"""Outlines of the planes of a scan: where points are, gaps of the scan filled, edges laid where two planes meet."""

from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_closing, binary_fill_holes, label
from scipy.spatial import cKDTree

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.geometry.planes import plane_tangents
from rislam_rt.scene.importing.scans.point_cloud import PointCloud
from rislam_rt.scene.importing.scans.scan_planes import ScanPlane
from rislam_rt.scene.meshes import Mesh
from rislam_rt.scene.polygons import inside_loop, outline_loops, signed_area, simplify_loop, triangulate
from rislam_rt.scene.shapes import joined

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


class _Edge(NamedTuple):
    """Edge of a scanned plane's outline, `normal . x = offset` in the plane, and whether another plane gives it."""

    normal: Floats
    offset: float
    length: float
    met: bool


def outline_planes(planes: list[ScanPlane], cloud: PointCloud, fill: float) -> list[Outline | None]:
    """Outlines of a scan's planes as meshes, holes up to `fill` [m^2] closed; None where too little is left."""
    trees = [cKDTree(cloud.points[plane.members]) for plane in planes]
    return [_outline(number, planes, trees, cloud, fill) for number in range(len(planes))]


def _outline(
    number: int, planes: list[ScanPlane], trees: list[cKDTree], cloud: PointCloud, fill: float
) -> Outline | None:
    """Mesh of the outline of one scanned plane: its cells, small holes filled, edges moved to where planes meet."""
    plane = planes[number]
    frame = np.stack(plane_tangents(plane.normal), axis=-1)
    flat = cloud.points[plane.members] @ frame
    low = flat.min(axis=0) - (BRIDGE + 1.5) * CELL
    size = np.ceil((flat.max(axis=0) - low) / CELL).astype(int) + BRIDGE + 2
    there = np.zeros(size, dtype=np.bool_)
    there[tuple(((flat - low) / CELL).astype(int).T)] = True
    there, filled = _filled_cells(there, _meeting_cells(number, planes, trees, frame, low, there.shape), fill)
    meshes = []
    for loops in _loops(there):
        corners = [low + CELL * loop for loop in loops]
        snapped = [_snapped(loop, number, planes, trees, frame) for loop in corners]
        mesh = _mesh(snapped, frame, plane) or _mesh(corners, frame, plane)
        if mesh is not None:
            meshes.append(mesh)
    return Outline(joined(meshes), filled) if meshes else None


def _meeting(plane: ScanPlane, other: ScanPlane, frame: Floats) -> tuple[Floats, float, float]:
    """Line where a scanned plane's outline ends at another plane: normal, offset [m] and sine of the angle, in its
    frame (3, 2)."""
    line = frame.T @ other.normal
    slope = float(np.linalg.norm(line))
    rest = other.offset - plane.offset * float(plane.normal @ other.normal)
    return (line / slope, rest / slope, slope) if slope > 0.0 else (line, rest, slope)


def _meeting_cells(
    number: int, planes: list[ScanPlane], trees: list[cKDTree], frame: Floats, low: Floats, shape: tuple[int, ...]
) -> Booleans:
    """Cells of a scanned plane along its lines with other planes, where those have points: holes end there."""
    plane, found = planes[number], np.zeros(shape, dtype=np.bool_)
    reach = float(np.hypot(shape[0], shape[1])) * CELL
    ends: list[tuple[Floats, Booleans]] = []
    for other, tree in enumerate(trees):
        line, offset, slope = _meeting(plane, planes[other], frame)
        if other == number or slope < 0.5:
            continue
        middle = low + 0.5 * CELL * np.array(shape)
        foot = middle + (offset - float(line @ middle)) * line
        steps = np.arange(-reach, reach, 0.5 * CELL)
        flat = foot + steps[:, None] * np.array([-line[1], line[0]])
        near = tree.query(flat @ frame.T + plane.offset * plane.normal)[0] < 1.5 * CELL
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


def _snapped(loop: Floats, number: int, planes: list[ScanPlane], trees: list[cKDTree], frame: Floats) -> Floats:
    """Outline (n, 2) of a scanned plane, edges laid on the lines where other planes meet it."""
    ends = zip(loop, np.roll(loop, -1, axis=0), strict=True)
    edges = [_edge(start, end, number, planes, trees, frame) for start, end in ends]
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
    return _snapped_corners(moved if far < (SHORT + 1.0) * CELL else loop, number, planes, trees, frame)


def _snapped_corners(
    corners: Floats, number: int, planes: list[ScanPlane], trees: list[cKDTree], frame: Floats
) -> Floats:
    """Outline (n, 2) of a scanned plane, corners that nearly lie on other planes put on them (on two at most)."""
    plane, moved = planes[number], corners.copy()
    for k, corner in enumerate(corners):
        place = frame @ corner + plane.offset * plane.normal
        near = []
        for other, tree in enumerate(trees):
            line, offset, slope = _meeting(plane, planes[other], frame)
            if other == number or slope < 0.3 or tree.query(place)[0] > 4.0 * CELL:
                continue
            near.append((abs(float(line @ corner) - offset), tuple(line), offset))
        near = sorted(item for item in near if item[0] < 1.5 * CELL)
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


def _edge(
    start: Floats, end: Floats, number: int, planes: list[ScanPlane], trees: list[cKDTree], frame: Floats
) -> _Edge:  # fmt: skip
    """Line of one edge of a scanned plane's outline: where the nearest other plane cuts this one, if near all along."""
    plane, along = planes[number], end - start
    length = float(np.linalg.norm(along))
    normal = np.array([along[1], -along[0]]) / length
    middle = frame @ (0.5 * (start + end)) + plane.offset * plane.normal
    best: tuple[float, _Edge | None] = (MEET * CELL, None)
    for other, tree in enumerate(trees):
        line, offset, slope = _meeting(plane, planes[other], frame)
        if other == number or slope < 0.3 or tree.query(middle)[0] > 4.0 * CELL + 0.5 * length:
            continue
        if abs(float(line @ normal)) < SLANT:
            continue
        far = max(abs(float(line @ start) - offset), abs(float(line @ end) - offset))
        if far < best[0]:
            best = (far, _Edge(line, offset, length, True))
    # cells with a point in them reach half a cell beyond what is there, on average; the solid lies to the left
    return best[1] or _Edge(normal, float(normal @ (0.5 * (start + end))) - 0.5 * CELL, length, False)


def _mesh(loops: list[Floats], frame: Floats, plane: ScanPlane) -> Mesh | None:
    """Mesh of a scanned plane from its outer outline and holes (n, 2); None if they make no polygon."""
    outer, holes = loops[0], loops[1:]
    if signed_area(outer) <= 0.0 or any(signed_area(h) >= 0.0 or not inside_loop(outer, h.mean(axis=0)) for h in holes):
        return None
    faces = triangulate(outer, holes)
    if faces is None:
        return None
    return Mesh(np.concatenate(loops) @ frame.T + plane.offset * plane.normal, faces)
