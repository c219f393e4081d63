"""Scene check of units: numbers too large by the factor between two units, found whatever else is wrong.

It looks at the scene file as a plain table and at whatever meshes could be read, so that a missing key or a start
outside the room does not hide that the room was drawn in millimetres.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import Reflector, Trajectory
from rislam_rt.scene.findings import Finding, warning_at
from rislam_rt.scene.mesh_placement import UNITS

NAMES = {"millimetres": "mm", "centimetres": "cm", "inches": "in"}
"""Units other than metres that rooms are drawn in, and their names in a scene file."""
GUESSES = ("centimetres", "millimetres", "inches")
"""Units that points and lengths are given in by mistake, in the order in which they are named."""
LARGEST_ROOM, SMALLEST_ROOM = 300.0, 1.0
"""Longest side [m] of the largest hall, and of the smallest box that an agent could move in, taken for meant."""
MANY = 20.0
"""Ratio of how far meshes of one room reach, above which they are in different units."""
USUAL_ROOM = (2.0, 100.0)
"""Range [m] of the longest side of rooms, to tell which unit was meant."""
FAR = 3.0
"""Distance of a point from the room, in sizes of the room, above which it was given in another unit."""
LONGEST_CYCLE = 10.0
"""Longest cycle [s] taken for meant."""
WIDEST_SPACING = 0.5
"""Largest spacing [m] of a RIS panel's elements taken for meant."""
LIMITS = (
    (("ris", "spacing_m"), WIDEST_SPACING, "m", "millimetres", 1e-3),
    (("reflector", "material", "thickness_m"), 3.0, "m", "millimetres", 1e-3),
    (("agent", "cycle_s"), LONGEST_CYCLE, "s", "milliseconds", 1e-3),
    (("agent", "velocity"), 10.0, "m/s", "millimetres a second", 1e-3),
    (("agent", "speed_m_s"), 10.0, "m/s", "millimetres a second", 1e-3),
    (("scatterer", "radius"), 2.0, "m", "millimetres", 1e-3),
    (("scatterer", "height_m"), 10.0, "m", "millimetres", 1e-3),
    (("agent", "tx_offset_m"), 2.0, "m", "millimetres", 1e-3),
    (("agent", "rx_offset_m"), 2.0, "m", "millimetres", 1e-3),
)
"""Keys of the scene file, largest value meant indoors, its unit, the unit that would make it usual, and the factor."""

SPEED_FIELD = "agent.velocity"
"""Key of the scene file that the check of the motion itself looks at too, in a scene that has no errors."""
ROOM_FIELD = "meshes.units"
"""Key of the scene file that findings on the size of the whole room name."""


def unit_warnings(file: str, table: Mapping[str, Any], bounds: Floats | None) -> Iterator[Finding]:
    """Scene check: warnings of every number of a scene file that looks as if it were in another unit.

    Parameters
    ----------
    table
        The file's content as TOML gave it; of values of a wrong type nothing is said.
    bounds
        (2, 3) [m] of the meshes that could be read; None if none could.
    """
    for path, limit, unit, other, factor in LIMITS:
        for field, value in _values(table, path):
            if abs(value) > limit:
                message = f"{value:g} {unit}; in {other} it would be {value * factor:g} {unit}"
                yield warning_at(file, field, message, "give metres and seconds")
    if bounds is None:
        return
    room = _room_unit(bounds)
    if room is not None:
        yield warning_at(file, ROOM_FIELD, *room)
        return  # points in metres lie outside a room in millimetres, or in its corner
    for path in (("agent", "start"), ("ris", "center"), ("scatterer", "position"), ("agent", "waypoints")):
        for field, point in _points(table, path):
            yield from _far_point(file, field, point, bounds)


def recording_unit_warnings(file: str, agent: Trajectory, bounds: Floats) -> Iterator[Finding]:
    """Scene check: warnings of a recording whose times or places look as if they were in another unit; `bounds`
    (2, 3) [m] are those of the meshes."""
    field, step = "agent.trajectory", np.diff(agent.time)
    usual = float(np.median(step)) if len(step) else 0.0
    if usual > LONGEST_CYCLE:
        message = f"{usual:.3g} s between poses; in milliseconds it would be {usual * 1e-3:.3g} s"
        yield warning_at(file, field, message, "give seconds, or end the name of a CSV column in _ms")
    yield from _far_point(file, field, agent.position[0], bounds)


