"""Floor plans: rooms, walls, doors and windows seen from above, and how they are written as corners or as GeoJSON."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import RislamError
from rislam_rt.scene.findings import Fault, one_line
from rislam_rt.scene.importing.materials import parse_material
from rislam_rt.scene.polygons import signed_area, triangulate

KINDS = ("room", "wall", "door", "window")
"""Kinds of shapes on a floor plan."""
SPANS = {"door": (0.0, 2.0), "window": (0.9, 2.1)}
"""Lower and upper edge [m] of doors and windows of a floor plan that says nothing else."""
CLOSED_WITH = {"door": "itu:wood", "window": "itu:glass"}
"""Materials that close doors and windows of a floor plan that names none."""
MAX_SHAPES = 5_000
"""Most shapes of a floor plan."""


class PlanShape(NamedTuple):
    """A line or an area of a floor plan, with what the file says about it."""

    kind: str
    """One of `KINDS`."""
    points: Floats
    """(n, 2) in the file's units."""
    closed: bool
    about: dict[str, Any]
    """`name`, `material`, `open`, `bottom`, `top`, as far as given."""


class Opening(NamedTuple):
    """A door or window of a floor plan."""

    name: str
    ends: Floats
    """(2, 2) [m] of its line along the wall."""
    bottom: float
    """Height [m] of the lower edge above the floor."""
    top: float
    """Height [m] of the upper edge above the floor."""
    material: dict[str, Any] | None
    """Material of what closes it; None for a hole."""


@dataclass(frozen=True, slots=True, eq=False)
class FloorPlan:
    """A floor plan in metres: rooms, walls that are drawn by themselves, doors and windows."""

    rooms: list[Floats]
    """Corners (n, 2) of each room, counter-clockwise."""
    walls: list[tuple[Floats, dict[str, Any] | None, str]]
    """Line (2, 2), material and name of each wall that is drawn by itself."""
    openings: list[Opening]


def parse_corners(text: str) -> list[PlanShape]:
    """Parse a text of corners, `0,0 4,0 4,3 0,3`, into the shape of a floor plan of one room.

    Raises
    ------
    Fault
        A corner is not two numbers.
    """
    corners = []
    for word in text.replace(";", " ").split():
        try:
            x, y = (float(part) for part in word.split(","))
        except ValueError:
            what = f"--floorplan: '{one_line(word)[:40]}' is no corner"
            raise Fault(what, 'give x,y in metres, e.g. "0,0 4,0 4,3 0,3"') from None
        corners.append([x, y])
    return [PlanShape("room", np.array(corners).reshape(-1, 2), True, {})]


def parse_geojson(content: bytes) -> list[PlanShape]:
    """Parse a GeoJSON file into the shapes of a floor plan: polygons are rooms, lines walls, unless `kind` says else.

    Raises
    ------
    Fault
        Not GeoJSON, or a feature of a kind that a plan has not.
    """
    try:
        table = json.loads(content.decode("utf-8"))
        features = list(_features(table))
    except (ValueError, RecursionError, AttributeError, TypeError, KeyError) as error:
        raise Fault(f"not readable GeoJSON ({one_line(str(error))[:60]})", "export it again") from None
    shapes = []
    for number, (geometry, about) in enumerate(features):
        about = about if isinstance(about, dict) else {}
        try:
            shapes += list(_shapes(geometry, about))
        except (ValueError, TypeError, KeyError, AttributeError):
            raise Fault(f"feature {number} has no readable coordinates", "give [x, y] pairs of numbers") from None
    return shapes


def _features(table: Any) -> Iterator[tuple[Any, Any]]:
    """Geometry and properties of every feature of a floor plan's GeoJSON table."""
    if table["type"] == "FeatureCollection":
        for feature in table["features"]:
            yield from _features(feature)
    elif table["type"] == "Feature":
        yield table["geometry"], table.get("properties") or {}
    else:
        yield table, {}


def _shapes(geometry: Any, about: dict[str, Any]) -> Iterator[PlanShape]:
    """Shapes of a floor plan from one GeoJSON geometry and its properties."""
    kind, found = geometry["type"], geometry.get("coordinates")
    many = {"MultiPolygon": "Polygon", "MultiLineString": "LineString"}
    if kind in many:
        for part in found:
            yield from _shapes({"type": many[kind], "coordinates": part}, about)
        return
    if kind not in ("Polygon", "LineString"):
        raise Fault(f"a geometry of type '{one_line(str(kind))[:30]}'", "give polygons and lines")
    closed = kind == "Polygon"
    rows = found[0] if closed else found
    points = np.array([[float(x) for x in row[:2]] for row in rows]).reshape(-1, 2)
    if closed and len(found) > 1:
        raise Fault("a room with a hole in it", "draw what stands in it as walls")
    yield PlanShape(str(about.get("kind", "room" if closed else "wall")).lower(), points, closed, about)


