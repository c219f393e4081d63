"""Connected parts of a graph, and of a triangle mesh whose triangles share corners."""

import numpy as np

from rislam_rt.arrays import Floats, Integers


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
