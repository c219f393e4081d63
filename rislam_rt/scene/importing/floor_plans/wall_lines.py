"""Lines of the walls of a floor plan: walls on one straight line joined, ends that nearly meet a wall brought to it."""

from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.importing.floor_plans.floor_plan import FloorPlan

SAME_LINE = 5e-3
"""Distance [m] of two walls' lines below which they are one."""
PARALLEL = np.radians(0.2)
"""Angle [rad] of two walls below which they are parallel."""
SNAP = 0.05
"""Distance [m] of a wall's end from another wall up to which it is brought to it."""
Spans = list[tuple[float, float]]


class Line(NamedTuple):
    """A straight line of walls on a floor plan."""

    start: Floats
    """(2,) [m] point of the line from which `spans` count."""
    along: Floats
    """(2,) unit vector along the line."""
    spans: Spans
    """From where to where [m] along the line there is wall."""
    material: dict[str, Any] | None
    name: str

    @property
    def across(self) -> Floats:
        """Unit vector (2,) to the left of a line of walls."""
        return np.array([-self.along[1], self.along[0]])

    def at(self, place: float, height: float) -> Floats:
        """Point (3,) [m] at a place [m] along the line of walls and a height [m]."""
        return np.append(self.start + place * self.along, height)

    def distance(self, points: Floats) -> Floats:
        """Signed distances (...,) [m] of points (..., 2) from a line of walls, positive to its left."""
        return np.asarray((points - self.start) @ self.across)


def wall_lines(plan: FloorPlan) -> list[Line]:
    """Lines of all walls of a floor plan, joined along one line; rooms' edges yield to walls drawn themselves."""
    edges = [np.stack([a, b]) for room in plan.rooms for a, b in zip(room, np.roll(room, -1, axis=0), strict=True)]
    lines: list[Line] = []
    for ends, material, name in [*plan.walls, *((edge, None, "") for edge in edges)]:
        length = float(np.linalg.norm(ends[1] - ends[0]))
        if length < 1e-3:
            continue
        along = (ends[1] - ends[0]) / length
        mine = [k for k in lines if is_on_line(k, ends, along)]
        places = [(0.0, length)]
        for other in mine:
            if other.material == material and other.name == name:
                continue
            there = (other.start + np.outer(np.ravel(other.spans), other.along) - ends[0]) @ along
            places = without_span(places, float(there.min()), float(there.max()))
        same = next((k for k in mine if k.material == material and k.name == name), None)
        if same is None:
            if places:
                lines.append(Line(ends[0], along, places, material, name))
            continue
        for low, high in places:
            ends_on = sorted(float((ends[0] + p * along - same.start) @ same.along) for p in (low, high))
            same.spans[:] = _joined_spans([*same.spans, (ends_on[0], ends_on[1])])
    return [line._replace(spans=snapped_spans(line, lines)) for line in lines]


def is_on_line(line: Line, ends: Floats, along: Floats) -> bool:
    """Whether a wall from one end to the other (2, 2) [m] lies on a floor plan's line of walls and along it."""
    turn = abs(float(line.along[0] * along[1] - line.along[1] * along[0]))
    return turn < PARALLEL and float(np.abs(line.distance(ends)).max()) < SAME_LINE


def _joined_spans(spans: Spans) -> Spans:
    """Spans of a wall's line in order, those that touch joined."""
    found: Spans = []
    for low, high in sorted(spans):
        if found and low <= found[-1][1] + SAME_LINE:
            found[-1] = (found[-1][0], max(found[-1][1], high))
        else:
            found.append((low, high))
    return found


def without_span(spans: Spans, low: float, high: float) -> Spans:
    """Spans of a floor plan's line of walls with what lies from `low` to `high` cut out."""
    found: Spans = []
    for a, b in spans:
        found += [(x, y) for x, y in ((a, min(b, low)), (max(a, high), b)) if y - x > SAME_LINE]
    return found


def snapped_spans(line: Line, lines: list[Line]) -> Spans:
    """Spans of a wall's line with their ends brought to the walls that they nearly touch."""
    meets = []
    for other in lines:
        slope = float(line.along @ other.across)
        if abs(slope) > np.sin(np.radians(5.0)):
            place = -float(other.distance(line.start)) / slope
            on = float((line.start + place * line.along - other.start) @ other.along)
            if any(low - SNAP <= on <= high + SNAP for low, high in other.spans):
                meets.append(place)
    found = []
    for span in line.spans:
        nearest = [min(meets, key=lambda place: abs(place - end), default=end) for end in span]
        low, high = (best if abs(best - end) <= SNAP else end for best, end in zip(nearest, span, strict=True))
        if high - low > SAME_LINE:
            found.append((low, high))
    return found
