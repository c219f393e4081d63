"""Free space of an imported room, where an agent can be: inside, off all surfaces, and on a straight free line."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.triangles import distance_to_triangles, triangle_cross, triangle_planes
from rislam_rt.scene.check.mesh_queries import crossings, hit_shares, is_blocked, sphere_directions

HEIGHTS = (1.0, 1.4, 0.6)
"""Heights [m] above the floor that are tried for the agent: that of a trolley or a hand, then higher, then lower."""
CLEARANCES = (0.4, 0.25, 0.12)
"""Least distances [m] of the agent's line from all surfaces, the first that leaves one."""
LONGEST = 5.0
"""Largest length [m] of the agent's line that is proposed."""
OFF_SURFACE = 1e-5
"""Distance [m] before a surface at which a line of sight to it ends: nearer than any two that are drawn apart."""
ENOUGH = 3
"""Lines of sight that make a surface visible: a single one may have slipped through the seam of two triangles."""
LEVEL = 0.05
"""Difference of height [m] up to which two places are on one level."""
CLOSED = 0.9
"""Share of rays that meet something, to that of the most closed part, from which on a part of the free space may be the
room: one with its windows open, but not what is outside of it."""
_GRID, _RAYS, _STATIONS, _EYES = 14, 100, 40, 24


class FreeSpace(NamedTuple):
    """Free space of an imported room: places where an agent can be, and a straight free line between two of them."""

    stations: Floats
    """(S, 3) [m] places that chains of free straight lines join, the start of `way` first."""
    way: Floats
    """(2, 3) [m] start and end of a straight free line for the agent."""
    clearance: float
    """[m] that this line keeps off all surfaces."""
    enclosed: float
    """Share of rays from the start of `way` that meet something."""


def find_free(triangles: Floats) -> FreeSpace | None:
    """Find the free space of a room of triangles (T, 3, 3) [m], whose floor may rise; None where nothing is free.

    Places to stand are tried above every surface that has something above it, on a grid: the steps of a lecture hall
    as well as its lowest floor, and hollows beneath them. The largest part of them that straight free lines join and
    that is about as closed as any is the room. On the level where most of its places are, the longest straight way up
    to `LONGEST` that keeps off all surfaces is taken.
    """
    for height in HEIGHTS:
        places, headroom = _places(triangles, height)
        gap = distance_to_triangles(places, triangles)
        for clearance in CLEARANCES:
            rows = gap >= clearance
            free = _free_at(places[rows], headroom[rows], triangles, clearance)
            if free is not None:
                return free
    return None


def _places(triangles: Floats, height: float) -> tuple[Floats, Floats]:
    """Places to stand (N, 3) on a grid, `height` [m] above each surface or halfway to the next one above it, and the
    headroom (N,) [m] between the two; beneath the lowest and above the highest surface it ends with the room."""
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    across = [low[i] + (np.arange(_GRID) + 0.47) / _GRID * (high[i] - low[i]) for i in (0, 1)]
    x, y = (axis.ravel() for axis in np.meshgrid(*across))
    under, over = (np.stack([x, y, np.full(len(x), z)], axis=-1) for z in (low[2] - 1.0, high[2] + 1.0))
    column, triangle = crossings(under, over, triangles)
    normal, offset = triangle_planes(triangles)
    met = (offset[triangle] - normal[triangle, 0] * x[column] - normal[triangle, 1] * y[column]) / normal[triangle, 2]
    column, met = np.append(column, np.arange(len(x))), np.append(met, np.full(len(x), low[2]))
    order = np.lexsort((met, column))
    column, met = column[order], met[order]
    above = np.append(met[1:], high[2])
    above[np.append(column[1:] != column[:-1], True)] = high[2]
    wide = above - met >= 2.0 * CLEARANCES[-1]
    column, met, headroom = column[wide], met[wide], (above - met)[wide]
    return np.stack([x[column], y[column], met + np.minimum(height, 0.5 * headroom)], axis=-1), headroom


def _free_at(places: Floats, headroom: Floats, triangles: Floats, clearance: float) -> FreeSpace | None:
    """Free space of a room among places (N, 3) at one clearance [m]; None where there is none."""
    if len(places) < 2:
        return None
    directions = sphere_directions(_RAYS)
    share = hit_shares(places, directions, triangles)
    room = _largest_part(places, headroom, share, triangles)
    room &= share >= share[room].max() - 0.02
    places = places[room]
    near = np.abs(places[:, 2] - places[:, 2, None]) < LEVEL
    level = near[int(np.argmax(near.sum(axis=1)))]
    ground = places[level]
    ground[:, 2] = np.median(ground[:, 2])
    way = _longest_way(ground, triangles, clearance)
    if way is None:
        return None
    order = np.argsort(np.linalg.norm(places - way[0], axis=1), kind="stable")
    return FreeSpace(places[order], way, clearance, float(hit_shares(way[:1], directions, triangles)[0]))


def _largest_part(places: Floats, headroom: Floats, share: Floats, triangles: Floats) -> Booleans:
    """Which of a room's places (N, 3) are in the largest part that free straight lines join and few rays leave."""
    best, volume, left = np.arange(0), -1.0, np.ones(len(places), dtype=np.bool_)
    for start in np.argsort(-headroom, kind="stable"):
        if not left[start]:
            continue
        rows = np.flatnonzero(left)
        part = rows[reachable(places[start], places[rows], triangles)]
        left[part] = False
        if share[part].max() >= CLOSED * share.max() and headroom[part].sum() > volume:
            best, volume = part, float(headroom[part].sum())
    return np.isin(np.arange(len(places)), best)


