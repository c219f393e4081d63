"""Scene check of walls: which meshes lie on each other, and which part into several walls."""

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, cross
from rislam_rt.constants import COPLANAR_ANGLE, COPLANAR_OFFSET
from rislam_rt.geometry.coplanar import ALIKE, CoplanarPair, lies_within, stack_walls, tracer_gap
from rislam_rt.geometry.plane_segmentation import PlanarRegions, planar_regions
from rislam_rt.geometry.triangles import triangle_areas, triangle_planes
from rislam_rt.input_messages import counted
from rislam_rt.scene.check.mesh_queries import free_ways, is_blocked, sphere_directions, touching
from rislam_rt.scene.check.triangle_array import MIN_CLEARANCE, TriangleArray
from rislam_rt.scene.findings import Finding

NEARLY_FLAT = 1e-2
"""Angle [rad] below which walls of one mesh that meet are taken to be meant as one: half a degree looks flat."""
NUM_VIEWS = 20
"""Places from which the scene check looks about, and rays from each."""


HIDDEN, WITHIN = (
    "nobody sees the faces where they meet; leave them",
    "as of a window in its wall, the smaller one reflects where it is and the other elsewhere; leave them",
)
"""Why two meshes in one plane may stay as they are."""


class WallParts(NamedTuple):
    """The walls (planar regions) of a scene's meshes, reflector by reflector, as the channels part them."""

    flat: list[PlanarRegions]
    """Planar regions of each reflector."""
    first: Integers
    """(R + 1,) walls of reflector r are first[r] : first[r + 1]."""
    owner: Integers
    """(T,) wall of each triangle."""

    def reflector(self, wall: int) -> int:
        """Number of the reflector that a wall belongs to, for the scene check."""
        return int(np.searchsorted(self.first, wall, side="right")) - 1


