"""Walls of a scene: the planes of its reflectors, numbered in the order of the scene file."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, cross
from rislam_rt.channel.occluders import Occluders, build_occluders
from rislam_rt.constants import COPLANAR_ANGLE, COPLANAR_OFFSET
from rislam_rt.geometry.coplanar import stack_walls, tracer_gap
from rislam_rt.geometry.plane_segmentation import PlanarRegions, planar_regions
from rislam_rt.geometry.planes import signed_distance
from rislam_rt.geometry.triangles import triangle_cross
from rislam_rt.model import Material, Reflector, RisPanel, Scene
from rislam_rt.scene.check.panel import MAX_TURN


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """Walls of a scene: W planes made of T triangles, with materials, coplanar overlaps and the panels' host walls."""

    names: tuple[str, ...]
    """(W,) `reflector`, or `reflector#facet` where the reflector has several planes."""
    normal: Floats
    """(W, 3) unit normals."""
    offset: Floats
    """(W,) [m]: `normal . x = offset`."""
    material: tuple[Material, ...]
    """(W,) material of each wall."""
    triangles: Floats
    """(T, 3, 3) [m], reflector by reflector in the order of their faces."""
    wall_of_triangle: Integers
    """(T,) number of the wall that each triangle belongs to."""
    plane: Integers
    """(W,) the wall whose plane each shares: its own number, unless it lies on another or another on it."""
    over: tuple[Integers, ...]
    """(W,) for each wall those that lie on it: where they are, they reflect and it does not."""
    hosts: tuple[int, ...]
    """The wall behind each panel, -1 where there is none."""
    occluders: Occluders
    """Meshes that hide paths and reflect nothing."""

    def __len__(self) -> int:
        return len(self.names)

    def beside(self, wall: int) -> Booleans:
        """Which walls (W,) of a scene share a wall's plane by lying on each other, itself among them; none for -1."""
        return (self.plane == self.plane[wall]) if wall >= 0 else np.zeros(len(self), dtype=np.bool_)

    def largest_triangles(self) -> tuple[Integers, Floats]:
        """Number (W,) of the largest triangle of each wall of a scene, and its altitude (W,) [m] on its longest
        side."""
        area = np.linalg.norm(triangle_cross(self.triangles), axis=-1)
        order = np.lexsort((-area, self.wall_of_triangle))
        largest = order[np.unique(self.wall_of_triangle[order], return_index=True)[1]]
        sides = np.roll(self.triangles[largest], -1, axis=1) - self.triangles[largest]
        return largest, area[largest] / np.linalg.norm(sides, axis=-1).max(axis=1, initial=np.finfo(np.float64).tiny)

    def surface(self, wall: int) -> tuple[Floats, Floats]:
        """Centroid (3,) [m] of one of the scene's walls, and the share (t,) of each of its triangles in its area."""
        triangles = self.triangles[self.wall_of_triangle == wall]
        area = np.linalg.norm(triangle_cross(triangles), axis=-1)
        weight = area / area.sum()
        return weight @ triangles.mean(axis=1), weight


@lru_cache(maxsize=16)
def build_walls(scene: Scene) -> Walls:
    """Number the walls of a scene, each the plane that fits all its corners; once for all who ask of the same scene.

    Walls that lie on each other share one plane, that of the largest, into which the others are moved. A panel's host
    wall is the plane of the reflector named `host` that lies nearest to the panel's centre.
    """
    parts = [_planes(reflector) for reflector in scene.reflectors]
    counts = [len(part.offset) for part in parts]
    first = np.cumsum([0, *counts])
    triangles = np.concatenate([np.zeros((0, 3, 3)), *(r.triangles for r in scene.reflectors)])
    nothing = np.zeros(0, dtype=np.int64)
    owner = np.concatenate([nothing, *(part.group + start for part, start in zip(parts, first, strict=False))])
    normal = np.concatenate([np.zeros((0, 3)), *(part.normal for part in parts)])
    offset = np.concatenate([np.zeros(0), *(part.offset for part in parts)])
    stack = stack_walls(triangles, owner, normal, offset, tracer_gap(scene.bounds))
    normal, offset = normal[stack.plane], offset[stack.plane]
    moved = np.flatnonzero((stack.plane != np.arange(len(normal)))[owner])
    height = signed_distance(triangles[moved], normal[owner[moved], None], offset[owner[moved], None])
    triangles[moved] -= height[..., None] * normal[owner[moved], None]
    for shared in (normal, offset, triangles, owner, stack.plane):
        shared.flags.writeable = False
    return Walls(
        tuple(name for r, count in zip(scene.reflectors, counts, strict=True) for name in _names(r.name, count)),
        normal,
        offset,
        tuple(r.material for r, count in zip(scene.reflectors, counts, strict=True) for _ in range(count)),
        triangles,
        owner,
        stack.plane,
        stack.over,
        tuple(_host(panel, scene, np.repeat(np.arange(len(counts)), counts), normal, offset) for panel in scene.panels),
        build_occluders(scene),
    )


@lru_cache(maxsize=256)
def _planes(reflector: Reflector) -> PlanarRegions:
    """Planes of a reflector, each a wall; found once for all scenes that share it, which differ in motion or panel."""
    return planar_regions(reflector.triangles, COPLANAR_ANGLE, COPLANAR_OFFSET)


def _names(reflector: str, count: int) -> list[str]:
    """Names of a reflector's `count` walls: its own, or `reflector#facet` where it has several planes."""
    return [reflector] if count == 1 else [f"{reflector}#{facet}" for facet in range(count)]


def _host(panel: RisPanel, scene: Scene, reflector: Integers, normal: Floats, offset: Floats) -> int:
    """Number of the scene's wall behind a panel, -1 without: its host's nearest plane, of those that lie as the panel
    does if there are any, as others may pass nearer by one that hangs a little before its host; `reflector` (W,) of
    walls."""
    names = [r.name for r in scene.reflectors]
    if panel.host not in names:
        return -1
    of_host = np.flatnonzero(reflector == names.index(panel.host))
    flat = np.linalg.norm(cross(normal[of_host], panel.spec.normal), axis=-1) <= MAX_TURN
    of_host = of_host[flat] if flat.any() else of_host
    distance = np.abs(signed_distance(panel.center, normal[of_host], offset[of_host]))
    return int(of_host[np.argmin(distance)]) if len(of_host) else -1
