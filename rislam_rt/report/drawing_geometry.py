"""Geometry for drawing: lines and polygons of rooms and estimated planes."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.walls import Walls
from rislam_rt.geometry.triangles import outline_edges


def wall_edges(walls: Walls) -> Floats:
    """Edges (E, 2, 3) [m] of all walls, for drawing, without those between triangles of the same wall."""
    return outline_edges(walls.triangles, walls.wall_of_triangle)


def section(triangles: Floats, height: float) -> Floats:
    """Line segments (S, 2, 2) [m] in which triangles (T, 3, 3) cut the horizontal plane at `height`, for drawing."""
    above = triangles[:, :, 2] - height
    cut = triangles[(above.min(axis=1) < 0.0) & (above.max(axis=1) > 0.0)]
    segments = []
    for triangle in cut:
        level = triangle[:, 2] - height
        points = [corner[:2] for corner, z in zip(triangle, level, strict=True) if z == 0.0]
        for a, b in ((0, 1), (1, 2), (2, 0)):
            if level[a] * level[b] < 0.0:
                points.append((triangle[a, :2] * level[b] - triangle[b, :2] * level[a]) / (level[b] - level[a]))
        segments.append(points[:2])
    return np.array(segments, dtype=np.float64).reshape(-1, 2, 2)


def plane_trace(normal: Floats, offset: float, height: float, bounds: Floats) -> Floats | None:
    """Line segment (2, 2) [m] to draw where an estimated wall's plane cuts the horizontal plane at `height` inside a
    box.

    None if it misses the box, or is nearer to horizontal than to vertical.
    """
    flat, level = normal[:2], offset - normal[2] * height
    size = float(np.linalg.norm(flat))
    if size < 0.5:  # nearer to a floor or a ceiling than to a wall
        return None
    foot, along = flat * level / size**2, np.array([-flat[1], flat[0]]) / size
    enter, leave = -np.inf, np.inf
    for axis in range(2):
        low, high = bounds[0, axis], bounds[1, axis]
        if abs(along[axis]) < 1e-12:
            if not low <= foot[axis] <= high:
                return None
            continue
        first, second = sorted(((low - foot[axis]) / along[axis], (high - foot[axis]) / along[axis]))
        enter, leave = max(enter, first), min(leave, second)
    return np.stack([foot + enter * along, foot + leave * along]) if enter < leave else None


def ellipse(center: Floats, covariance: Floats, sigmas: float = 2.0) -> Floats:
    """Points (65, 2) of the ellipse of `sigmas` standard deviations of a 2-D Gaussian, for drawing."""
    value, vector = np.linalg.eigh(covariance)
    turn = np.linspace(0.0, 2.0 * np.pi, 65)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    return np.asarray(center) + (sigmas * vector * np.sqrt(np.maximum(value, 0.0)) @ circle).T
