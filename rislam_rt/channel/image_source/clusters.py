"""Clusters of walls with bounding boxes, so that beams are tested against few boxes before the walls in them."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.image_source.facets import WallFacets
from rislam_rt.channel.image_source.rectangles import Rectangles
from rislam_rt.constants import SURFACE_TOLERANCE

CLUSTER = 48
"""Largest number of walls in a cluster: testing that many costs about as much as the test of the box that spares it."""


class WallClusters(NamedTuple):
    """Bounding rectangles of all walls, and C clusters of walls with their bounding boxes."""

    rectangles: Rectangles
    members: list[Integers]
    """(C,) walls of each cluster."""
    center: Floats
    """(C, 3) [m] centres of the clusters' bounding boxes."""
    half: Floats
    """(C, 3) [m] half the sizes of those boxes."""

    def reached(self, normal: Floats, offset: Floats) -> tuple[Integers, Integers]:
        """Pairs (beam, wall), as two index arrays, where a wall's bounding rectangle reaches into each half-space
        (N, P, 3), (N, P) of a beam."""
        beams, planes = offset.shape
        if beams == 0:
            return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        flat, bound = normal.reshape(-1, 3), offset.reshape(-1, 1) - SURFACE_TOLERANCE
        highest: Floats = flat @ self.center.T + np.abs(flat) @ self.half.T
        near = np.logical_and.reduce((highest >= bound).reshape(beams, planes, -1), axis=1)
        found = []
        for number, members in enumerate(self.members):
            rows = np.flatnonzero(near[:, number])
            if len(rows) == 0:
                continue
            n, o = normal[rows].reshape(-1, 3), offset[rows].reshape(-1, 1) - SURFACE_TOLERANCE
            within: Floats = n @ self.rectangles.center[members].T
            for half in self.rectangles.halves:
                within += np.abs(n @ half[members].T)
            row, wall = np.nonzero((within >= o).reshape(len(rows), planes, -1).all(axis=1))
            found.append((rows[row], members[wall]))
        rows_found, walls_found = zip(*found, strict=True) if found else ([np.zeros(0, int)], [np.zeros(0, int)])
        return np.concatenate(rows_found), np.concatenate(walls_found)


def build_clusters(facets: WallFacets) -> WallClusters:
    """Split walls into clusters of at most `CLUSTER` by halving along the longest extent of their centres."""
    rectangles = facets.rectangles
    members: list[Integers] = []
    waiting = [np.arange(len(facets))] if len(facets) else []
    while waiting:
        walls = waiting.pop()
        if len(walls) <= CLUSTER:
            members.append(walls)
            continue
        points = rectangles.center[walls]
        order = walls[np.argsort(points[:, np.argmax(np.ptp(points, axis=0))], kind="stable")]
        waiting += [order[: len(order) // 2], order[len(order) // 2 :]]
    low = np.array([facets.box[0, walls].min(axis=0) for walls in members]).reshape(-1, 3)
    high = np.array([facets.box[1, walls].max(axis=0) for walls in members]).reshape(-1, 3)
    return WallClusters(rectangles, members, (low + high) / 2.0, (high - low) / 2.0 + SURFACE_TOLERANCE)