def build_plan(shapes: list[PlanShape], unit: float, height: float) -> FloorPlan:
    """Build a floor plan in metres from shapes in a file's unit [m], each checked; `height` [m] is that of its rooms.

    Raises
    ------
    Fault
        Nothing in it, a room that crosses itself, a number or a material that makes no sense.
    """
    if not any(shape.kind in ("room", "wall") for shape in shapes):
        raise Fault("no room and no wall in it", "draw rooms as closed shapes, or walls as lines")
    if len(shapes) > MAX_SHAPES:
        raise Fault(f"{len(shapes)} shapes", f"leave furniture and lettering out: {MAX_SHAPES} are the most")
    plan = FloorPlan([], [], [])
    for number, shape in enumerate(shapes):
        if shape.kind not in KINDS:
            raise Fault(f"shape {number} is a '{one_line(shape.kind)[:30]}'", f"give one of {', '.join(KINDS)}")
        try:
            _add(plan, shape, unit, height)
        except RislamError as error:
            label, (what, _, mend) = shape.about.get("name", number), one_line(str(error)).rpartition("; ")
            raise Fault(f"{shape.kind} {one_line(str(label))[:40]}: {what}", mend) from None
    return plan


def _add(plan: FloorPlan, shape: PlanShape, unit: float, height: float) -> None:
    """Put one shape into a floor plan, in metres: a room, walls, or an opening."""
    points = shape.points * unit
    if not np.isfinite(points).all() or np.abs(points).max(initial=0.0) > 1e5:
        raise Fault("a coordinate is not finite or beyond 100 km", "give metres, or --units")
    if shape.kind == "room":
        plan.rooms.append(_room(points))
        return
    material = _material(shape)
    if shape.kind == "wall":
        ends = np.concatenate([points, points[:1]]) if shape.closed else points
        lines = [np.stack(pair) for pair in pairwise(ends) if np.linalg.norm(pair[1] - pair[0])]
        if not lines:
            raise Fault("it has no length", "give two points")
        plan.walls.extend((line, material, str(shape.about.get("name", ""))) for line in lines)
        return
    bottom, top = (_number(shape, key, usual) for key, usual in zip(("bottom", "top"), SPANS[shape.kind], strict=True))
    if not 0.0 <= bottom < top or bottom >= height:
        raise Fault(f"from {bottom:g} m to {top:g} m in a room of {height:g} m", "mend bottom and top")
    name = str(shape.about.get("name", "") or shape.kind)
    plan.openings.append(Opening(name, _middle_line(points), bottom, min(top, height), material))


def _room(points: Floats) -> Floats:
    """Corners (n, 2) [m] of a room on a floor plan, counter-clockwise, none of them twice."""
    after = np.roll(points, -1, axis=0)
    points = points[np.linalg.norm(after - points, axis=1) > 1e-6]
    if len(points) < 3:
        raise Fault(f"{len(points)} corners", "give three or more")
    points = points if signed_area(points) > 0.0 else points[::-1]
    if abs(signed_area(points)) < 1e-4 or triangulate(points, []) is None:
        raise Fault("its outline crosses itself or has no area", "give the corners in order around the room")
    return points


def _material(shape: PlanShape) -> dict[str, Any] | None:
    """Material of a wall on a floor plan, or of what closes an opening; doors are open unless they say otherwise."""
    text = shape.about.get("material")
    given = shape.about.get("open")
    is_open = shape.kind == "door" and text is None if given is None else str(given).lower() in ("true", "1", "yes")
    if shape.kind in SPANS and is_open:
        return None
    if text is None:
        return parse_material(CLOSED_WITH[shape.kind]) if shape.kind in SPANS else None
    return parse_material(str(text))


def _number(shape: PlanShape, key: str, usual: float) -> float:
    """Number that a shape of a floor plan gives for a key, or else the usual one."""
    try:
        value = float(shape.about.get(key, usual))
    except (TypeError, ValueError):
        value = float("nan")
    if not abs(value) < 1e3:
        raise Fault(f"{key} = '{one_line(str(shape.about.get(key)))[:30]}'", "give metres")
    return value


def _middle_line(points: Floats) -> Floats:
    """Line (2, 2) [m] on a floor plan that a door or window stands for: the long axis of its points."""
    middle = points.mean(axis=0)
    along = np.linalg.svd(points - middle)[2][0]
    reach = (points - middle) @ along
    if np.ptp(reach) < 0.01:
        raise Fault("it is narrower than a centimetre", "draw it along its wall")
    return np.stack([middle + reach.min() * along, middle + reach.max() * along])
