"""Candidates for specular legs, as pairs of cycle and wall sequence: all sequences, or what beam tracing leaves."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.image_source.beams import (
    BoundingBalls,
    FoundSequences,
    enclosing_balls,
    group_positions,
    search_beams,
)
from rislam_rt.channel.image_source.clusters import WallClusters, build_clusters
from rislam_rt.channel.image_source.facets import WallFacets
from rislam_rt.channel.image_source.sequences import wall_sequences

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
    """Yield candidates for specular legs, cycles (N,) and wall sequences (N, d) from device to far end, in blocks of
    one d each.

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
