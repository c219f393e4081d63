"""Geometric queries to a mesh: triangles near a point, crossed by a segment, hit by a ray, or around a point."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, cross, row_blocks
from rislam_rt.geometry.triangles import edge_planes, triangle_cross, triangle_planes


def touching(points: Floats, triangles: Floats, distance: float) -> tuple[Integers, Integers]:
    """Query to a mesh: pairs (point, triangle) up to `distance` [m] apart, of points (K, 3), triangles (T, 3, 3)."""
    normal, offset = triangle_planes(triangles)
    edges = edge_planes(triangles)
    found = []
    for rows in row_blocks(len(points), len(triangles)):
        k, t = np.nonzero(np.abs(points[rows] @ normal.T - offset) <= distance)
        near = _depth(points[rows][k], edges, t) >= -distance
        found.append((k[near] + rows.start, t[near]))
    return _joined(found)


def crossings(start: Floats, end: Floats, triangles: Floats) -> tuple[Integers, Integers]:
    """Query to a mesh: pairs (segment, triangle) where `start` to `end` (K, 3) passes through a triangle (T, 3, 3)."""
    place = _around(start, end, triangles)
    triangles = triangles[place]
    normal, offset = triangle_planes(triangles)
    edges = edge_planes(triangles)
    found = []
    for rows in row_blocks(len(start), len(triangles)):
        a, b = start[rows] @ normal.T - offset, end[rows] @ normal.T - offset
        k, t = np.nonzero(a * b < 0.0)
        fraction = (a[k, t] / (a[k, t] - b[k, t]))[:, None]
        point = start[rows][k] * (1.0 - fraction) + end[rows][k] * fraction
        inside = _depth(point, edges, t) >= 0.0
        found.append((k[inside] + rows.start, place[t[inside]]))
    return _joined(found)


def is_blocked(start: Floats, end: Floats, triangles: Floats) -> Booleans:
    """Query to a mesh: whether (K,) a triangle (T, 3, 3) stands between `start` and `end`, (K, 3) each or one (3,)."""
    start, end = np.broadcast_arrays(start, end)
    return np.isin(np.arange(len(start)), crossings(start, end, triangles)[0])


def ray_hits(origin: Floats, directions: Floats, triangles: Floats, slack: float = 1e-6) -> Integers:
    """Query to a mesh: index (D,) of the nearest triangle (T, 3, 3) that each ray from one point (3,) along unit
    vectors (D, 3) hits, -1 for none.

    `slack` [m] widens every triangle, so that no ray slips through the seam between two.
    """
    planes, edges = triangle_planes(triangles), edge_planes(triangles)
    nearest = np.full(len(directions), -1, dtype=np.int64)
    for rows in row_blocks(len(directions), len(triangles)):
        k, t, distance = _met(origin, directions[rows], planes, edges, slack)
        order = np.argsort(-distance, kind="stable")
        nearest[k[order] + rows.start] = t[order]
    return nearest


def hit_shares(origins: Floats, directions: Floats, triangles: Floats, slack: float = 1e-6) -> Floats:
    """Query to a mesh: share (N,) of the rays from each point (N, 3) along unit vectors (D, 3) that hit any triangle
    (T, 3, 3), as `ray_hits` finds them."""
    planes, edges = triangle_planes(triangles), edge_planes(triangles)
    blocks = row_blocks(len(directions), len(triangles))
    hits = [
        sum(len(np.unique(_met(origin, directions[rows], planes, edges, slack)[0])) for rows in blocks)
        for origin in origins
    ]
    return np.array(hits, dtype=np.float64) / len(directions)


def _met(
    origin: Floats, directions: Floats, planes: tuple[Floats, Floats], edges: tuple[Floats, Floats], slack: float
) -> tuple[Integers, Integers, Floats]:
    """Query to a mesh: pairs (ray, triangle) that meet, of rays from a point (3,) along (D, 3), and their distances."""
    normal, offset = planes
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (offset - normal @ origin) / (directions @ normal.T)
    k, t = np.nonzero(np.isfinite(distance) & (distance > 0.0))
    point = origin + distance[k, t][:, None] * directions[k]
    hit = _depth(point, edges, t) >= -slack
    k, t = k[hit], t[hit]
    return k, t, distance[k, t]


def free_ways(place: Floats, directions: Floats, triangles: Floats, box: Floats) -> Floats:
    """Query to a mesh: free distance (D,) [m] from a place (3,) along unit vectors (D, 3) to the first triangle
    (T, 3, 3), or out of the box (2, 3)."""
    with np.errstate(divide="ignore"):
        out = (np.where(directions > 0.0, box[1], box[0]) - place) / directions
    leaves = np.where(directions == 0.0, np.inf, out).min(axis=1)
    hit = ray_hits(place, directions, triangles)
    normal = triangle_cross(triangles)[hit]
    slope = np.einsum("di,di->d", directions, normal)
    height = np.einsum("di,di->d", triangles[hit, 0] - place, normal)
    return np.where(hit < 0, leaves, np.minimum(leaves, height / np.where(slope != 0.0, slope, 1.0)))


def winding(point: Floats, triangles: Floats) -> float:
    """Winding number of a surface of triangles (T, 3, 3) around a point (3,): 1 or -1 inside a closed one, 0 outside.

    Sum of solid angles (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 1983); an object that lacks its bottom
    still gives more than one half inside.
    """
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    na, nb, nc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    top = np.einsum("ti,ti->t", a, cross(b, c))
    dot = np.einsum
    below = na * nb * nc + dot("ti,ti->t", a, b) * nc + dot("ti,ti->t", b, c) * na + dot("ti,ti->t", c, a) * nb
    return float(np.sum(np.arctan2(top, below)) / (2.0 * np.pi))


def sphere_directions(count: int) -> Floats:
    """Unit vectors (count, 3) of rays to query a mesh, spread evenly over the sphere (Fibonacci lattice)."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    phi = k * np.pi * (3.0 - np.sqrt(5.0))
    r = np.sqrt(1.0 - z**2)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


def _around(start: Floats, end: Floats, triangles: Floats) -> Integers:
    """Query to a mesh: triangles that reach into the box around all segments; no other is met."""
    if not len(start):
        return np.arange(len(triangles))
    low = np.minimum(start.min(axis=0), end.min(axis=0)) - 1e-6
    high = np.maximum(start.max(axis=0), end.max(axis=0)) + 1e-6
    return np.flatnonzero(((triangles.max(axis=1) >= low) & (triangles.min(axis=1) <= high)).all(axis=1))


def _depth(points: Floats, edges: tuple[Floats, Floats], triangle: Integers) -> Floats:
    """Query to a mesh: distance (S,) [m] of points (S, 3) from their triangle's nearest edge, positive inside."""
    inward, offset = edges
    first, second, third = (np.einsum("sei,si->se", inward[triangle], points) - offset[triangle]).T
    # along so short an axis, the minimum takes thrice as long
    return np.asarray(np.minimum(np.minimum(first, second), third))


def _joined(found: list[tuple[Integers, Integers]]) -> tuple[Integers, Integers]:
    """Index pairs found in all blocks of a query, as two arrays."""
    none = np.zeros(0, dtype=np.int64)
    return np.concatenate([none, *(k for k, _ in found)]), np.concatenate([none, *(t for _, t in found)])
