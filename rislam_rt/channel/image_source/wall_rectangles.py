"""Bounding rectangles of walls in their planes, and which walls are rectangles themselves."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, cross, distinct_rows
from rislam_rt.constants import SURFACE_TOLERANCE

SAME = 1e-9
"""Relative difference of areas, and difference of distances [m], below which they are equal (float64 rounding)."""


class Rectangles(NamedTuple):
    """Bounding rectangles of W walls, each in its wall's plane."""

    normal: Floats
    """(W, 3) unit normals of the walls."""
    offset: Floats
    """(W,) [m] of the walls: `normal . x = offset`."""
    center: Floats
    """(W, 3) [m] centres."""
    directions: tuple[Floats, Floats]
    """(W, 3) unit vectors along its sides."""
    sizes: tuple[Floats, Floats]
    """(W,) [m] half a side."""
    halves: tuple[Floats, Floats]
    """(W, 3) [m] half a side as vectors, `SURFACE_TOLERANCE` longer: nothing on the wall lies outside."""
    whole: Booleans
    """(W,) whether the wall fills its rectangle."""

    def contains(self, points: Floats, wall: Integers, slack: float) -> Booleans:
        """Which points (N, 3) in the planes of walls (N,) lie in their rectangles, up to `slack` [m] outside."""
        offset = points - self.center[wall]
        inside = np.ones(len(points), dtype=np.bool_)
        for direction, size in zip(self.directions, self.sizes, strict=True):
            inside &= np.abs(np.einsum("ni,ni->n", offset, direction[wall])) <= size[wall] + slack
        return inside


def bounding_rectangles(corners: Floats, first: Integers, normal: Floats, offset: Floats) -> Rectangles:
    """Smallest bounding rectangle of each wall, of the three along the edges of the wall's first triangle.

    Triangles (T, 3, 3) are sorted by wall, those of wall w being first[w] : first[w + 1].
    """
    count, points = len(offset), corners.reshape(-1, 3)
    owner = np.repeat(np.arange(count), 3 * np.diff(first))
    best = np.full(count, np.inf)
    center, right, up = (np.zeros((count, 3)) for _ in range(3))
    sizes = np.zeros(count), np.zeros(count)
    for corner in range(3 if count else 0):
        lead = corners[first[:-1]]
        along = lead[:, (corner + 1) % 3] - lead[:, corner]
        along -= np.einsum("wi,wi->w", along, normal)[:, None] * normal
        along /= np.linalg.norm(along, axis=-1, keepdims=True)
        across = cross(normal, along)
        spans = [_span(points, owner, 3 * first[:-1], side) for side in (along, across)]
        area = spans[0][1] * spans[1][1]
        better = area < best * (1.0 - SAME)
        best[better], right[better], up[better] = area[better], along[better], across[better]
        middle = normal * offset[:, None] + spans[0][0][:, None] * along + spans[1][0][:, None] * across
        center[better] = middle[better]
        for size, (_, half) in zip(sizes, spans, strict=True):
            size[better] = half[better]
    half_right, half_up = (
        side * (size + SURFACE_TOLERANCE)[:, None] for side, size in zip((right, up), sizes, strict=True)
    )
    none = np.zeros(count, dtype=np.bool_)
    bare = Rectangles(normal, offset, center, (right, up), sizes, (half_right, half_up), none)
    return bare._replace(whole=_filled(bare, corners, np.repeat(np.arange(count), np.diff(first))))


def _span(points: Floats, owner: Integers, starts: Integers, direction: Floats) -> tuple[Floats, Floats]:
    """Middle and half length (W,) [m] of each wall's bounding rectangle along its direction (W, 3)."""
    at = np.einsum("ni,ni->n", points, direction[owner])
    low, high = np.minimum.reduceat(at, starts), np.maximum.reduceat(at, starts)
    return (low + high) / 2.0, (high - low) / 2.0


def _filled(rectangles: Rectangles, corners: Floats, wall: Integers) -> Booleans:
    """Whether (W,) the triangles (T, 3, 3) of walls (T,) fill their wall's bounding rectangle."""
    # They do where their areas add up to the rectangle's, and every edge that one triangle has alone lies on its
    # border.
    count = len(rectangles.offset)
    sides = np.roll(corners, -1, axis=1) - corners
    area = np.zeros(count)
    np.add.at(area, wall, 0.5 * np.linalg.norm(cross(sides[:, 0], sides[:, 1]), axis=-1))
    full = 4.0 * rectangles.sizes[0] * rectangles.sizes[1]
    whole = np.abs(area - full) <= SAME * full
    mine = np.flatnonzero(whole[wall])
    corner = distinct_rows(np.round(corners[mine].reshape(-1, 3), 9))[1]
    corner = corner.reshape(-1, 3)
    ends = np.sort(np.stack([corner, np.roll(corner, -1, axis=1)], axis=-1).reshape(-1, 2), axis=-1)
    owner = np.repeat(wall[mine], 3)
    key = (owner * len(ends) + ends[:, 0]) * (len(ends) + 1) + ends[:, 1]
    _, index, times = np.unique(key, return_index=True, return_counts=True)
    alone = index[times == 1]
    tail, head = corners[mine].reshape(-1, 3), np.roll(corners[mine], -1, axis=1).reshape(-1, 3)
    inner = ~_on_border(rectangles, tail[alone], head[alone], owner[alone])
    whole[owner[alone[inner]]] = False
    return whole


def _on_border(rectangles: Rectangles, tail: Floats, head: Floats, wall: Integers) -> Booleans:
    """Which edges (N, 3) to (N, 3) lie along one side of their walls' rectangles."""
    border = np.zeros(len(wall), dtype=np.bool_)
    for direction, size in zip(rectangles.directions, rectangles.sizes, strict=True):
        at = [np.einsum("ni,ni->n", end - rectangles.center[wall], direction[wall]) for end in (tail, head)]
        for sign in (1.0, -1.0):
            border |= np.maximum(*(np.abs(sign * a - size[wall]) for a in at)) <= SAME
    return border
