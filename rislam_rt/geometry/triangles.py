"""Triangles in float64: planes, point-in-triangle and segment tests, distance to edges, connected parts."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, cross, distinct_rows
from rislam_rt.geometry.angles import unit


def triangle_cross(triangles: Floats) -> Floats:
    """Normals (T, 3) [m^2] of triangles (T, 3, 3), cross products as long as twice the triangle's area."""
    return cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def triangle_areas(triangles: Floats) -> Floats:
    """Areas (T,) [m^2] of triangles (T, 3, 3)."""
    return np.asarray(0.5 * np.linalg.norm(triangle_cross(triangles), axis=-1))


def triangle_heights(triangles: Floats) -> Floats:
    """Heights (T,) [m] of triangles (T, 3, 3) over their longest edges; zero of a point."""
    edge = np.roll(triangles, -1, axis=1) - triangles
    longest = np.linalg.norm(edge, axis=-1).max(axis=1)
    return np.linalg.norm(cross(edge[:, 0], edge[:, 1]), axis=-1) / np.where(longest > 0.0, longest, 1.0)


def triangle_planes(triangles: Floats) -> tuple[Floats, Floats]:
    """Unit normals (T, 3) and offsets (T,) [m] of triangles (T, 3, 3); the normal of a degenerate one is zero."""
    normal = unit(triangle_cross(triangles))
    return normal, np.einsum("ti,ti->t", normal, triangles.mean(axis=1))


def edge_planes(triangles: Floats) -> tuple[Floats, Floats]:
    """In-plane unit normals (T, 3, 3) of the three edges, pointing inside, and their offsets (T, 3) [m].

    `normal . x - offset` is the distance of a point x of the plane from an edge's line, positive inside. Where the
    triangle is degenerate the normals are zero and the offset is infinite: nothing lies inside.
    """
    normal, _ = triangle_planes(triangles)
    inward = unit(cross(normal[:, None, :], np.roll(triangles, -1, axis=1) - triangles))
    solid = np.linalg.norm(inward, axis=-1) > 0.0
    return inward, np.where(solid, np.einsum("tei,tei->te", inward, triangles), np.inf)


def triangle_edges(triangles: Floats) -> Floats:
    """Edges (3T, 2, 3) [m] of triangles (T, 3, 3), those of a triangle in turn."""
    return np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2, 3)


def edge_ends(edges: Floats) -> Integers:
    """Numbers (E, 2) of the corners at which the edges (E, 2, 3) [m] of triangles end, the lower first.

    Corners count as the same when they agree to a nanometre.
    """
    corner = distinct_rows(np.round(edges.reshape(-1, 3), 9))[1]
    return np.sort(corner.reshape(-1, 2), axis=1)


def outline_edges(triangles: Floats, wall: Integers | None = None) -> Floats:
    """Outline edges (E, 2, 3) [m] of a mesh: those of one triangle (T, 3, 3) alone, or of one alone of its wall
    (T,)."""
    edges = triangle_edges(triangles)
    owner = np.zeros(len(edges), dtype=np.int64) if wall is None else np.repeat(wall, 3)
    key = np.column_stack([owner, edge_ends(edges)])
    index, _, count = distinct_rows(key)
    return edges[index[count == 1]]


def distance_to_edges(points: Floats, edges: Floats) -> Floats:
    """Distance (N,) [m] of points (N, 3) from the nearest of the edges (E, 2, 3), infinite without any."""
    start, along = edges[:, 0], edges[:, 1] - edges[:, 0]
    square = np.einsum("ei,ei->e", along, along)
    offset = points[:, None] - start
    fraction = np.einsum("nei,ei->ne", offset, along) / np.where(square > 0.0, square, 1.0)
    gap = offset - np.clip(fraction, 0.0, 1.0)[..., None] * along
    return np.sqrt(np.einsum("nei,nei->ne", gap, gap).min(axis=1, initial=np.inf))


def distance_to_triangles(points: Floats, triangles: Floats) -> Floats:
    """Distance (N,) [m] of points (N, 3) from the nearest of the triangles (T, 3, 3)."""
    normal, offset = triangle_planes(triangles)
    edge_normal, edge_offset = edge_planes(triangles)
    edges = triangle_edges(triangles)
    nearest = np.full(len(points), np.inf)
    for rows in np.array_split(np.arange(len(points)), max(1, len(points) * len(triangles) // 200_000)):
        height = np.abs(points[rows] @ normal.T - offset)
        above = (np.einsum("ni,tei->nte", points[rows], edge_normal) >= edge_offset).all(axis=-1)
        plane = np.where(above, height, np.inf).min(axis=1, initial=np.inf)
        nearest[rows] = np.minimum(plane, distance_to_edges(points[rows], edges))
    return nearest


def inside_any(points: Floats, triangles: Floats, slack: float) -> Booleans:
    """Which points (N, 3), all in the plane of triangles (T, 3, 3), lie on one, up to `slack` [m] over its edges."""
    inward, offset = edge_planes(triangles)
    inside = np.zeros(len(points), dtype=np.bool_)
    for rows in np.array_split(np.arange(len(points)), max(1, len(points) * len(triangles) // 200_000)):
        depth = (np.einsum("ni,tei->nte", points[rows], inward) - offset).min(axis=-1)
        inside[rows] = (depth >= -slack).any(axis=-1)
    return inside


def connected(pairs: Integers, count: int) -> Integers:
    """Number (count,) of the connected component to which each node of a graph with edges (P, 2) belongs."""
    # half a second of imports that a list of settings does without
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_matrix((ones, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def connected_triangles(triangles: Floats, tolerance: float = 1e-6) -> Integers:
    """Connected part (T,) of a mesh that each triangle (T, 3, 3) is in; corners within `tolerance` [m] are one."""
    _, corner = np.unique(np.round(triangles.reshape(-1, 3) / tolerance), axis=0, return_inverse=True)
    faces = corner.reshape(-1, 3)
    label = connected(np.concatenate([faces[:, :2], faces[:, 1:]]), int(faces.max(initial=-1)) + 1)
    return np.asarray(np.unique(label[faces[:, 0]], return_inverse=True)[1], dtype=np.int64)
