"""Estimate of a sweep's cost, the time that is left, from the times of the cells done so far."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from rislam_rt.sweeps.sweep import Cell


class SweepCost(NamedTuple):
    """Estimated time of the cells of a sweep that are left."""

    cells: int
    """Number of cells left."""
    cell_seconds: float | None
    """Mean time of one cell [s]; None before any is done."""
    seconds: float | None
    """Time until all are done [s]; None before any is done."""


def estimate_cost(left: Sequence[Cell], known: Sequence[Mapping[str, Any]], width: int) -> SweepCost:
    """Estimate the time of the cells left, run `width` at a time, each from the mean of done cells of similar settings.

    The most similar cells share the most values along the axes: if the number of particles is an axis, cells with the
    same number count rather than others.
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
    """Mean time [s] of the known cells that share the most values along the axes with a point."""
    shared = [sum(other["point"].get(key) == value for key, value in point.items()) for other in known]
    most = max(shared)
    seconds = [float(other["seconds"]) for other, number in zip(known, shared, strict=True) if number == most]
    return sum(seconds) / len(seconds)
