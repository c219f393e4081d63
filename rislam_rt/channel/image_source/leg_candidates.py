"""Candidates for specular legs, as pairs of cycle and wall sequence: all sequences, or what beam tracing leaves."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, row_blocks
from rislam_rt.channel.image_source.beam_tracing import (
    BoundingBalls,
    FoundSequences,
    WallClusters,
    build_clusters,
    enclosing_balls,
    group_positions,
    search_beams,
)
from rislam_rt.channel.image_source.wall_facets import WallFacets

FEW = 2000
"""Number of wall sequences up to which `auto` tries all of them; beyond it beam tracing is faster."""
NEAR = 0.03
"""Radius within which positions share their beams, as a share of the room's diagonal."""
_ROWS = 200_000
"""Candidates in a block."""
SEARCHES = ("auto", "exhaustive", "beams")
"""Values of `ImageSourceChannel.search`."""


class SequenceSearch(NamedTuple):
    """Search for the wall sequences of legs: exhaustive or by beam tracing, and in which walls."""

    facets: WallFacets
    clusters: WallClusters
    exhaustive: bool
    near: float
    """[m] Largest radius of positions that share beams."""

    @property
    def words(self) -> str:
        """Name of the search for wall sequences, as `Paths.source` states it."""
        return "all wall sequences" if self.exhaustive else "mirrored beams"


def build_search(facets: WallFacets, depth: int, how: str) -> SequenceSearch:
    """Set up the search for wall sequences: exhaustive or by beam tracing, `auto` choosing by their number."""
    count = sum(len(facets) * max(len(facets) - 1, 0) ** (bounces - 1) for bounces in range(1, depth + 1))
    diagonal = np.linalg.norm(facets.box[1].max(axis=0) - facets.box[0].min(axis=0)) if len(facets) else 0.0
    exhaustive = how == "exhaustive" or (how == "auto" and count <= FEW)
    return SequenceSearch(facets, build_clusters(facets), exhaustive, NEAR * float(diagonal))


def candidate_rows(
    search: SequenceSearch, device: Floats, far: Floats, depth: int, host: int
) -> Iterator[tuple[Integers, Integers]]:
    """Yield candidates for specular legs, cycles (N,) and wall sequences (N, d), in blocks of one d each.

    Parameters
    ----------
    device, far
        (K, 3), and (K, 3) or (1, 3) [m].
    host
        Wall behind a panel: neither it nor a wall that lies on it may come last; -1 for none.
    """
    if search.exhaustive:
        for sequences in wall_sequences(search.facets, device, far, depth, host):
            row, cycle = (index.ravel() for index in np.indices((len(sequences), len(device))))
            yield cycle, sequences[row]
        return
    facets = search.facets
    barred = (facets.plane == facets.plane[host]) if host >= 0 else np.zeros(len(facets), dtype=np.bool_)
    groups = group_positions(np.concatenate([device, far], axis=1) if len(far) > 1 else device, search.near)
    devices = enclosing_balls(device, groups)
    number = np.arange(len(groups))
    far_balls = enclosing_balls(far, groups) if len(far) > 1 else BoundingBalls(far, np.zeros(1))
    pairs = np.stack([number, number if len(far) > 1 else np.zeros_like(number)], axis=-1)
    for found in search_beams(search.clusters, devices, far_balls, pairs, depth, barred):
        yield from _rows(found, groups)


def _rows(found: FoundSequences, groups: list[Integers]) -> Iterator[tuple[Integers, Integers]]:
    """Yield candidates in blocks: each wall sequence found, with every cycle of its device's bounding ball."""
    if len(found.device) == 0:
        return
    sizes = np.array([len(group) for group in groups])
    start = np.concatenate([[0], np.cumsum(sizes)])
    cycles = np.concatenate(groups)
    ends = np.cumsum(sizes[found.device])
    cut = np.searchsorted(ends, np.arange(0, int(ends[-1]), _ROWS))
    for first, last in zip(cut, [*cut[1:], len(ends)], strict=True):
        ball, walls = found.device[first:last], found.walls[first:last]
        row = np.repeat(np.arange(len(ball)), sizes[ball])
        place = np.arange(len(row)) - np.repeat(np.cumsum(sizes[ball]) - sizes[ball], sizes[ball])
        yield cycles[start[ball[row]] + place], walls[row]


def wall_sequences(facets: WallFacets, device: Floats, far: Floats, depth: int, host: int = -1) -> Iterator[Integers]:
    """Yield candidate wall sequences of image-source legs, in blocks (S, d) from device to far end, d = 1 .. depth.

    No wall comes twice in a row. At every bounce what comes before and what comes after (a wall, or the ends) must
    have a part on the same side of the wall in between; no possible path is lost by this.

    Parameters
    ----------
    device, far
        (K, 3) all positions of either end [m].
    host
        A wall that may not come last, nor what lies on it (the one that a panel hangs on), -1 for none.
    """
    if depth < 1 or len(facets) == 0:
        return
    device_side, far_side = facets.point_sides(device), facets.point_sides(far)
    sides = facets.sides() if depth > 1 else np.zeros((len(facets), len(facets)), dtype=np.int64)
    last = np.flatnonzero(far_side > 0)
    level = (last if host < 0 else last[facets.plane[last] != facets.plane[host]])[:, None]
    before = far_side[level[:, 0]]
    for bounces in range(1, depth + 1):
        ends_here = (device_side[level[:, 0]] & before) > 0
        complete = level[ends_here]
        yield from (complete[rows] for rows in row_blocks(len(complete), 16 * len(device)))
        if bounces < depth:
            level, before = _extended(level, before, sides)


def _extended(level: Integers, before: Integers, sides: Integers) -> tuple[Integers, Integers]:
    """Candidates one bounce longer: every possible wall in front of wall sequences (S, d); `before` (S,) are the side
    bits of their first wall on which the ray goes on."""
    # `sides[i, j]` tells on which sides of wall i wall j has a part.
    grown, seen_from = [], []
    for rows in row_blocks(len(level), len(sides)):
        first = level[rows, 0]
        row, wall = np.nonzero((sides[first] & before[rows, None]) > 0)
        grown.append(np.concatenate([wall[:, None], level[rows][row]], axis=1))
        seen_from.append(sides[wall, first[row]])
    kept = [side > 0 for side in seen_from]
    return (
        np.concatenate([g[k] for g, k in zip(grown, kept, strict=True)] or [np.zeros((0, level.shape[1] + 1), int)]),
        np.concatenate([s[k] for s, k in zip(seen_from, kept, strict=True)] or [np.zeros(0, int)]),
    )
