"""What a sweep will cost, from what its cells have cost so far."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rislam_rt.sweeps.sweep import Cell


class SweepCost(NamedTuple):
    """Of the cells that are left."""

    cells: int
    cell_seconds: float | None
    """Mean time of one [s]; None while nothing is known."""
    seconds: float | None
    """Time until all are done [s], so many at a time."""


def estimate_cost(left: Sequence[Cell], known: Sequence[Mapping[str, Any]], width: int) -> SweepCost:
    """Cost of the cells that are left, in time, `width` at a time: the mean of those at the most similar settings.

    Similar is who has the most values of the axes in common: if the number of particles is an axis, cells with as many
    particles tell more than the others.
    """
    if not left:
        return SweepCost(0, None, 0.0)
    if not known:
        return SweepCost(len(left), None, None)
    points: dict[str, tuple[Mapping[str, Any], int]] = {}
    for cell in left:
        key = repr(cell.point)
        points[key] = cell.point, points.get(key, (cell.point, 0))[1] + 1
    each = [(_similar(point, known), count) for point, count in points.values()]
    total = sum(seconds * count for seconds, count in each)
    return SweepCost(
        len(left), total / len(left), max(total / min(width, len(left)), max(seconds for seconds, _ in each))
    )


def _similar(point: Mapping[str, Any], known: Sequence[Mapping[str, Any]]) -> float:
    shared = [sum(other["point"].get(key) == value for key, value in point.items()) for other in known]
    most = max(shared)
    seconds = [float(other["seconds"]) for other, number in zip(known, shared, strict=True) if number == most]
    return sum(seconds) / len(seconds)