def lone_mesh_warnings(file: str, reflectors: Sequence[Reflector]) -> Iterator[Finding]:
    """Scene check: warnings of meshes that reach so much farther than most that they are in another unit."""
    reach = np.array([np.abs(one.vertices).max() for one in reflectors])
    usual = float(np.median(reach))
    for number, (one, far) in enumerate(zip(reflectors, reach, strict=True)):
        unit = next((unit for unit, name in NAMES.items() if far > MANY * usual >= far * UNITS[name]), None)
        if unit is not None:
            meant = f"in {unit} it would be {far * UNITS[NAMES[unit]]:.3g} m"
            message = f"it reaches {far:.3g} m from the room's zero, most others {usual:.3g} m; {meant}"
            mend = f'say units = "{NAMES[unit]}" beside it, or mend its origin'
            yield warning_at(file, f"reflector[{number}].units ({one.name})", message, mend)


def units_that_fit(value: Floats, fits: Callable[[Floats], Any]) -> tuple[str, str] | None:
    """What lengths (...,) [m] of a scene file would be in each unit in which they fit, in words, and how to mend them;
    None if they fit in none."""
    found = [(unit, UNITS[NAMES[unit]]) for unit in GUESSES if fits(value * UNITS[NAMES[unit]])]
    if not found:
        return None
    said = [f"in {unit} {{}}{np.round(value * factor, 6).tolist()} m" for unit, factor in found]
    factors = " or ".join(f"{factor:g}" for _, factor in found)
    words = ", ".join([said[0].format("it would be "), *(one.format("") for one in said[1:])])
    return words, f"give metres: multiply by {factors}"


def _room_unit(bounds: Floats) -> tuple[str, str] | None:
    """Message that the room's size looks as if in a wrong unit, and how to mend it; None if it does not."""
    size = bounds[1] - bounds[0]
    longest, words = float(size.max()), " x ".join(f"{side:.3g}" for side in size)
    if longest > LARGEST_ROOM:
        for unit, name in NAMES.items():
            if USUAL_ROOM[0] <= longest * UNITS[name] <= USUAL_ROOM[1]:
                meant = " x ".join(f"{side * UNITS[name]:.3g}" for side in size)
                mend = f'say units = "{name}" in the table [meshes]'
                return f"the room is {words} m; in {unit} it would be {meant} m", mend
        return f"the room is {words} m", "give metres"
    if longest < SMALLEST_ROOM:
        return f"the room is {words} m", "give its units in the table [meshes]; a drawing to a scale has to be enlarged"
    return None


def _far_point(file: str, field: str, point: Floats, bounds: Floats) -> Iterator[Finding]:
    """Scene check: warning of a point far outside the room that would lie inside it in another unit, or several."""
    size = float(np.max(bounds[1] - bounds[0]))
    away = np.maximum(np.maximum(bounds[0] - point, point - bounds[1]), 0.0).max()
    if away <= FAR * size:
        return
    meant = units_that_fit(point, lambda place: ((place >= bounds[0]) & (place <= bounds[1])).all())
    if meant is not None:
        yield warning_at(file, field, f"{point.tolist()} is far outside the room; {meant[0]}", meant[1])


def _values(table: Mapping[str, Any], path: Sequence[str]) -> Iterator[tuple[str, float]]:
    """Scene check of units: dotted field and largest number wherever a path of keys leads in a scene file."""
    for field, value in _places(table, path, ""):
        numbers = value if isinstance(value, list) else [value]
        if numbers and all(_is_number(number) for number in numbers):
            yield field, float(max(numbers, key=abs))


def _points(table: Mapping[str, Any], path: Sequence[str]) -> Iterator[tuple[str, Floats]]:
    """Scene check of units: dotted field and point (3,), or each of several, where a path of keys leads in a file."""
    for field, value in _places(table, path, ""):
        listed = isinstance(value, list) and value and isinstance(value[0], list)
        for place, point in ((f"{field}[{n}]", item) for n, item in enumerate(value)) if listed else [(field, value)]:
            if isinstance(point, list) and len(point) == 3 and all(_is_number(number) for number in point):
                yield place, np.array(point, dtype=np.float64)


def _places(part: Any, path: Sequence[str], field: str) -> Iterator[tuple[str, Any]]:
    """Scene check of units: dotted field and value wherever a path of keys leads; in lists of tables, of each."""
    if isinstance(part, list) and path:
        for number, item in enumerate(part):
            yield from _places(item, path, f"{field}[{number}]")
    elif not path:
        yield field, part
    elif isinstance(part, Mapping) and path[0] in part:
        yield from _places(part[path[0]], path[1:], f"{field}.{path[0]}".lstrip("."))


def _is_number(value: Any) -> bool:
    """Whether a value of a scene file's table is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
