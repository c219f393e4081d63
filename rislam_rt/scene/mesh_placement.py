"""How a mesh file lies in the room: its unit of length, which axis points up, which point is the room's zero."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.meshes import Mesh

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
"""[m]."""


def place_mesh(mesh: Mesh, up: str, unit: float, origin: Floats) -> Mesh:
    """A file's mesh in the room: scaled to metres, turned so that its axis `up` is z, moved so that `origin` is zero.

    Parameters
    ----------
    up
        `y` or `z`.
    unit
        [m] One unit of the file.
    origin
        (3,) [m] in the turned frame.
    """
    return Mesh(place_points(mesh.vertices, up, unit, origin), mesh.faces)


def place_points(points: Floats, up: str, unit: float, origin: Floats) -> Floats:
    """Points (..., 3) of a mesh file placed in the room."""
    if up == "y":
        x, y, z = np.moveaxis(points, -1, 0)
        points = np.stack([x, -z, y], axis=-1)
    if unit != 1.0:
        points = points * unit
    return points - origin if origin.any() else points
