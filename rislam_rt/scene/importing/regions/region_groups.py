"""Groups of a mesh's flat regions, and their names: the shell of the room, and each object in it."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import COPLANAR_OFFSET
from rislam_rt.geometry.triangles import connected
from rislam_rt.scene.importing.regions.flat_regions import FLAT_ANGLE, FlatRegions, bounds_of

SPAN = 0.6
"""Share of the room along two axes that a connected part of its mesh spans if it is the room's shell."""
TOUCH = 5e-3
"""Distance [m] of two objects' boxes below which they are one object."""
UPRIGHT, LEVEL = np.sin(np.radians(15.0)), np.cos(np.radians(15.0))
"""Largest and smallest vertical component of the normals of a wall and of a floor."""
_SIDES = ("east", "northeast", "north", "northwest", "west", "southwest", "south", "southeast")
_NAMELESS = re.compile(
    r"(?i)(mesh|object|obj|node|geometry|geom|cube|plane|cylinder|sphere|circle|default|group|scene|root|world|solid|"
    r"polygon|shape|model|untitled|material|mat|surface|part|element|layer|g|o)?[\W_\d]*"
)
_SHELL = re.compile(r"(?i)(^|[^a-z])(walls?|floors?|ceilings?|roof|wand|boden|decke)([^a-z]|$)")


class RegionGroup(NamedTuple):
    """Group of a mesh's flat regions that are one object, or the shell of the room."""

    name: str
    node: str
    regions: Integers
    """Numbers of its flat regions."""


def find_pieces(facets: FlatRegions, nodes: list[str]) -> list[RegionGroup]:
    """Group the flat regions of a room's mesh into its shell, which comes first, and objects; `nodes` are the node
    names of the mesh's parts.

    A node with a name of its own is one object; whatever has none is parted into what hangs together.
    """
    node = np.array([plain_name(name) for name in nodes], dtype=object)[facets.part]
    box = bounds_of(facets, np.arange(len(node)))
    shell: list[int] = []
    others: list[RegionGroup] = []
    whole = node == ""
    for name in sorted(set(node) - {""}):
        regions = np.flatnonzero(node == name)
        if _SHELL.search(name):
            shell += regions.tolist()
        elif _is_shell(bounds_of(facets, regions), box):
            whole[regions] = True  # a whole room under one name
        else:
            others.append(RegionGroup(name, name, regions))
    loose = np.flatnonzero(whole)
    things: list[Integers] = []
    for component in np.unique(facets.component[loose]):
        regions = loose[facets.component[loose] == component]
        if _is_shell(bounds_of(facets, regions), box):
            shell += regions.tolist()
        else:
            things.append(regions)
    inset = [_continues(facets, regions, np.array(shell, dtype=np.int64)) for regions in things]
    shell += [int(r) for regions, flush in zip(things, inset, strict=True) if flush for r in regions]
    things = [regions for regions, flush in zip(things, inset, strict=True) if not flush]
    for regions in _touching(facets, things):
        bounds = bounds_of(facets, regions)
        if _is_shell(bounds, box):  # walls that were drawn apart
            shell += regions.tolist()
        else:
            others.append(RegionGroup(kind_by_shape(bounds, box), "", regions))
    return [RegionGroup("", "", np.array(sorted(shell), dtype=np.int64)), *others]


def _continues(facets: FlatRegions, regions: Integers, shell: Integers) -> bool:
    """Whether an object is a flat region in the plane of a shell's wall that it touches, as above a door."""
    if len(regions) != 1:
        return False
    normal, offset = facets.normal[regions[0]], facets.offset[regions[0]]
    along = facets.normal[shell] @ normal
    apart = np.abs(along * facets.offset[shell] - offset)
    near = shell[(np.abs(along) > np.cos(FLAT_ANGLE)) & (apart < COPLANAR_OFFSET)]
    low, high = bounds_of(facets, regions)
    boxes = (bounds_of(facets, near[k : k + 1]) for k in range(len(near)))
    return any(bool(((box[0] <= high + TOUCH) & (box[1] >= low - TOUCH)).all()) for box in boxes)


def _touching(facets: FlatRegions, things: list[Integers]) -> list[Integers]:
    """Join objects of a mesh whose boxes touch, as groups of regions: a seat and its legs are a chair."""
    if not things:
        return []
    low, high = np.stack([bounds_of(facets, regions) for regions in things], axis=1)
    near = ((low[:, None] <= high + TOUCH) & (high[:, None] >= low - TOUCH)).all(axis=-1)
    group = connected(np.argwhere(near), len(things))
    members = [np.flatnonzero(group == number) for number in range(int(group.max()) + 1)]
    return [np.concatenate([things[i] for i in own]) for own in members]


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
    if abs(normal[2]) >= LEVEL:
        share = (float(middle[2]) - float(room[0, 2])) / height if height else 0.0
        return "floor" if share < 0.2 else "ceiling" if share > 0.8 else "table_top" if share < 0.5 else "level"
    outward = normal * (1.0 if (middle - center) @ normal >= 0.0 else -1.0)
    return f"{'wall' if abs(normal[2]) <= UPRIGHT else 'slope'}_{compass_side(outward)}"


def compass_side(direction: Floats) -> str:
    """Side of the compass, in eighths, of a horizontal direction, `east` along x: for names of groups of regions."""
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


def _is_shell(bounds: Floats, room: Floats) -> bool:
    """Whether bounds (2, 3) span enough of an imported room's along two axes to be those of its shell."""
    size = room[1] - room[0]
    share = (bounds[1] - bounds[0]) / np.where(size > 0.0, size, 1.0)
    return int((share >= SPAN).sum()) >= 2
