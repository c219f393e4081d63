"""Reading of OBJ mesh files: corners, polygons, groups and the names of materials."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.mesh_polygons import fan
from rislam_rt.scene.obj_polygons import obj_corners, obj_point, obj_with_triangles, unreadable_line

Polygons = dict[tuple[str, str], list[list[int]]]
"""Corners of the polygons of each (group, material) of an OBJ file."""


def read_obj(content: bytes) -> tuple[list[tuple[str, str, Floats]], str]:
    """Read an OBJ mesh file: (group, material, triangles (T, 3, 3)) of each part, and the library of materials named.

    Raises
    ------
    Fault
        A line cannot be read, a face names a corner that is not there, or it crosses itself.
    """
    points, faces, library = _read_lines(obj_with_triangles(content).decode("latin-1"))
    found = []
    for (group, material), polygons in faces.items():
        sizes = sorted({len(polygon) for polygon in polygons})
        fans = [np.array([p for p in polygons if len(p) == k])[:, fan(k)].reshape(-1, 3) for k in sizes]
        found.append((group, material, points[np.concatenate(fans)]))
    return found, library


def _read_lines(text: str) -> tuple[Floats, Polygons, str]:
    """Points (V, 3), polygons and library of materials of an OBJ mesh file."""
    points: list[list[float]] = []
    faces: Polygons = {}
    group = material = library = ""
    lines = text.splitlines()
    total = sum(line.lstrip().startswith("v ") for line in lines)
    for number, line in enumerate(lines):
        key, _, rest = line.strip().partition(" ")
        try:
            if key == "v":
                points.append(obj_point(rest.split()))
            elif key == "f":
                polygon = obj_corners(rest.split(), len(points), total)
                if polygon:
                    faces.setdefault((group, material), []).append(polygon)
        except ValueError as error:
            raise unreadable_line(number, error) from None
        if key in ("o", "g"):
            group = rest.strip()
        elif key == "usemtl":
            material = rest.strip()
        elif key == "mtllib":
            library = rest.strip()
    return np.array(points, dtype=np.float64).reshape(-1, 3), faces, library
