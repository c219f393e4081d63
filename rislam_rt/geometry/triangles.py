"""Triangles in float64: planes, planar groups, point-in-triangle and segment tests, distance to edges."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
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
