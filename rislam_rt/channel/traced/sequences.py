"""Which wall sequences the tracer is asked about: all that the walls' places in the room leave possible.

A reflection needs both its neighbours (a wall, or an end of the leg) on the same side of its plane. What that rules
out is not asked; everything else is, for every position, so no path depends on where rays happen to be shot.
"""

from collections.abc import Iterator

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.walls import Walls
from rislam_rt.constants import SURFACE_TOLERANCE
from rislam_rt.errors import ConfigError

FRONT, BACK = 1, 2
"""Sides of a plane, as bits: a wall may have parts on both."""

NO_WALL = -1
"""Padding of sequences."""

MOST_SEQUENCES = 10_000_000
"""Largest number of wall sequences of one bounce count."""

_BLOCK = 4_000_000
"""Largest number of entries of a temporary table."""


def wall_sides(walls: Walls) -> Integers:
    """(W, W): on which sides of wall i's plane wall j has parts."""
    order = np.argsort(walls.wall_of_triangle, kind="stable")
    corners = walls.triangles[order].reshape(-1, 3)
    first = 3 * np.searchsorted(walls.wall_of_triangle[order], np.arange(len(walls)))
    sides = np.zeros((len(walls), len(walls)), dtype=np.int64)
    for rows in _blocks(len(walls), len(corners)):
        height = walls.normal[rows] @ corners.T - walls.offset[rows, None]
        sides[rows] = np.where(np.maximum.reduceat(height, first, axis=1) > SURFACE_TOLERANCE, FRONT, 0)
        sides[rows] |= np.where(np.minimum.reduceat(height, first, axis=1) < -SURFACE_TOLERANCE, BACK, 0)
    return sides


def point_sides(walls: Walls, points: Floats) -> Integers:
    """(N, W): on which side of wall j's plane point i lies; 0 in the plane."""
    height = points @ walls.normal.T - walls.offset
    return np.where(height > SURFACE_TOLERANCE, FRONT, np.where(height < -SURFACE_TOLERANCE, BACK, 0))


def possible_sequences(
    sides: Integers, device: Integers, far: Integers, depth: int, barred: Booleans | None = None
) -> Integers:
    """Wall sequences (S, depth) of up to `depth` bounces, from device to far end, padded with `NO_WALL`.

    Parameters
    ----------
    sides
        (W, W) of `wall_sides`.
    device, far
        (W,) sides of every wall on which the ends ever are.
    barred
        (W,) walls that may not come last.

    Raises
    ------
    ConfigError
        There are more than `MOST_SEQUENCES`.
    """
    last = np.flatnonzero((far > 0) if barred is None else (far > 0) & ~barred)
    level, onward = last[:, None], far[last]
    found = [np.full((1, depth), NO_WALL)]
    for bounces in range(1, depth + 1):
        complete = level[(device[level[:, 0]] & onward) > 0]
        found.append(np.pad(complete, ((0, 0), (0, depth - bounces)), constant_values=NO_WALL))
        if bounces < depth:
            _check_growth(level, onward, sides, depth)
            level, onward = _with_wall_before(level, onward, sides)
    return np.concatenate(found)


def _check_growth(level: Integers, onward: Integers, sides: Integers, depth: int) -> None:
    """Refuse what would not end in an hour or fit the memory, before it is built."""
    walls, rows = np.unique(np.stack([level[:, 0], onward], axis=1), axis=0, return_counts=True)
    count = sum(int(n) * int(((sides[wall] & side) > 0).sum()) for (wall, side), n in zip(walls, rows, strict=True))
    if count > MOST_SEQUENCES:
        raise ConfigError(
            f"depth: {depth} received; {len(sides)} walls allow {count} sequences, more than {MOST_SEQUENCES}: "
            "lower the depth, or merge the scene's small facets"
        )


def turned_round(sequences: Integers) -> Integers:
    """Sequences (S, D) in the opposite order, padding kept at the end."""
    index = (sequences != NO_WALL).sum(axis=1)[:, None] - 1 - np.arange(sequences.shape[1])
    return np.where(index >= 0, np.take_along_axis(sequences, np.maximum(index, 0), axis=1), NO_WALL)


def _with_wall_before(level: Integers, onward: Integers, sides: Integers) -> tuple[Integers, Integers]:
    """Put every possible wall in front of sequences (S, d); `onward` (S,) is where they go on their first wall."""
    grown: list[Integers] = [np.zeros((0, level.shape[1] + 1), dtype=np.int64)]
    for rows in _blocks(len(level), len(sides)):
        first = level[rows, 0]
        row, wall = np.nonzero(((sides[first] & onward[rows, None]) > 0) & (sides[:, first].T > 0))
        grown.append(np.concatenate([wall[:, None], level[rows][row]], axis=1))
    longer = np.concatenate(grown)
    return longer, sides[longer[:, 0], longer[:, 1]]


def _blocks(count: int, width: int) -> Iterator[slice]:
    """Slices of `count` rows such that rows times width stay bounded."""
    step = max(1, _BLOCK // max(width, 1))
    for start in range(0, count, step):
        yield slice(start, min(start + step, count))
