"""Scene check of walls: which meshes lie on each other, and which part into several walls."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, cross
from rislam_rt.constants import COPLANAR_ANGLE, COPLANAR_OFFSET
from rislam_rt.geometry.coplanar import CoplanarPair, stack_walls, tracer_gap
from rislam_rt.geometry.plane_segmentation import PlanarRegions, planar_regions
from rislam_rt.geometry.triangles import triangle_planes
from rislam_rt.input_messages import counted
from rislam_rt.scene.check.mesh_queries import touching, winding
from rislam_rt.scene.check.triangle_array import MIN_CLEARANCE, TriangleArray
from rislam_rt.scene.findings import Finding

NEARLY_FLAT = 1e-2
"""Angle [rad] below which walls of one mesh that meet are taken to be meant as one: half a degree looks flat."""


class WallParts(NamedTuple):
    """The walls (planar regions) of a scene's meshes, reflector by reflector."""

    flat: list[PlanarRegions]
    """Planar regions of each reflector."""
    first: Integers
    """(R + 1,) walls of reflector r are first[r] : first[r + 1]."""
    owner: Integers
    """(T,) wall of each triangle."""

    def reflector(self, wall: int) -> int:
        """Number of the reflector that a wall belongs to, for the scene check."""
        return int(np.searchsorted(self.first, wall, side="right")) - 1


def build_parts(room: TriangleArray) -> WallParts:
    """Part every reflector's mesh into walls (planar regions), as the channels do."""
    flat = [planar_regions(r.triangles, COPLANAR_ANGLE, COPLANAR_OFFSET) for r in room.scene.reflectors]
    first = np.cumsum([0, *(len(part.offset) for part in flat)])
    owner = np.concatenate([part.group + start for part, start in zip(flat, first, strict=False)])
    return WallParts(flat, first, owner)


def wall_findings(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: findings on meshes that lie on each other, are nearly flat, or have several walls."""
    parts = build_parts(room)
    yield from _stacked(room, parts)
    for number, part in enumerate(parts.flat):
        count, name = len(part.offset), room.scene.reflectors[number].name
        if count < 2:
            continue
        field = f"reflector[{number}].mesh ({name})"
        yield room.note(field, f"the mesh has {count} planes", f"its walls are {name}#0 to {name}#{count - 1}")
        angle = _flattest(room.triangles[room.owner == number], part)
        if angle < NEARLY_FLAT:
            message = f"splits into {count} walls, of which neighbours meet at only {angle:.1e} rad"
            mend = f"if that is one wall, make it flat to {COPLANAR_OFFSET} m and {COPLANAR_ANGLE} rad"
            yield room.warning(field, message, mend)


def _stacked(room: TriangleArray, parts: WallParts) -> Iterator[Finding]:
    """Scene check: a finding for each pair of meshes that overlap in one plane; one note for all where nobody sees
    it."""
    normal = np.concatenate([part.normal for part in parts.flat])
    offset = np.concatenate([part.offset for part in parts.flat])
    limit = tracer_gap(room.bounds)
    worst: dict[tuple[int, int, bool], CoplanarPair] = {}
    for pair in stack_walls(room.triangles, parts.owner, normal, offset, limit).pairs:
        key = parts.reflector(pair.upper), parts.reflector(pair.lower), _is_seen(room, parts, pair, limit)
        if key not in worst or worst[key].gap < pair.gap:
            worst[key] = pair
    hidden = sum(not seen for _, _, seen in worst)
    for (upper, lower, seen), pair in worst.items():
        names, field = [room.scene.reflectors[number].name for number in (upper, lower)], f"reflector[{upper}].mesh"
        field, apart = f"{field} ({names[0]})", f"{round(pair.gap * 1e3, 2):g} mm apart"
        message = f"'{names[0]}' lies in the plane of '{names[1]}', {apart}"
        if seen:
            mend = f"leave one out, or part them by more than {limit * 1e3:.2g} mm"
            yield room.warning(field, message, f"where they overlap '{names[0]}' reflects; {mend}")
        elif hidden:
            message += f", and {counted(hidden - 1, 'other pair')} likewise" if hidden > 1 else ""
            yield room.note(field, message, "nobody sees the faces where they meet; leave them")
            hidden = 0


def _is_seen(room: TriangleArray, parts: WallParts, pair: CoplanarPair, limit: float) -> bool:
    """Scene check: whether two walls that overlap have a side in the room where they do, as the foot of a crate, or two
    crates face to face, have not."""
    wall, other = (room.triangles[parts.owner == number] for number in (pair.upper, pair.lower))
    points = np.einsum("lc,tci->tli", _lattice(6), wall)
    normal = np.broadcast_to(triangle_planes(wall)[0][:, None], points.shape).reshape(-1, 3)
    points = points.reshape(-1, 3)
    common = np.unique(touching(points, other, limit)[0])
    common = common if len(common) else np.arange(len(points))
    upper, lower = (room.triangles[room.owner == parts.reflector(number)] for number in (pair.upper, pair.lower))
    for row in common[:: max(1, len(common) // 8)]:
        sides = points[row] + MIN_CLEARANCE * np.outer([1.0, -1.0], normal[row])
        own = [abs(winding(side, upper)) >= 0.5 for side in sides]
        for number in np.delete([0, 1], room.outside(sides)):
            # what is inside the other, too, only if this is on its outside: a poster is inside the shell of a room
            behind = own[1 - number] and abs(winding(sides[number], lower)) >= 0.5
            if not own[number] and not behind:
                return True
    return False


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
