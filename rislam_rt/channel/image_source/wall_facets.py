"""Facets of walls for the image-source method: where a wall's plane is solid, on which side points lie, occlusion."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, distinct_rows, row_blocks
from rislam_rt.channel.image_source.wall_rectangles import Rectangles, bounding_rectangles
from rislam_rt.channel.occluders import Occluders
from rislam_rt.channel.walls import Walls
from rislam_rt.constants import SURFACE_TOLERANCE
from rislam_rt.geometry.triangles import edge_planes

SEAM = 1e-9
"""[m] Triangles reach this far over their edges, so that no ray slips between two that share one (float64 rounding)."""
_SIMPLE = 4
"""Largest number of triangles of walls that are tested all together; walls of more are tested one by one."""
FRONT, BACK = 1, 2
"""Side bits: in front of a wall (where its normal points), behind it."""


@dataclass(frozen=True, slots=True, eq=False)
class WallFacets:
    """Geometry of W walls for reflection and occlusion tests, their T triangles sorted by wall."""

    normal: Floats
    """(W, 3) unit normals."""
    offset: Floats
    """(W,) [m]: `normal . x = offset`."""
    first: Integers
    """(W + 1,) triangles of wall w are first[w] : first[w + 1]."""
    corners: Floats
    """(T, 3, 3) [m] corners of the triangles."""
    edge_normal: Floats
    """(T, 3, 3) in-plane unit normals of the edges, pointing inside."""
    edge_offset: Floats
    """(T, 3) [m] offsets of the edges: `edge_normal . x >= edge_offset` inside."""
    box: Floats
    """(2, W, 3) [m] lowest and highest corner of each wall."""
    extent: Floats
    """(2, W) [m] lowest and highest signed distance of all walls' corners from wall w's plane."""
    rectangles: Rectangles
    """Bounding rectangles in the walls' planes."""
    plane: Integers
    """(W,) the wall whose plane each shares (`Walls.plane`)."""
    over: tuple[Integers, ...]
    """(W,) for each wall those that lie on it (`Walls.over`)."""
    occluders: Occluders
    """Meshes that hide paths and reflect nothing."""

    def __len__(self) -> int:
        return len(self.offset)

    def distance(self, points: Floats) -> Floats:
        """Signed distances (N, W) [m] of points (N, 3) from the plane of every wall's facets."""
        return points @ self.normal.T - self.offset

    def contains(self, points: Floats, wall: Integers) -> Booleans:
        """Whether points (N, 3), each in the plane of its wall (N,), lie on one of the wall's facets."""
        inside = self.rectangles.contains(points, wall, SEAM)
        rows = np.flatnonzero(inside & ~self.rectangles.whole[wall])
        counts = np.diff(self.first)[wall[rows]]
        simple = rows[counts <= _SIMPLE]
        inside[simple] = self._on_few(points[simple], wall[simple])
        rest = rows[counts > _SIMPLE]
        order = rest[np.argsort(wall[rest], kind="stable")]
        present, start = np.unique(wall[order], return_index=True)
        ends = np.append(start[1:], len(order))
        for number, first, last in zip(present, start, ends, strict=False):  # of no points, `ends` has one too many
            part = order[first:last]
            inside[part] = self._on_wall(points[part], int(number))
        return inside

    def _on_few(self, points: Floats, wall: Integers) -> Booleans:
        """Whether points (N, 3) in the planes of walls (N,) of at most `_SIMPLE` triangles lie on one of these."""
        inside = np.zeros(len(points), dtype=np.bool_)
        for number in range(_SIMPLE):
            rows = np.flatnonzero(~inside & (self.first[wall] + number < self.first[wall + 1]))
            triangle = self.first[wall[rows]] + number
            depth = np.einsum("nei,ni->ne", self.edge_normal[triangle], points[rows]) - self.edge_offset[triangle]
            inside[rows] = depth.min(axis=-1, initial=np.inf) >= -SEAM
        return inside

    def reflects(self, points: Floats, wall: Integers) -> Booleans:
        """Whether points (N, 3) in the planes of walls (N,) lie on a facet of their wall, and on none over it."""
        own = self.contains(points, wall)
        for lower in np.unique(wall[own]) if any(map(len, self.over)) else []:
            for upper in self.over[lower]:
                rows = np.flatnonzero(own & (wall == lower))
                own[rows] = ~self.contains(points[rows], np.full(len(rows), upper))
        return own

    def _on_wall(self, points: Floats, wall: int) -> Booleans:
        """Whether points (N, 3) in the plane of one wall lie on one of its triangles."""
        span = slice(self.first[wall], self.first[wall + 1])
        normals, offsets = self.edge_normal[span].reshape(-1, 3), self.edge_offset[span].reshape(-1)
        inside = np.zeros(len(points), dtype=np.bool_)
        for rows in row_blocks(len(points), len(offsets)):
            depth = (points[rows] @ normals.T - offsets).reshape(-1, len(offsets) // 3, 3).min(axis=-1)
            inside[rows] = (depth >= -SEAM).any(axis=-1)
        return inside

    def possible_blockers(self, points: Floats) -> Integers:
        """Walls that can occlude a leg between points (N, 3): corners or points lie on both sides of their plane."""
        distance = self.distance(points)
        low, high = np.minimum(self.extent[0], distance.min(axis=0)), np.maximum(self.extent[1], distance.max(axis=0))
        return np.flatnonzero((low < -SURFACE_TOLERANCE) & (high > SURFACE_TOLERANCE))

    def hidden_by(self, start: Floats, end: Floats, walls: Integers, spared: Integers) -> Integers:
        """Number (N,) of one of `walls` whose facets occlude each segment from `start` to `end` (N, 3), -1 where none
        does.

        A wall whose plane passes within `SURFACE_TOLERANCE` of an end is not in the way (ends are bounce points,
        devices and landmarks), nor is a segment's `spared` wall (N,) or what lies on it.
        """
        blocker = np.full(len(start), -1, dtype=np.int64)
        normal, offset = self.normal[walls].T, self.offset[walls]
        own = np.where(spared >= 0, self.plane[spared], -1) if len(self) else spared
        for rows in row_blocks(len(start), len(walls)) if len(walls) else []:
            a, b = start[rows] @ normal - offset, end[rows] @ normal - offset
            crossing = np.minimum(a, b) < -SURFACE_TOLERANCE
            crossing &= np.maximum(a, b) > SURFACE_TOLERANCE
            segment, column = np.nonzero(crossing)
            fraction = a[segment, column] / (a[segment, column] - b[segment, column])
            segment, wall = segment + rows.start, walls[column]
            point = start[segment] + fraction[:, None] * (end[segment] - start[segment])
            hit = self.contains(point, wall) & (own[segment] != self.plane[wall])
            blocker[segment[hit]] = wall[hit]
        return blocker

    def sides(self) -> Integers:
        """Side bits (W, W): on which sides of wall i's facets wall j has a part, 0 if it lies in the plane."""
        bits = np.zeros((len(self), len(self)), dtype=np.int64)
        points = self.corners.reshape(-1, 3)
        for rows in row_blocks(len(self), len(points)):
            distance = self.normal[rows] @ points.T - self.offset[rows, None]
            starts = 3 * self.first[:-1]
            front = np.maximum.reduceat(distance, starts, axis=1) > SEAM
            back = np.minimum.reduceat(distance, starts, axis=1) < -SEAM
            bits[rows] = FRONT * front + BACK * back
        return bits

    def point_sides(self, points: Floats) -> Integers:
        """Side bits (W,): on which sides of each wall's plane any of the points (N, 3) lies."""
        distance = self.distance(points)
        front, back = distance.max(axis=0) > SEAM, distance.min(axis=0) < -SEAM
        return np.asarray(FRONT * front + BACK * back)


def build_facets(walls: Walls) -> WallFacets:
    """Prepare walls for reflection and occlusion tests: triangles sorted by wall, their edges, bounds, rectangles."""
    order = np.argsort(walls.wall_of_triangle, kind="stable")
    corners = walls.triangles[order]
    first = np.searchsorted(walls.wall_of_triangle[order], np.arange(len(walls) + 1))
    edge_normal, edge_offset = edge_planes(corners)
    points = corners.reshape(-1, 3)
    extent, distinct = np.zeros((2, len(walls))), points[distinct_rows(points)[0]]
    for rows in row_blocks(len(walls), len(points)):
        distance = walls.normal[rows] @ distinct.T - walls.offset[rows, None]
        extent[:, rows] = distance.min(axis=1), distance.max(axis=1)
    starts = 3 * first[:-1]
    box = [op.reduceat(points, starts, axis=0) if len(points) else points for op in (np.minimum, np.maximum)]
    return WallFacets(
        normal=walls.normal,
        offset=walls.offset,
        first=first,
        corners=corners,
        edge_normal=edge_normal,
        edge_offset=edge_offset,
        box=np.stack(box),
        extent=extent,
        rectangles=bounding_rectangles(corners, first, walls.normal, walls.offset),
        plane=walls.plane,
        over=walls.over,
        occluders=walls.occluders,
    )
