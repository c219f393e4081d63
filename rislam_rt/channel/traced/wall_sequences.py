"""Wall sequences that the tracer tries, all that the positions of walls and ends leave possible, and their indices.

A reflection needs both its neighbours (a wall, or an end of the leg) on the same side of its plane. What that rules
out is not asked; everything else is, for every position, so no path depends on where rays happen to be shot. Where
that would be too many, cones from both ends (`cones.py`) rule out more, and nothing that exists.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple, Protocol

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, join_rows, row_blocks, take_rows
from rislam_rt.channel.specular_legs import NO_WALL
from rislam_rt.channel.walls import Walls
from rislam_rt.constants import SURFACE_TOLERANCE
from rislam_rt.errors import ConfigError

FRONT, BACK = 1, 2
"""Sides of a plane, as bits: a wall may have parts on both."""
MANY = 100_000
"""Number of wall sequences of one bounce count up to which all are tried at every position, without cones."""
MOST_LOOKS = 2_000_000_000
"""Largest number of wall sequences of one bounce count that may be tested: some minutes."""
MOST_SEQUENCES = 10_000_000
"""Largest number of wall sequences that may be left for tracing."""
_BLOCK = 4_000_000
"""Largest number of entries of a temporary table."""


def wall_sides(walls: Walls) -> Integers:
    """Side bits (W, W) that rule wall sequences out: on which sides of wall i's plane wall j is, 0 in the plane."""
    order = np.argsort(walls.wall_of_triangle, kind="stable")
    corners = walls.triangles[order].reshape(-1, 3)
    first = 3 * np.searchsorted(walls.wall_of_triangle[order], np.arange(len(walls)))
    sides = np.zeros((len(walls), len(walls)), dtype=np.int64)
    for rows in row_blocks(len(walls), len(corners), _BLOCK):
        height = walls.normal[rows] @ corners.T - walls.offset[rows, None]
        sides[rows] = np.where(np.maximum.reduceat(height, first, axis=1) > SURFACE_TOLERANCE, FRONT, 0)
        sides[rows] |= np.where(np.minimum.reduceat(height, first, axis=1) < -SURFACE_TOLERANCE, BACK, 0)
    return sides


def point_sides(walls: Walls, points: Floats) -> Integers:
    """Side bits (N, W) that rule wall sequences out: on which side of wall j's plane point i is, 0 in the plane."""
    height = points @ walls.normal.T - walls.offset
    return np.where(height > SURFACE_TOLERANCE, FRONT, np.where(height < -SURFACE_TOLERANCE, BACK, 0))


class Narrowing(Protocol):
    """Protocol of a test that rules out wall sequences by where their ends are, as `Cones` do."""

    def lead_on(self, walls: Integers) -> Booleans:
        """Which wall sequences (N, d), complete or to be extended, the far ends leave possible."""
        ...

    def reach(self, walls: Integers) -> Booleans:
        """Which complete wall sequences (N, d) both ends leave possible."""
        ...


def possible_sequences(
    sides: Integers, device: Integers, far: Integers, depth: int, barred: Booleans | None = None,
    narrowing: Callable[[], Narrowing] | None = None,
) -> tuple[Integers, bool]:  # fmt: skip
    """Wall sequences (S, depth) of up to `depth` bounces, from device to far end, padded with `NO_WALL`.

    Also whether these are all that sides allow (else they have been narrowed).

    Parameters
    ----------
    sides
        (W, W) of `wall_sides`.
    device, far
        (W,) sides of every wall on which the ends ever are.
    barred
        (W,) walls that may not come last.
    narrowing
        Makes what rules out sequences, taken once there are more than `MANY` to rule out.

    Raises
    ------
    ConfigError
        There are more than `MOST_LOOKS` to look at, or more than `MOST_SEQUENCES` are left.
    """
    last = np.flatnonzero((far > 0) if barred is None else (far > 0) & ~barred)
    level, onward = last[:, None], far[last]
    found = [np.full((1, depth), NO_WALL)]
    pruning: Narrowing | None = None
    for bounces in range(1, depth + 1):
        blocks = [(level, onward)]
        if bounces > 1:
            count = _growth(level, onward, sides)
            _check(count, MOST_LOOKS, sides, depth, "allow")
            if pruning is None and count > MANY and narrowing is not None:
                pruning = narrowing()
            blocks = _with_wall_before(level, onward, sides)  # type: ignore[assignment]
        levels = [(np.zeros((0, bounces), dtype=np.int64), np.zeros(0, dtype=np.int64))]
        for longer, ahead in blocks:
            if pruning is not None:
                keep = pruning.lead_on(longer)
                longer, ahead = longer[keep], ahead[keep]
            if bounces < depth:
                levels.append((longer, ahead))
            complete = longer[(device[longer[:, 0]] & ahead) > 0]
            complete = complete[pruning.reach(complete)] if pruning is not None and len(complete) else complete
            found.append(np.pad(complete, ((0, 0), (0, depth - bounces)), constant_values=NO_WALL))
            _check(sum(map(len, found)), MOST_SEQUENCES, sides, depth, "leave")
        level, onward = (np.concatenate(part) for part in zip(*levels, strict=True))
    return np.concatenate(found), pruning is None


def _growth(level: Integers, onward: Integers, sides: Integers) -> int:
    """Number of wall sequences that putting one more wall in front of sequences (S, d) makes."""
    walls, rows = np.unique(np.stack([level[:, 0], onward], axis=1), axis=0, return_counts=True)
    return sum(int(n) * int(((sides[wall] & side) > 0).sum()) for (wall, side), n in zip(walls, rows, strict=True))


def _check(count: int, most: int, sides: Integers, depth: int, verb: str) -> None:
    """Raise `ConfigError` for more wall sequences than can be tested in an hour or held in memory."""
    if count > most:
        raise ConfigError(
            f"depth: {depth} received; {len(sides)} walls {verb} {count} sequences, more than {most}: "
            "lower the depth, or merge the scene's small facets"
        )


def _with_wall_before(level: Integers, onward: Integers, sides: Integers) -> Iterator[tuple[Integers, Integers]]:
    """Put every possible wall in front of wall sequences (S, d), block by block."""
    # `onward` (S,) are the side bits of their first wall on which the ray goes on; the longer ones come with theirs.
    for rows in row_blocks(len(level), len(sides), _BLOCK):
        first = level[rows, 0]
        row, wall = np.nonzero(((sides[first] & onward[rows, None]) > 0) & (sides[:, first].T > 0))
        yield np.concatenate([wall[:, None], level[rows][row]], axis=1), sides[wall, first[row]]


class CandidateIndices(NamedTuple):
    """N candidates or legs, as indices into tables of far ends, devices and sequences, (N,) each."""

    far: Integers
    device: Integers
    sequence: Integers


def in_blocks(parts: Iterable[CandidateIndices], size: int) -> Iterator[CandidateIndices]:
    """Yield candidates for legs (indices of wall sequences) in blocks of `size` rows, the last one shorter."""
    waiting: list[CandidateIndices] = []
    for part in parts:
        waiting.append(part)
        while (count := sum(len(rows.far) for rows in waiting)) >= size:
            together = join_rows(waiting)
            yield take_rows(together, slice(0, size))
            waiting = [take_rows(together, slice(size, count))]
    if waiting:
        yield join_rows(waiting)
