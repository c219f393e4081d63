"""Meshes of simple shapes: quadrilaterals, boxes, and closed spheres and cylinders, whose mean shadow is the true one.

Corners that two faces share are the same numbers in both.
"""

from collections.abc import Sequence

import numpy as np

from rislam_rt.arrays import Floats, cross
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.planes import plane_tangents
from rislam_rt.geometry.triangles import triangle_areas
from rislam_rt.scene.meshes import Mesh, as_mesh, joined


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
    """Corners (2, 2, 2, 3) [m] of the shape of an axis-aligned box, indexed by x, y and z side."""
    x, y, z = (np.array([a, b], dtype=np.float64) for a, b in zip(low, high, strict=True))
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1)


def block(low: Sequence[float], high: Sequence[float], without: Sequence[str] = ()) -> Mesh:
    """Mesh of an axis-aligned box, normals outwards; faces named in `without` (as in `hexahedron`) are left out."""
    faces = hexahedron(box_corners(low, high))
    mesh = joined([face for name, face in faces.items() if name not in without])
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


CYLINDER_SIDES = 32
"""Number of flat sides of a cylinder's mesh."""


def solid_mesh(center: Floats, radius: float, height: float | None, axis: Floats) -> Mesh:
    """Closed mesh of a scatterer's solid: a cylinder if it has a height, else a sphere."""
    return sphere_mesh(center, radius) if height is None else cylinder_mesh(center, radius, height, axis)


def sphere_mesh(center: Floats, radius: float) -> Mesh:
    """Mesh of a sphere, 320 triangles with the true sphere's surface.

    A convex body's shadow has, in the mean over all directions, a fourth of its surface (Cauchy): so the mean shadow
    is the true one, pi r^2. Its outline is off the true one by up to 2 % of the radius.
    """
    triangles = _icosahedron()
    for _ in range(2):
        triangles = unit(_quartered(triangles))
    surface = triangle_areas(triangles).sum()
    return as_mesh(center + radius * np.sqrt(4.0 * np.pi / surface) * triangles)


def cylinder_mesh(center: Floats, radius: float, height: float, axis: Floats) -> Mesh:
    """Closed prism about a unit vector `axis` for a cylinder; its girth is the true one, as Cauchy asks."""
    across, aside = plane_tangents(axis)
    # turned by a fraction of a side, so that no edge lies along the room's axes
    angle = 2.0 * np.pi * (np.arange(CYLINDER_SIDES) + 0.37) / CYLINDER_SIDES
    corner = radius * (np.pi / CYLINDER_SIDES) / np.sin(np.pi / CYLINDER_SIDES)
    ring = corner * (np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * aside)
    half = 0.5 * height * axis
    vertices = np.concatenate([ring - half, ring + half, [-half, half]]) + center
    low, high = np.arange(CYLINDER_SIDES), np.arange(CYLINDER_SIDES) + CYLINDER_SIDES
    next_low, next_high = np.roll(low, -1), np.roll(high, -1)
    bottom, top = np.full((2, CYLINDER_SIDES), 2 * CYLINDER_SIDES) + np.array([[0], [1]])
    faces = [(low, next_low, next_high), (low, next_high, high), (bottom, next_low, low), (top, high, next_high)]
    return Mesh(vertices, np.concatenate([np.stack(corners, axis=-1) for corners in faces]))


def _icosahedron() -> Floats:
    """Triangles (20, 3, 3) of an icosahedron, corners on the unit sphere, outwards: a sphere's mesh to refine."""
    golden = (1.0 + np.sqrt(5.0)) / 2.0
    signs = np.array([[a, b * golden] for a in (-1.0, 1.0) for b in (-1.0, 1.0)])
    corners = np.concatenate([np.roll(np.insert(signs, 0, 0.0, axis=1), turn, axis=1) for turn in range(3)])
    near = np.linalg.norm(corners[:, None] - corners, axis=-1)
    joined = np.isclose(near, 2.0)
    i, j, k = (index.ravel() for index in np.indices((12, 12, 12)))
    faces = (i < j) & (j < k) & joined[i, j] & joined[j, k] & joined[i, k]
    triangles = unit(corners[np.stack([i, j, k], axis=-1)[faces]])
    inward = np.einsum("fi,fi->f", cross(triangles[:, 0], triangles[:, 1]), triangles[:, 2]) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles


def _quartered(triangles: Floats) -> Floats:
    """Triangles (4 T, 3, 3) of a sphere's mesh: each of (T, 3, 3) cut into four."""
    a, b, c = triangles.swapaxes(0, 1)
    ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
    return np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
