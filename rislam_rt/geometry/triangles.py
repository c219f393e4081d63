"""Triangles in float64: planes, planar groups, point-in-triangle and segment tests, distance to edges."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.angles import unit


def triangle_planes(triangles: Floats) -> tuple[Floats, Floats]:
    """Unit normals (T, 3) and offsets (T,) [m] of triangles (T, 3, 3); the normal of a degenerate one is zero."""
    normal = unit(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]))
    return normal, np.einsum("ti,ti->t", normal, triangles.mean(axis=1))


def planar_groups(triangles: Floats, angle: float, offset: float) -> Integers:
    """Number (T,) of the plane each triangle (T, 3, 3) lies in, counted in the order of first appearance.

    Two triangles share a plane when their normals agree up to sign within `angle` [rad] and every corner of the
    one lies within `offset` [m] of the other's plane.
    """
    normal, distance = triangle_planes(triangles)
    group = np.full(len(triangles), -1, dtype=np.int64)
    count = 0
    for seed in range(len(triangles)):
        if group[seed] >= 0:
            continue
        parallel = np.linalg.norm(np.cross(normal, normal[seed]), axis=-1) <= angle
        near = np.abs(triangles @ normal[seed] - distance[seed]).max(axis=1) <= offset
        group[(group < 0) & parallel & near] = count
        group[seed] = count
        count += 1
    return group


def edge_planes(triangles: Floats) -> tuple[Floats, Floats]:
    """In-plane unit normals (T, 3, 3) of the three edges, pointing inside, and their offsets (T, 3) [m].

    `normal . x - offset` is the distance of a point x of the plane from an edge's line, positive inside. Where the
    triangle is degenerate the normals are zero and the offset is infinite: nothing lies inside.
    """
    normal, _ = triangle_planes(triangles)
    inward = unit(np.cross(normal[:, None, :], np.roll(triangles, -1, axis=1) - triangles))
    solid = np.linalg.norm(inward, axis=-1) > 0.0
    return inward, np.where(solid, np.einsum("tei,tei->te", inward, triangles), np.inf)


def inside_triangles(points: Floats, triangles: Floats, margin: float = 0.0) -> Booleans:
    """Whether points (..., 1, 3), assumed in the plane, lie inside triangles (T, 3, 3): (..., T).

    `margin` [m] widens (positive) or shrinks (negative) every triangle by that distance from its edges.
    """
    return edge_distance(points, triangles) >= -margin


def edge_distance(points: Floats, triangles: Floats) -> Floats:
    """Distance [m] (..., T) of points (..., 1, 3) from the nearest edge line of triangles (T, 3, 3), positive inside."""
    normal, _ = triangle_planes(triangles)
    edges = np.roll(triangles, -1, axis=1) - triangles
    inward = unit(np.cross(normal[:, None, :], edges))
    offset = np.einsum("tei,tei->te", inward, triangles)
    return (np.einsum("...i,tei->...te", points[..., 0, :], inward) - offset).min(axis=-1)


def segment_hits(start: Floats, end: Floats, triangles: Floats, slack: float) -> Booleans:
    """Whether open segments (S, 3) to (S, 3) cross triangles (T, 3, 3): (S, T).

    A crossing within `slack` [m] of either end does not count, so that a path's own bounce points do not shade it.
    """
    normal, offset = triangle_planes(triangles)
    a = start @ normal.T - offset
    b = end @ normal.T - offset
    crossing = (a * b < 0.0) & (np.abs(a) > slack) & (np.abs(b) > slack)
    hits = np.zeros(crossing.shape, dtype=np.bool_)
    for s, t in [(i, np.flatnonzero(row)) for i, row in enumerate(crossing) if row.any()]:
        fraction = a[s, t] / (a[s, t] - b[s, t])
        point = start[s] + fraction[:, None] * (end[s] - start[s])
        inward = edge_distance_pairs(point, triangles[t])
        hits[s, t] = inward >= 0.0
    return hits


def edge_distance_pairs(points: Floats, triangles: Floats) -> Floats:
    """Distance [m] (S,) of points (S, 3) from the nearest edge line of their triangle (S, 3, 3), positive inside."""
    normal, _ = triangle_planes(triangles)
    edges = np.roll(triangles, -1, axis=1) - triangles
    inward = unit(np.cross(normal[:, None, :], edges))
    return np.einsum("sei,sei->se", inward, points[:, None, :] - triangles).min(axis=-1)
