"""Beam tracing: the wall sequences that a specular leg can have, found by mirroring beams instead of trying all.

Seen from the far end's mirror image, a ray that bounces on a wall leaves through that wall's bounding rectangle: it
stays inside the beam of that rectangle. Only walls that reach into the beam can come next, each with a beam of its own,
and only devices in the last beam can have the path. A beam is a set of half-spaces; nothing outside one can be met, so
nothing is lost. Positions near each other share beams: their image is then a ball, and each half-space is laid through
an edge of the rectangle such that the whole ball stays on its far side.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, row_blocks, take_rows
from rislam_rt.channel.image_source.wall_facets import WallFacets
from rislam_rt.channel.image_source.wall_rectangles import Rectangles
from rislam_rt.constants import SURFACE_TOLERANCE
from rislam_rt.geometry.planes import mirror

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
        """Pairs (beam, wall) where a wall's bounding rectangle reaches into all half-spaces (N, P, 3) of a beam."""
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
    """Split walls into clusters for beam tracing, of at most `CLUSTER`, by halving along the longest extent of their
    centres."""
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


_BLOCK = 4_000_000
"""Numbers in the largest temporary array."""


class BoundingBalls(NamedTuple):
    """Bounding balls of B groups of positions: centre (B, 3) and radius (B,) [m]."""

    center: Floats
    radius: Floats


