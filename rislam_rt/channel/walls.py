"""Walls of a scene: the planes of its reflectors, numbered in the order of the scene file."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.shades import Shades, build_shades
from rislam_rt.constants import COPLANAR_ANGLE, COPLANAR_OFFSET
from rislam_rt.geometry.triangles import planar_groups, triangle_planes
from rislam_rt.model import Material, Scene


@dataclass(frozen=True, slots=True, eq=False)
class Walls:
    """W walls made of T triangles."""

    names: tuple[str, ...]
    """(W,) `reflector`, or `reflector#facet` where the reflector has several planes."""
    normal: Floats
    """(W, 3) unit normals."""
    offset: Floats
    """(W,) [m]: `normal . x = offset`."""
    material: tuple[Material, ...]
    """(W,)."""
    triangles: Floats
    """(T, 3, 3) [m], reflector by reflector in the order of their faces."""
    wall_of_triangle: Integers
    """(T,)."""
    host: int
    """The wall behind the panel, -1 without one."""
    shades: Shades
    """What hides but is no wall: it never reflects."""

    def __len__(self) -> int:
        return len(self.names)


def build_walls(scene: Scene) -> Walls:
    """Number the walls of a scene.

    The panel's host wall is the plane of the reflector named `host` that lies nearest to the panel's centre.
    """
    names: list[str] = []
    materials: list[Material] = []
    normals, offsets, triangles, owner = [], [], [], []
    host = -1
    host_distance = np.inf
    for reflector in scene.reflectors:
        group = planar_groups(reflector.triangles, COPLANAR_ANGLE, COPLANAR_OFFSET)
        normal, offset = triangle_planes(reflector.triangles)
        for facet in range(group.max() + 1):
            first = int(np.argmax(group == facet))
            if scene.ris is not None and scene.ris.host == reflector.name:
                distance = abs(float(normal[first] @ scene.ris.center - offset[first]))
                if distance < host_distance:
                    host, host_distance = len(names), distance
            names.append(reflector.name if group.max() == 0 else f"{reflector.name}#{facet}")
            materials.append(reflector.material)
            normals.append(normal[first])
            offsets.append(offset[first])
        triangles.append(reflector.triangles)
        owner.append(group + len(names) - (group.max() + 1))
    return Walls(
        tuple(names),
        np.array(normals, dtype=np.float64).reshape(-1, 3),
        np.array(offsets, dtype=np.float64),
        tuple(materials),
        np.concatenate(triangles) if triangles else np.zeros((0, 3, 3)),
        np.concatenate(owner) if owner else np.zeros(0, dtype=np.int64),
        host,
        build_shades(scene),
    )
