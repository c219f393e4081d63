"""Meshes of simple shapes, solids and surfaces. Corners that two faces share are the same numbers in both."""

from collections.abc import Sequence

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.meshes import Mesh


def quad(corners: Floats | Sequence[Floats] | Sequence[Sequence[float]]) -> Mesh:
    """Mesh of a planar quadrilateral from its corners (4, 3) in order; seen from where they run counter-clockwise."""
    return Mesh(np.array(corners, dtype=np.float64), np.array([[0, 1, 2], [0, 2, 3]]))


def hexahedron(corners: Floats) -> dict[str, Mesh]:
    """Meshes of the six faces, normals inwards, of a solid from its corners (2, 2, 2, 3) by x, y and z side."""
    c = np.asarray(corners, dtype=np.float64)
    return {
        "floor": quad([c[0, 0, 0], c[1, 0, 0], c[1, 1, 0], c[0, 1, 0]]),
        "ceiling": quad([c[0, 0, 1], c[0, 1, 1], c[1, 1, 1], c[1, 0, 1]]),
        "wall_x0": quad([c[0, 0, 0], c[0, 1, 0], c[0, 1, 1], c[0, 0, 1]]),
        "wall_x1": quad([c[1, 0, 0], c[1, 0, 1], c[1, 1, 1], c[1, 1, 0]]),
        "wall_y0": quad([c[0, 0, 0], c[0, 0, 1], c[1, 0, 1], c[1, 0, 0]]),
        "wall_y1": quad([c[0, 1, 0], c[1, 1, 0], c[1, 1, 1], c[0, 1, 1]]),
    }


def box_corners(low: Sequence[float], high: Sequence[float]) -> Floats:
    """Corners (2, 2, 2, 3) [m] of an axis-aligned box, indexed by x, y and z side."""
    x, y, z = (np.array([a, b], dtype=np.float64) for a, b in zip(low, high, strict=True))
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)


def block(low: Sequence[float], high: Sequence[float], without: Sequence[str] = ()) -> Mesh:
    """Mesh of an axis-aligned box, normals outwards; faces named in `without` (as in `hexahedron`) are left out."""
    faces = hexahedron(box_corners(low, high))
    mesh = joined([face for name, face in faces.items() if name not in without])
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Join several meshes into one, their vertices and faces in order."""
    starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))
