"""Groups of a mesh's flat regions: the shell of the room, and each object in it."""

import re
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import COPLANAR_OFFSET
from rislam_rt.geometry.triangles import connected
from rislam_rt.scene.importing.part_names import kind_by_shape, plain_name
from rislam_rt.scene.importing.regions.flat_regions import FLAT_ANGLE, FlatRegions, bounds_of

SPAN = 0.6
"""Share of the room along two axes that a connected part of its mesh spans if it is the room's shell."""
TOUCH = 5e-3
"""Distance [m] of two objects' boxes below which they are one object."""
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
        elif spans_room(bounds_of(facets, regions), box):
            whole[regions] = True  # a whole room under one name
        else:
            others.append(RegionGroup(name, name, regions))
    loose = np.flatnonzero(whole)
    things: list[Integers] = []
    for component in np.unique(facets.component[loose]):
        regions = loose[facets.component[loose] == component]
        if spans_room(bounds_of(facets, regions), box):
            shell += regions.tolist()
        else:
            things.append(regions)
    inset = [_continues(facets, regions, np.array(shell, dtype=np.int64)) for regions in things]
    shell += [int(r) for regions, flush in zip(things, inset, strict=True) if flush for r in regions]
    things = [regions for regions, flush in zip(things, inset, strict=True) if not flush]
    for regions in _touching(facets, things):
        bounds = bounds_of(facets, regions)
        if spans_room(bounds, box):  # walls that were drawn apart
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


def spans_room(bounds: Floats, room: Floats) -> bool:
    """Whether bounds (2, 3) span enough of an imported room's along two axes to be those of its shell."""
    size = room[1] - room[0]
    share = (bounds[1] - bounds[0]) / np.where(size > 0.0, size, 1.0)
    return int((share >= SPAN).sum()) >= 2
