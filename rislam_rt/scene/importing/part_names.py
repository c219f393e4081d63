"""Names of an imported room's parts: walls by their side, objects by what the file calls them or by their shape."""

import re
from collections.abc import Sequence

import numpy as np

from rislam_rt.arrays import Floats

_UPRIGHT, _LEVEL = np.sin(np.radians(15.0)), np.cos(np.radians(15.0))
"""Largest and smallest vertical component of the normals of a wall and of a floor."""
_SIDES = ("east", "northeast", "north", "northwest", "west", "southwest", "south", "southeast")
_NAMELESS = re.compile(
    r"(?i)(mesh|object|obj|node|geometry|geom|cube|plane|cylinder|sphere|circle|default|group|scene|root|world|solid|"
    r"polygon|shape|model|untitled|material|mat|surface|part|element|layer|g|o)?[\W_\d]*"
)


def plain_name(name: str) -> str:
    """Plain name of a node's object, `Office Chair.002`: `office_chair_002`; empty where the name says nothing."""
    if _NAMELESS.fullmatch(name):
        return ""
    plain = re.sub(r"[^\w.\-]+", "_", name.strip(), flags=re.UNICODE).strip("_.-").lower()
    return re.sub(r"_+", "_", plain.replace(".", "_"))[:48]


def kind_by_shape(bounds: Floats, room: Floats) -> str:
    """Name of an object of an imported room by size and place (`table`, ...); nothing is computed with it."""
    size, floor = bounds[1] - bounds[0], float(room[0, 2])
    bottom, top = float(bounds[0, 2]) - floor, float(bounds[1, 2]) - floor
    longest, shortest = float(size[:2].max()), float(size[:2].min())
    if size[2] > 0.85 * float(room[1, 2] - room[0, 2]):
        return "column" if longest < 1.0 and shortest > 0.5 * longest else "partition"
    if size[2] <= 0.12 and 0.5 < bottom < 1.3 and shortest > 0.3:
        return "table_top"
    if bottom < 0.05:
        if 0.6 < top < 1.0 and shortest > 0.6:
            return "table"
        if 0.6 < top < 1.3 and longest < 0.8:
            return "chair"
        return "cabinet" if top > 1.0 else "object"
    return "seat" if size[2] < 0.15 and 0.3 < top < 0.6 else "hanging" if bottom > 1.8 else "object"


def wall_name(normal: Floats, middle: Floats, room: Floats) -> str:
    """Name of a wall by its place in an imported room's shell: `floor`, `ceiling`, `wall_north` (along y)."""
    center, height = room.mean(axis=0), float(room[1, 2] - room[0, 2])
    if abs(normal[2]) >= _LEVEL:
        share = (float(middle[2]) - float(room[0, 2])) / height if height else 0.0
        return "floor" if share < 0.2 else "ceiling" if share > 0.8 else "table_top" if share < 0.5 else "level"
    outward = normal * (1.0 if (middle - center) @ normal >= 0.0 else -1.0)
    return f"{'wall' if abs(normal[2]) <= _UPRIGHT else 'slope'}_{compass_side(outward)}"


def compass_side(direction: Floats) -> str:
    """Side of the compass, in eighths, of a horizontal direction, `east` along x: for names of imported parts."""
    return _SIDES[int(np.round(np.degrees(np.arctan2(direction[1], direction[0])) / 45.0)) % 8]


def numbered(names: list[str], given: Sequence[bool] = ()) -> list[str]:
    """Names of an imported room's parts made different: the second of one name gets `_2`, and so on; those that the
    user has `given` come before others."""
    taken: set[str] = set()
    found = dict.fromkeys(range(len(names)), "")
    for place in sorted(found, key=lambda place: not any(given[place : place + 1])):
        number, unique = 1, names[place]
        while unique in taken:
            number += 1
            unique = f"{names[place]}_{number}"
        taken.add(unique)
        found[place] = unique
    return list(found.values())
