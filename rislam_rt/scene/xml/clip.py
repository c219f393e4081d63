"""Clipping of a mesh's triangles to a window of the plan."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.meshes import Mesh


def clip_mesh(mesh: Mesh, window: Floats) -> Mesh:
    """Clip a mesh to a window of the plan, lowest and highest x and y (2, 2) [m]: faces outside go, those across are
    cut.

    Sutherland and Hodgman (Commun. ACM 1974), side by side; a cut triangle comes back as a fan of triangles.
    """
    corners = mesh.triangles
    low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)
    touched = ((high > window[0]) & (low < window[1])).all(axis=1)
    inside = touched & ((low >= window[0]) & (high <= window[1])).all(axis=1)
    polygons = [_clipped(triangle, window) for triangle in corners[touched & ~inside]]
    cut = [polygon[[0, k, k + 1]] for polygon in polygons for k in range(1, len(polygon) - 1)]
    kept = mesh.faces[inside]
    vertices = np.concatenate([mesh.vertices, np.array(cut, dtype=np.float64).reshape(-1, 3)])
    added = len(mesh.vertices) + np.arange(3 * len(cut)).reshape(-1, 3)
    return Mesh(vertices, np.concatenate([kept, added]))


def _clipped(polygon: Floats, window: Floats) -> Floats:
    """Clip a convex polygon (n, 3) to a window of the plan."""
    for axis in (0, 1):
        for sign, limit in ((1.0, window[0, axis]), (-1.0, window[1, axis])):
            depth = sign * (polygon[:, axis] - limit)
            found = []
            for k in range(len(polygon)):
                here, after = depth[k - 1], depth[k]
                if (here >= 0.0) != (after >= 0.0):
                    found.append(polygon[k - 1] + here / (here - after) * (polygon[k] - polygon[k - 1]))
                if after >= 0.0:
                    found.append(polygon[k])
            polygon = np.array(found).reshape(-1, 3)
    return polygon
