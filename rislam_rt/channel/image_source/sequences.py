"""Wall sequences that a specular leg can have, all of them: built from the far end and pruned by sides of planes."""

from collections.abc import Iterator

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.image_source.facets import WallFacets, row_blocks


def wall_sequences(facets: WallFacets, device: Floats, far: Floats, depth: int, host: int = -1) -> Iterator[Integers]:
    """Yield candidate wall sequences in blocks (S, d), in the order from device to far end, for d = 1 .. depth.

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
        yield from _in_blocks(level[ends_here], len(device))
        if bounces < depth:
            level, before = _extended(level, before, sides)


def _extended(level: Integers, before: Integers, sides: Integers) -> tuple[Integers, Integers]:
    """Put every possible wall in front of wall sequences (S, d); `before` (S,) are the side bits of their first wall on
    which the ray goes on.

    `sides[i, j]` tells on which sides of wall i wall j has a part.
    """
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


def _in_blocks(sequences: Integers, cycles: int) -> Iterator[Integers]:
    """Yield wall sequences in blocks, small enough for arrays over all cycles."""
    for rows in row_blocks(len(sequences), 16 * cycles):
        yield sequences[rows]
