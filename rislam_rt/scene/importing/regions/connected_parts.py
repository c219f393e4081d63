"""Parts of a graph that hang together."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from rislam_rt.arrays import Integers


def connected(pairs: Integers, count: int) -> Integers:
    """Number (count,) of the group that each belongs to, pairs (P, 2) being joined."""
    ones = np.ones(len(pairs), dtype=np.int8)
    graph = coo_matrix((ones, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