def group_positions(points: Floats, limit: float) -> list[Integers]:
    """Split positions (K, 3) [m] into groups for beam tracing that each fit a ball of radius `limit` [m], halving the
    longest side of their bounding box."""
    groups, waiting = [], [np.arange(len(points))] if len(points) else []
    while waiting:
        group = waiting.pop()
        size = np.ptp(points[group], axis=0)
        if len(group) == 1 or np.linalg.norm(size) <= 2.0 * limit:
            groups.append(group)
            continue
        order = group[np.argsort(points[group, np.argmax(size)], kind="stable")]
        waiting += [order[len(order) // 2 :], order[: len(order) // 2]]
    return groups


def enclosing_balls(points: Floats, groups: list[Integers]) -> BoundingBalls:
    """Bounding balls of groups of positions (K, 3) [m] from which beams are traced, each about its box's middle."""
    middle = np.array([(points[g].min(axis=0) + points[g].max(axis=0)) / 2.0 for g in groups]).reshape(-1, 3)
    radius = [np.linalg.norm(points[g] - m, axis=-1).max() for g, m in zip(groups, middle, strict=True)]
    return BoundingBalls(middle, np.array(radius, dtype=np.float64))


class Beams(NamedTuple):
    """N beams mirrored in d walls each: from inside a beam a device may see the far end over these walls."""

    ball: Integers
    """(N,) number of the far end's bounding ball."""
    walls: Integers
    """(N, d) walls in the order from device to far end: the newest first."""
    image: Floats
    """(N, 3) [m] mirror image of the ball's centre in all d walls."""
    normal: Floats
    """(N, P, 3) inward unit normals of P half-spaces: inside the beam are points with `normal . x >= offset`."""
    offset: Floats
    """(N, P) [m] offsets of the half-spaces."""


class FoundSequences(NamedTuple):
    """Wall sequences (N, d) that beam tracing leaves possible, with device's and far end's bounding ball (N,)."""

    device: Integers
    far: Integers
    walls: Integers


def search_beams(
    clusters: WallClusters, device: BoundingBalls, far: BoundingBalls, pairs: Integers, depth: int, barred: Booleans
) -> Iterator[FoundSequences]:
    """Yield, in blocks, wall sequences of 1 to `depth` bounces that beams leave possible from devices to far ends.

    Parameters
    ----------
    device, far
        Bounding balls of either end; `pairs` (A, 2) says which device ball goes with which far ball.
    barred
        (W,) walls that may not come last.
    """
    count = len(barred)
    if depth < 1 or count == 0:
        return
    ball, wall = (index.ravel() for index in np.indices((len(far.radius), count)))
    keep = ~barred[wall]
    ball, wall = ball[keep], wall[keep]
    for rows in row_blocks(len(ball), 40, _BLOCK, 256):
        start = far.center[ball[rows]]
        nothing = np.zeros((len(start), 0), dtype=np.int64)
        empty = Beams(ball[rows], nothing, start, np.zeros((len(start), 0, 3)), np.zeros((len(start), 0)))
        beams = _through(clusters.rectangles, empty, wall[rows], far.radius)
        yield from _followed(clusters, beams, device, far, pairs, depth - 1)


def _followed(
    clusters: WallClusters, beams: Beams, device: BoundingBalls, far: BoundingBalls, pairs: Integers, more: int
) -> Iterator[FoundSequences]:
    """Yield the wall sequences of these beams, and of beams mirrored in up to `more` further walls."""
    yield _reaching(beams, device, pairs)
    if more == 0:
        return
    for rows in row_blocks(len(beams.ball), len(clusters.rectangles.center), _BLOCK, 256):
        block = take_rows(beams, rows)
        row, wall = clusters.reached(block.normal, block.offset)
        row, wall = _facing(clusters.rectangles, block, row, wall, far.radius)
        for some in row_blocks(len(row), 4 * (block.normal.shape[1] + 5), _BLOCK, 256):
            grown = _through(clusters.rectangles, take_rows(block, row[some]), wall[some], far.radius)
            yield from _followed(clusters, grown, device, far, pairs, more - 1)


def _facing(
    rectangles: Rectangles, beams: Beams, row: Integers, wall: Integers, radius: Floats
) -> tuple[Integers, Integers]:
    """Keep the pairs (beam, next wall) where part of the beam's last wall is on the image's side of the next wall."""
    last = beams.walls[row, 0]
    keep = wall != last
    row, wall, last = row[keep], wall[keep], last[keep]
    normal, offset = rectangles.normal[wall], rectangles.offset[wall]
    side = np.einsum("ni,ni->n", beams.image[row], normal) - offset
    middle = np.einsum("ni,ni->n", rectangles.center[last], normal) - offset
    reach = sum(np.abs(np.einsum("ni,ni->n", half[last], normal)) for half in rectangles.halves)
    ball = radius[beams.ball[row]]
    ahead = (side > -ball) & (middle + reach > -SURFACE_TOLERANCE)
    behind = (side < ball) & (middle - reach < SURFACE_TOLERANCE)
    keep = ahead | behind
    return row[keep], wall[keep]


def _through(rectangles: Rectangles, beams: Beams, wall: Integers, radius: Floats) -> Beams:
    """Mirror beams in a wall each (N,), and narrow them to that wall's bounding rectangle."""
    # A ball that reaches through the plane has beams on both sides.
    normal, offset = rectangles.normal[wall], rectangles.offset[wall]
    side = np.einsum("ni,ni->n", beams.image, normal) - offset
    ball = radius[beams.ball]
    ahead, behind = np.flatnonzero(side > -ball), np.flatnonzero(side < ball)
    row = np.concatenate([ahead, behind])
    front = np.concatenate([np.ones(len(ahead)), -np.ones(len(behind))])
    normal, offset, wall, ball, side = normal[row], offset[row], wall[row], ball[row], side[row]
    image = mirror(beams.image[row], normal, offset)
    new = _half_spaces(rectangles, wall, front[:, None] * normal, image, front * side, ball)
    turned = np.einsum("npi,ni->np", beams.normal[row], normal)
    old_normal = beams.normal[row] - 2.0 * turned[..., None] * normal[:, None]
    old_offset = beams.offset[row] - 2.0 * turned * offset[:, None]
    walls = np.concatenate([wall[:, None], beams.walls[row]], axis=1)
    return Beams(
        beams.ball[row], walls, image, np.concatenate([new[0], old_normal], axis=1),
        np.concatenate([new[1], old_offset], axis=1),
    )  # fmt: skip


def _half_spaces(
    rectangles: Rectangles, wall: Integers, front: Floats, image: Floats, height: Floats, radius: Floats
) -> tuple[Floats, Floats]:
    """Half-spaces that bound beams: normals (N, 5, 3), offsets (N, 5): wall's plane, its rectangle's four edges."""
    # Through each edge goes the plane that touches the image's ball, `height` (N,) behind the wall, such that ball and
    # beam are on different sides of it. With the edge's inward normal q, and the ball's centre at (m, -height) in the
    # frame (q, front), that plane leans by atan2(m, height) + asin(radius / distance) from q towards the front.
    inward = np.stack([s * d[wall] for d in rectangles.directions for s in (1.0, -1.0)], axis=1)
    edge = rectangles.center[wall][:, None] - np.stack(
        [s * h[wall] for h in rectangles.halves for s in (1.0, -1.0)], axis=1
    )
    across = np.einsum("nei,nei->ne", image[:, None] - edge, inward)
    distance = np.maximum(np.hypot(across, height[:, None]), np.finfo(np.float64).tiny)
    sine = np.minimum(radius[:, None] / distance, 1.0)
    cosine = np.sqrt(1.0 - sine**2)
    lean_cos = (height[:, None] * cosine - across * sine) / distance
    lean_sin = (across * cosine + height[:, None] * sine) / distance
    level = (lean_cos <= 0.0) | (radius[:, None] >= distance)  # no such plane: only the wall's own is left
    lean_cos, lean_sin = np.where(level, 0.0, lean_cos), np.where(level, 1.0, lean_sin)
    normal = lean_cos[..., None] * inward + lean_sin[..., None] * front[:, None]
    normal = np.concatenate([front[:, None], normal], axis=1)
    points = np.concatenate([rectangles.center[wall][:, None], edge], axis=1)
    return normal, np.einsum("nei,nei->ne", normal, points)


def _reaching(beams: Beams, device: BoundingBalls, pairs: Integers) -> FoundSequences:
    """Wall sequences of the beams into which a device's bounding ball reaches, of those paired with the far end's."""
    order = np.argsort(pairs[:, 1], kind="stable")
    first = np.searchsorted(pairs[order, 1], beams.ball)
    last = np.searchsorted(pairs[order, 1], beams.ball, side="right")
    row = np.repeat(np.arange(len(beams.ball)), last - first)
    place = np.arange(len(row)) - np.repeat(np.cumsum(last - first) - (last - first), last - first)
    ball = pairs[order[first[row] + place], 0]
    keep = np.ones(len(row), dtype=np.bool_)
    for plane in range(beams.normal.shape[1]):
        row, ball = row[keep], ball[keep]
        height = np.einsum("ni,ni->n", beams.normal[row, plane], device.center[ball]) - beams.offset[row, plane]
        keep = height >= -device.radius[ball] - SURFACE_TOLERANCE
    return FoundSequences(ball[keep], beams.ball[row[keep]], beams.walls[row[keep]])
