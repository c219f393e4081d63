"""Simplification of imported meshes: flat regions by their outlines, clutter by cells, with errors [m]."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.planes import plane_tangents
from rislam_rt.geometry.triangles import distance_to_edges, triangle_heights
from rislam_rt.scene.importing.regions.flat_regions import FlatRegions
from rislam_rt.scene.meshes import Mesh
from rislam_rt.scene.polygons import inside_loop, outline_loops, signed_area, simplify_loop, triangulate

MAX_SHADE_FACES = 3000
"""Most triangles of all clutter, as every segment of every path is tested against occluders; cells grow for it."""


class ClutterMesh(NamedTuple):
    """Triangles (T, 3, 3) [m] of one object of an imported mesh that hide and do not reflect."""

    piece: int
    triangles: Floats


def corners_kept(facets: FlatRegions, label: Integers) -> Booleans:
    """Whether (V,) a mesh's corner must stay: flat regions `label` (R,), three or two at an open edge, meet there."""
    faces, mine = facets.mesh.faces, label[facets.region]
    pairs = np.unique(np.column_stack([faces.ravel(), np.repeat(mine, 3)]), axis=0)
    count = np.bincount(pairs[:, 0], minlength=len(facets.mesh.vertices))
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(ends, axis=0, return_counts=True)
    count[np.unique(edges[uses == 1])] += 1
    return count >= 3


def region_mesh(facets: FlatRegions, regions: Integers, kept: Booleans, tolerance: float) -> tuple[Mesh, float]:
    """Simplify flat regions in one plane to one flat mesh; also its largest error [m].

    Outlines are thinned within a tolerance [m] and filled anew; where an outline crosses itself the triangles stay as
    they are.
    """
    faces, points = facets.faces_of(regions), facets.mesh.vertices
    normal, offset = facets.normal[regions[0]], float(facets.offset[regions[0]])
    turned = facets.normal[facets.region[np.isin(facets.region, regions)]] @ normal < 0.0
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    height = points[faces] @ normal - offset
    off = float(np.abs(height).max())
    filled, moved = _filled(faces, points, normal, kept, tolerance)
    if filled is None:
        used, compact = np.unique(faces, return_inverse=True)
        return Mesh(_onto(points[used], normal, offset), compact.reshape(-1, 3)), off
    return Mesh(_onto(filled.vertices, normal, offset), filled.faces), float(np.hypot(off, moved))


def _onto(points: Floats, normal: Floats, offset: float) -> Floats:
    """Simplification of a mesh: points put into a plane, moved only where rounding does not explain their distance."""
    height = points @ normal - offset
    return points - height[:, None] * normal if np.abs(height).max() > 1e-6 else points


def _filled(
    faces: Integers, points: Floats, normal: Floats, kept: Booleans, tolerance: float
) -> tuple[Mesh | None, float]:
    """Mesh filled anew from a flat region's simplified outlines (None if that fails), and how far [m] it is off."""
    flat = points @ np.stack(plane_tangents(normal), axis=-1)
    drawn = outline_loops(faces)
    loops = [simplify_loop(loop, points, kept, tolerance) for loop in drawn]
    moved = max(_off_loop(points[a], points[b]) for a, b in zip(drawn, loops, strict=True)) if drawn else 0.0
    loops = [loop for loop in loops if len(loop) > 2 and abs(signed_area(flat[loop])) > tolerance**2]
    outer = [loop for loop in loops if signed_area(flat[loop]) > 0.0]
    holes = [loop for loop in loops if signed_area(flat[loop]) < 0.0]
    owner = [_around(flat[hole], [flat[loop] for loop in outer]) for hole in holes]
    if not outer or None in owner:
        return None, 0.0
    corners: list[int] = []
    found: list[Integers] = []
    for number, loop in enumerate(outer):
        mine = [hole for hole, parent in zip(holes, owner, strict=True) if parent == number]
        triangles = triangulate(flat[loop], [flat[hole] for hole in mine])
        if triangles is None:
            return None, 0.0
        found.append(triangles + len(corners))
        corners += [*loop, *(corner for hole in mine for corner in hole)]
    used, compact = np.unique(np.array(corners)[np.concatenate(found)], return_inverse=True)
    return Mesh(points[used], compact.reshape(-1, 3)), moved


def _off_loop(corners: Floats, loop: Floats) -> float:
    """Error of a simplification: largest distance [m] of a flat region's corners (n, 3) from its loop (m, 3)."""
    edges = np.stack([loop, np.roll(loop, -1, axis=0)], axis=1)
    return float(distance_to_edges(corners, edges).max())


def _around(hole: Floats, outers: list[Floats]) -> int | None:
    """Number of the smallest outer loop of a simplified flat region around a hole; None if there is none."""
    around = [k for k, outer in enumerate(outers) if inside_loop(outer, 0.5 * (hole[0] + hole[1]))]
    return min(around, key=lambda k: signed_area(outers[k])) if around else None


def clustered(triangles: Floats, cell: float) -> tuple[Floats, float]:
    """Simplify the mesh of clutter, triangles (T, 3, 3), by joining the corners in each cell [m] in their mean; also
    the largest distance [m] that one moved.

    What shrinks to a line or a point is gone: it was finer than a cell. Rossignac and Borrel 1993.
    """
    corners = triangles.reshape(-1, 3)
    low = corners.min(axis=0)
    _, box = np.unique(np.floor((corners - low) / cell + 0.5).astype(np.int64), axis=0, return_inverse=True)
    box = box.ravel()
    count = np.bincount(box)
    mean = np.stack([np.bincount(box, corners[:, i]) for i in range(3)], axis=-1) / count[:, None]
    faces = box.reshape(-1, 3)
    distinct = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    _, single = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    faces = faces[np.intersect1d(np.flatnonzero(distinct), single)]
    moved = float(np.linalg.norm(corners - mean[box], axis=1).max())
    return mean[faces][has_area(mean[faces])], moved


def has_area(triangles: Floats) -> Booleans:
    """Whether (T,) triangles (T, 3, 3) of a simplified mesh are higher than a tenth of a millimetre, no mere line."""
    return np.asarray(triangle_heights(triangles) > 1e-4)


def in_cells(raw: list[ClutterMesh], cell: float) -> tuple[list[ClutterMesh], float, float]:
    """Simplify an imported mesh's clutter in the smallest cells that leave few triangles; also error and cell [m]."""
    while True:
        found = [(clutter.piece, *clustered(clutter.triangles, cell)) for clutter in raw]
        if sum(len(triangles) for _, triangles, _ in found) <= MAX_SHADE_FACES:
            break
        cell *= np.sqrt(2.0)
    error = max((moved for _, triangles, moved in found if len(triangles)), default=0.0)
    return [ClutterMesh(piece, triangles) for piece, triangles, _ in found], error, cell
