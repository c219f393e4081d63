"""Parts that several built-in rooms share: walls of a box, cut surfaces, spheres."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rislam_rt.scene.meshes import Mesh
from rislam_rt.scene.shapes import box_corners, hexahedron


def box_walls(x: float, y: float, z: float) -> dict[str, Mesh]:
    """Floor, ceiling and four walls of a room from the origin; `wall_x6` is the wall at x = 6 m."""
    faces = hexahedron(box_corners([0.0, 0.0, 0.0], [x, y, z]))
    names = {"wall_x1": f"wall_x{x:g}", "wall_y1": f"wall_y{y:g}"}
    return {names.get(name, name): mesh for name, mesh in faces.items()}


def grid(origin: Sequence[float], along: Sequence[float], across: Sequence[float], columns: int, rows: int) -> Mesh:
    """A parallelogram from `origin`, spanned by two edges, cut into `columns` by `rows` cells of two triangles."""
    u, v = np.meshgrid(np.arange(columns + 1) / columns, np.arange(rows + 1) / rows)
    vertices = np.array(origin) + u.reshape(-1, 1) * np.array(along) + v.reshape(-1, 1) * np.array(across)
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).reshape(-1, 1)
    cells = np.concatenate([first, first + 1, first + columns + 2, first + columns + 1], axis=1)
    return Mesh(vertices, np.stack([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]], axis=1).reshape(-1, 3))


def refined(mesh: Mesh) -> Mesh:
    """Every triangle cut into four."""
    import trimesh

    remesh: Any = trimesh.remesh  # untyped
    vertices, faces = remesh.subdivide(mesh.vertices, mesh.faces)
    return Mesh(np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64))


def sphere(name: str, position: list[float], radius: float = 0.05) -> dict[str, Any]:
    """The table of a spherical scatterer; the paper's radius by default."""
    return {"name": name, "position": position, "radius": radius}
