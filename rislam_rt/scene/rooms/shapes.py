"""Meshes of simple solids and surfaces. Corners that two faces share are the same numbers in both."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.meshes import Mesh


def quad(corners: Floats | list[list[float]]) -> Mesh:
    """A planar quadrilateral from its corners (4, 3) in order; seen from where they run counter-clockwise."""
    return Mesh(np.array(corners, dtype=np.float64), np.array([[0, 1, 2], [0, 2, 3]]))


def hexahedron(corners: Floats) -> dict[str, Mesh]:
    """The six faces, normals inwards, of a box-like solid from its corners (2, 2, 2, 3), indexed by x, y and z side."""
    c = np.asarray(corners, dtype=np.float64)
    return {
        "floor": quad([c[0, 0, 0], c[1, 0, 0], c[1, 1, 0], c[0, 1, 0]]),
        "ceiling": quad([c[0, 0, 1], c[0, 1, 1], c[1, 1, 1], c[1, 0, 1]]),
        "wall_x0": quad([c[0, 0, 0], c[0, 1, 0], c[0, 1, 1], c[0, 0, 1]]),
        "wall_x1": quad([c[1, 0, 0], c[1, 0, 1], c[1, 1, 1], c[1, 1, 0]]),
        "wall_y0": quad([c[0, 0, 0], c[0, 0, 1], c[1, 0, 1], c[1, 0, 0]]),
        "wall_y1": quad([c[0, 1, 0], c[1, 1, 0], c[1, 1, 1], c[0, 1, 1]]),
    }


def box_corners(low: list[float], high: list[float]) -> Floats:
    """Corners (2, 2, 2, 3) [m] of an axis-aligned box, indexed by x, y and z side."""
    x, y, z = (np.array([a, b], dtype=np.float64) for a, b in zip(low, high, strict=True))
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)


def box_walls(x: float, y: float, z: float) -> dict[str, Mesh]:
    """Floor, ceiling and four walls of a room from the origin; `wall_x6` is the wall at x = 6 m."""
    faces = hexahedron(box_corners([0.0, 0.0, 0.0], [x, y, z]))
    names = {"wall_x1": f"wall_x{x:g}", "wall_y1": f"wall_y{y:g}"}
    return {names.get(name, name): mesh for name, mesh in faces.items()}