def wall_findings(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: findings on meshes that lie on each other, are nearly flat, or have several walls."""
    flat = [planar_regions(r.triangles, COPLANAR_ANGLE, COPLANAR_OFFSET) for r in room.scene.reflectors]
    first = np.cumsum([0, *(len(part.offset) for part in flat)])
    owner = np.concatenate([part.group + start for part, start in zip(flat, first, strict=False)])
    parts = WallParts(flat, first, owner)
    yield from _stacked(room, parts)
    several = [number for number, part in enumerate(parts.flat) if len(part.offset) > 1]
    for number in several:
        part, name = parts.flat[number], room.scene.reflectors[number].name
        count, field = len(part.offset), f"reflector[{number}].mesh ({name})"
        if number == several[0]:
            others = f", and {counted(len(several) - 1, 'other reflector')} more than one" if len(several) > 1 else ""
            mend = f"its walls are {name}#0 to {name}#{count - 1}"
            yield Finding("note", room.file, field, f"the mesh has {count} planes{others}", mend)
        angle = _flattest(room.triangles[room.owner == number], part)
        if angle < NEARLY_FLAT:
            message = f"splits into {count} walls, of which neighbours meet at only {angle:.1e} rad"
            mend = f"if that is one wall, make it flat to {COPLANAR_OFFSET} m and {COPLANAR_ANGLE} rad"
            yield room.warning(field, message, mend)


def _stacked(room: TriangleArray, parts: WallParts) -> Iterator[Finding]:
    """Scene check: a finding for each pair of meshes that overlap in one plane; one note for all where nobody sees
    it, and one for all flat meshes that lie within a larger wall, a window or a door, as it is clear what reflects."""
    normal = np.concatenate([part.normal for part in parts.flat])
    offset = np.concatenate([part.offset for part in parts.flat])
    limit = tracer_gap(room.bounds)
    worst: dict[tuple[int, int, str], CoplanarPair] = {}
    pairs = stack_walls(room.triangles, parts.owner, normal, offset, limit).pairs
    views = _views(room) if pairs else np.zeros((0, 3))
    for pair in pairs:
        seen = _is_seen(room, parts, pair, limit, views)
        why = HIDDEN if not seen else WITHIN if _is_within(room, parts, pair, limit) else ""
        key = parts.reflector(pair.upper), parts.reflector(pair.lower), why
        if key not in worst or worst[key].gap < pair.gap:
            worst[key] = pair
    left = Counter(why for _, _, why in worst)
    for (upper, lower, why), pair in worst.items():
        names, field = [room.scene.reflectors[number].name for number in (upper, lower)], f"reflector[{upper}].mesh"
        field, apart = f"{field} ({names[0]})", f"{round(pair.gap * 1e3, 2):g} mm apart"
        message = f"'{names[0]}' lies in the plane of '{names[1]}', {apart}"
        if not why:
            mend = f"leave one out, or part them by more than {limit * 1e3:.2g} mm"
            yield room.warning(field, message, f"where they overlap '{names[0]}' reflects; {mend}")
        elif left[why]:
            message += f", and {counted(left[why] - 1, 'other pair')} likewise" if left[why] > 1 else ""
            yield Finding("note", room.file, field, message, why)
            left[why] = 0


def _is_within(room: TriangleArray, parts: WallParts, pair: CoplanarPair, limit: float) -> bool:
    """Scene check: whether the upper of two walls that overlap is a flat mesh, smaller than the lower and wholly on it:
    it reflects where it is, and the lower one elsewhere."""
    if len(parts.flat[parts.reflector(pair.upper)].offset) > 1:
        return False
    upper, lower = (room.triangles[parts.owner == number] for number in (pair.upper, pair.lower))
    smaller = triangle_areas(upper).sum() < triangle_areas(lower).sum() * (1.0 - ALIKE)
    return bool(smaller) and lies_within(upper, lower, limit)


def _is_seen(room: TriangleArray, parts: WallParts, pair: CoplanarPair, limit: float, views: Floats) -> bool:
    """Scene check: whether a side of two walls that overlap is seen from any view (V, 3) where they do, as neither is
    at the foot of a crate, between two crates face to face, or where an inner wall or a raised floor hides a void."""
    wall, other = (room.triangles[parts.owner == number] for number in (pair.upper, pair.lower))
    points = np.einsum("lc,tci->tli", _lattice(6), wall)
    normal = np.broadcast_to(triangle_planes(wall)[0][:, None], points.shape).reshape(-1, 3)
    points = points.reshape(-1, 3)
    common = np.unique(touching(points, other, limit)[0])
    common = common if len(common) else np.arange(len(points))
    sides = np.concatenate([points[common] + step * normal[common] for step in (MIN_CLEARANCE, -MIN_CLEARANCE)])
    sides = np.delete(sides, room.outside(sides), axis=0)
    if not len(sides):
        return False
    upper, lower = (room.triangles[room.owner == parts.reflector(number)] for number in (pair.upper, pair.lower))
    seen = sides[np.arange(len(views)) % len(sides)]  # each by its own share of the views
    for triangles in (upper, lower, room.triangles):  # the nearest hide most
        free = ~is_blocked(views, seen, triangles)
        views, seen = views[free], seen[free]
    return len(views) > 0


def _views(room: TriangleArray) -> Floats:
    """Places (V, 3) all over the room of a scene check, joined with the agent's way by one or two free straight lines.

    A wall that a path of up to six bounces meets is no more than three such lines away from one of its ends.
    """
    rays, found = sphere_directions(NUM_VIEWS**2), [room.scene.agent.position]
    # how far along each free line: evenly from end to end
    shares = (np.arange(2 * len(rays)) * 0.5 * (np.sqrt(5.0) - 1.0) % 1.0).reshape(2, -1)
    for share in shares:
        chosen = found[-1][np.linspace(0, len(found[-1]) - 1, NUM_VIEWS).astype(np.int64)]
        places = []
        for number, place in enumerate(chosen):
            look, part = rays[number::NUM_VIEWS], share[number::NUM_VIEWS]
            places.append(place + (part * free_ways(place, look, room.triangles, room.bounds))[:, None] * look)
        found.append(np.concatenate(places))
    return np.concatenate(found[1:])[np.argsort(shares, axis=None)]  # mixed, so that every share of them is all over


def _lattice(count: int) -> Floats:
    """Weights (L, 3) of a triangle's corners for points spread over it, the middles of its parts, in a scene check."""
    u, v = (np.stack(np.meshgrid(*2 * [np.arange(count)])).reshape(2, -1) + 1.0 / 3.0) / count
    return np.stack([u, v, 1.0 - u - v], axis=-1)[u + v < 1.0]


def _flattest(triangles: Floats, part: PlanarRegions) -> float:
    """Scene check: smallest angle [rad] at which two walls of one mesh meet in an edge, infinite where none do."""
    _, corner = np.unique(np.round(triangles.reshape(-1, 3), 6) + 0.0, axis=0, return_inverse=True)
    corner = corner.reshape(-1, 3)
    ends = np.sort(np.stack([corner, np.roll(corner, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    _, edge = np.unique(ends, axis=0, return_inverse=True)
    wall, edge = np.repeat(part.group, 3), edge.ravel()
    order = np.lexsort((wall, edge))
    same = (edge[order][1:] == edge[order][:-1]) & (wall[order][1:] != wall[order][:-1])
    a, b = wall[order][:-1][same], wall[order][1:][same]
    turn = np.linalg.norm(cross(part.normal[a], part.normal[b]), axis=-1)
    return float(turn.min(initial=np.inf))