def reachable(start: Floats, points: Floats, triangles: Floats) -> Booleans:
    """Whether (N,) points (N, 3) are joined to the start (3,) by a chain of free straight lines."""
    reached, stations = np.zeros(len(points), dtype=np.bool_), [start]
    while stations and not reached.all():
        here = stations.pop()
        rows = np.flatnonzero(~reached)
        rows = rows[~is_blocked(here, points[rows], triangles)]
        reached[rows] = True
        stations += list(points[rows])
    return reached


def _longest_way(stations: Floats, triangles: Floats, clearance: float) -> Floats | None:
    """Longest straight free line (2, 3) between two stations, cut to `LONGEST`; None if none is long enough."""
    chosen = stations[np.linspace(0, len(stations) - 1, min(len(stations), _STATIONS)).astype(int)]
    i, j = np.triu_indices(len(chosen), 1)
    length = np.linalg.norm(chosen[i] - chosen[j], axis=1)
    order = np.argsort(-np.minimum(length, LONGEST), kind="stable")
    share = np.linspace(0.0, 1.0, 24)[:, None]
    for start, end in zip(chosen[i[order]], chosen[j[order]], strict=True):
        end = start + unit(end - start) * min(LONGEST, float(np.linalg.norm(end - start)))
        if float(np.linalg.norm(end - start)) < 0.3:
            return None
        if distance_to_triangles(start + share * (end - start), triangles).min() >= clearance - 1e-9:
            return np.stack([start, end])
    return None


def is_seen(stations: Floats, groups: list[Floats], triangles: Floats) -> Booleans:
    """Whether each group of triangles (T, 3, 3) is seen from any free station (S, 3), past all `triangles` (A, 3, 3).

    Looked at are points spread over each group, and, for the sides of things that stand close to a wall, where an agent
    can be before it; from some twenty stations far from each other and what is freely above and below them: a wall of
    which but a crack is seen may count as unseen.
    """
    eyes = _eyes(_far_apart(stations, _EYES), triangles)
    seen = np.zeros(len(groups), dtype=np.bool_)
    for number, group in enumerate(groups):
        points, normal = _spread(group, 16)
        looks = 0
        for eye in eyes:
            side = np.sign(np.einsum("pi,pi->p", eye - points, normal))[:, None]
            looks += int(np.sum(~is_blocked(eye, points + OFF_SURFACE * side * normal, triangles)))
            if looks >= ENOUGH:
                break
        seen[number] = looks >= ENOUGH or _stood_before(points, normal, eyes, triangles) >= ENOUGH
    return seen


def _stood_before(points: Floats, normal: Floats, eyes: Floats, triangles: Floats) -> int:
    """Number of places right before an imported room's surface, at points (P, 3) with normals (P, 3), in which an agent
    can be: `CLEARANCES[-1]` off all surfaces, seen from free space at eyes (E, 3), and about as closed as the first."""
    before = np.concatenate([points + CLEARANCES[-1] * normal, points - CLEARANCES[-1] * normal])
    before = before[distance_to_triangles(before, triangles) >= CLEARANCES[-1] - OFF_SURFACE]
    met = np.zeros(len(before), dtype=np.bool_)
    for eye in eyes:
        met |= ~is_blocked(eye, before, triangles)
    directions = sphere_directions(_RAYS)
    share = hit_shares(np.concatenate([eyes[:1], before[met]]), directions, triangles)
    return int(np.sum(share[1:] >= CLOSED * share[0]))


def _far_apart(stations: Floats, count: int) -> Floats:
    """Viewpoints in free space (count, 3) among stations (S, 3): the first, then ever the farthest from all before."""
    chosen, gap = [0], np.linalg.norm(stations - stations[0], axis=1)
    while len(chosen) < min(count, len(stations)):
        chosen.append(int(np.argmax(gap)))
        gap = np.minimum(gap, np.linalg.norm(stations - stations[chosen[-1]], axis=1))
    return stations[chosen]


def _eyes(stations: Floats, triangles: Floats) -> Floats:
    """Viewpoints (E, 3) in the free space: stations (S, 3), and free places at three heights above or below them."""
    low, high = float(triangles[..., 2].min()), float(triangles[..., 2].max())
    found = [stations]
    for share in (0.1, 0.5, 0.9):
        moved = stations.copy()
        moved[:, 2] = low + share * (high - low)
        found.append(moved[~is_blocked(stations, moved, triangles)])
    return np.concatenate(found)


def _spread(triangles: Floats, count: int) -> tuple[Floats, Floats]:
    """Points spread over an imported room's triangles by area, with normals, to test whether free space sees them."""
    edge = triangles[:, 1:] - triangles[:, :1]
    area = np.cumsum(np.linalg.norm(triangle_cross(triangles), axis=1))
    chosen: Integers = np.searchsorted(area, (np.arange(count) + 0.5) / count * area[-1])
    chosen = np.minimum(chosen, len(triangles) - 1)
    # a lattice of the plane by the roots of x^3 = x + 1 (R2 sequence), folded into the triangle
    u, v = (0.5 + np.outer([0.7548776662466927, 0.5698402909980532], np.arange(count))) % 1.0
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    # a hundredth off the edges, where another surface may begin
    u, v = 0.97 * u + 0.01, 0.97 * v + 0.01
    points = triangles[chosen, 0] + u[:, None] * edge[chosen, 0] + v[:, None] * edge[chosen, 1]
    return points, triangle_planes(triangles[chosen])[0]
