"""Coplanar walls of a room: which lies in the plane of which, as far as a float32 ray tracer can tell apart."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, cross
from rislam_rt.constants import COPLANAR_ANGLE, RAY_OFFSET
from rislam_rt.geometry.planes import signed_distance
from rislam_rt.geometry.triangles import connected, edge_planes, inside_any, outline_edges, triangle_areas

ALIKE = 1e-6
"""Relative difference below which the areas of two walls count as equal: corners in float32 say no more."""

_BLOCK = 200_000
"""Number of pairs of triangles that are tested for overlap in one go."""


class CoplanarPair(NamedTuple):
    """Two coplanar walls that overlap: wall `upper` lies on the larger wall `lower`."""

    upper: int
    """Number of the smaller wall."""
    lower: int
    """Number of the larger wall."""
    gap: float
    """Largest distance [m] of the upper wall's corners from the lower wall's plane."""


class CoplanarStack(NamedTuple):
    """Coplanar walls among W walls: the pairs that overlap, and the plane that all in one stack share."""

    pairs: list[CoplanarPair]
    """All pairs of coplanar walls that overlap."""
    plane: Integers
    """Number (W,) of the wall whose plane each wall shares: its own where it overlaps no other wall of its plane."""
    over: tuple[Integers, ...]
    """For each of W walls, the numbers of the walls that lie on it."""


def tracer_gap(bounds: Floats) -> float:
    """Distance [m] below which a float32 tracer cannot tell two surfaces of a room (2, 3) apart.

    Sionna RT starts a ray this far off its surface, 1e2 units of the last place of (1 m + the largest coordinate),
    because nearer by its own arithmetic may put it on either side. Coordinates count from the room's middle.
    """
    return RAY_OFFSET * (1.0 + 0.5 * float(np.ptp(bounds, axis=0).max()))


def stack_walls(triangles: Floats, owner: Integers, normal: Floats, offset: Floats, gap: float) -> CoplanarStack:
    """Find the coplanar pairs of a room's W walls that overlap.

    Two walls lie on each other when their normals (W, 3) agree within `COPLANAR_ANGLE`, all corners of the smaller are
    within `gap` [m] of the larger's plane, and they overlap by more than `gap`. The smaller lies on the larger; of two
    alike, the one with the lower number. All that hang together share the plane of the largest.

    Parameters
    ----------
    triangles, owner
        (T, 3, 3) [m] and the wall (T,) of each.
    """
    count = len(normal)
    area = np.asarray(np.bincount(owner, triangle_areas(triangles), count), dtype=np.float64)
    order = np.argsort(owner, kind="stable")
    members = np.split(order, np.searchsorted(owner[order], np.arange(1, count)))[:count]
    corner = np.array([triangles[m[0], 0] for m in members]).reshape(-1, 3)
    pairs = []
    for i, j in _parallel_pairs(normal, offset, corner, gap):
        upper, lower = (i, j) if area[i] <= area[j] * (1.0 + ALIKE) else (j, i)
        corners = triangles[members[upper]]
        apart = float(np.abs(signed_distance(corners, normal[lower], offset[lower])).max())
        if apart <= gap and overlap(corners, triangles[members[lower]], normal[lower], gap):
            pairs.append(CoplanarPair(upper, lower, apart))
    over = tuple(np.array(sorted(p.upper for p in pairs if p.lower == w), dtype=np.int64) for w in range(count))
    return CoplanarStack(pairs, _joint_planes(pairs, area), over)


def overlap(a: Floats, b: Floats, normal: Floats, depth: float) -> bool:
    """Whether coplanar triangles (A, 3, 3) and (B, 3, 3), seen along a normal (3,), overlap by over `depth` [m].

    Two triangles are apart if their shadows on a normal to one of their six edges are (separating axes).
    """
    right = cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    frame = np.stack([right / np.linalg.norm(right), cross(normal, right) / np.linalg.norm(right)], axis=-1)
    flat_a, flat_b = a @ frame, b @ frame
    low, high = flat_b.min(axis=(0, 1)), flat_b.max(axis=(0, 1))
    flat_a = flat_a[((flat_a.max(axis=1) > low) & (flat_a.min(axis=1) < high)).all(axis=-1)]
    step = max(1, _BLOCK // max(len(b), 1))
    return any(_any_overlap(flat_a[i : i + step], flat_b, depth) for i in range(0, len(flat_a), step))


def lies_within(upper: Floats, lower: Floats, gap: float) -> bool:
    """Whether coplanar triangles (U, 3, 3) lie on triangles (L, 3, 3) all over, but for `gap` [m]: their middles do,
    and no outline of the lower ones runs through an upper one."""
    if not inside_any(upper.mean(axis=1), lower, gap).all():
        return False
    start, end = outline_edges(lower).swapaxes(0, 1)
    for inward, offset in zip(*edge_planes(upper), strict=True):
        a, b = start @ inward.T - offset - gap, end @ inward.T - offset - gap  # how far within each edge, both ends
        at = a / np.where(a != b, a - b, 1.0)  # where along the outline it crosses the edge's line
        enters = np.where(b > a, at, np.where((b == a) & (a < 0.0), np.inf, 0.0)).max(axis=1)
        leaves = np.where(b < a, at, 1.0).min(axis=1)
        if (np.maximum(enters, 0.0) < np.minimum(leaves, 1.0)).any():
            return False
    return True


def _any_overlap(a: Floats, b: Floats, depth: float) -> bool:
    """Whether any pair of coplanar triangles (A, 3, 2) and (B, 3, 2) overlaps by more than `depth` [m]."""
    boxed = np.minimum(a.max(axis=1)[:, None], b.max(axis=1)) - np.maximum(a.min(axis=1)[:, None], b.min(axis=1))
    i, j = np.nonzero((boxed > depth).all(axis=-1))
    pair_a, pair_b = a[i], b[j]
    together = np.ones(len(i), dtype=np.bool_)
    for shape in (pair_a, pair_b):
        for corner in range(3):
            edge = shape[:, (corner + 1) % 3] - shape[:, corner]
            axis = np.stack([-edge[:, 1], edge[:, 0]], axis=-1) / np.linalg.norm(edge, axis=-1, keepdims=True)
            on_a, on_b = (np.einsum("nci,ni->nc", s, axis) for s in (pair_a, pair_b))
            common = np.minimum(on_a.max(axis=1), on_b.max(axis=1)) - np.maximum(on_a.min(axis=1), on_b.min(axis=1))
            together &= common > depth
    return bool(together.any())


def _parallel_pairs(normal: Floats, offset: Floats, corner: Floats, gap: float) -> list[tuple[int, int]]:
    """Pairs of walls that may be coplanar: one normal, one corner (W, 3) near the other's plane, by sorted normals."""
    key = np.abs(normal @ np.array([0.36, 0.48, 0.80]))
    order = np.argsort(key, kind="stable")
    found: list[tuple[int, int]] = []
    for step in range(1, len(order)):
        near = np.flatnonzero(key[order[step:]] - key[order[:-step]] <= COPLANAR_ANGLE)
        if len(near) == 0:
            break
        i, j = order[near], order[near + step]
        turn = np.linalg.norm(cross(normal[i], normal[j]), axis=-1)
        far = np.abs(signed_distance(corner[i], normal[j], offset[j]))
        also = np.abs(signed_distance(corner[j], normal[i], offset[i]))
        keep = (turn <= COPLANAR_ANGLE) & (np.minimum(far, also) <= gap)
        found += [(int(min(p)), int(max(p))) for p in zip(i[keep], j[keep], strict=True)]
    return sorted(found)


def _joint_planes(pairs: list[CoplanarPair], area: Floats) -> Integers:
    """Number (W,) of the largest wall among all coplanar walls that overlapping pairs connect with each wall."""
    if not pairs:
        return np.arange(len(area))
    part = connected(np.array([pair[:2] for pair in pairs], dtype=np.int64).reshape(-1, 2), len(area))
    largest = np.argsort(-area, kind="stable")  # first, of two alike the one with the lower number
    return largest[np.unique(part[largest], return_index=True)[1]][part]
