"""Reading of OBJ mesh files: corners, polygons, groups and the names of materials."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.findings import Fault, one_line
from rislam_rt.scene.polygons import signed_area, triangulate

Polygons = dict[tuple[str, str], list[list[int]]]
"""Corners of the polygons of each (group, material) of an OBJ file."""


def read_obj(content: bytes) -> tuple[list[tuple[str, str, Floats]], str]:
    """Read an OBJ mesh file: (group, material, triangles (T, 3, 3)) of each part, and the library of materials named.

    Raises
    ------
    Fault
        A line cannot be read, or a face names a corner that is not there.
    """
    points, faces, library = _read_lines(content.decode("latin-1"))
    found = []
    for (group, material), polygons in faces.items():
        sizes = np.array([len(polygon) for polygon in polygons])
        triangles = [points[np.array([p for p in polygons if len(p) == 3], dtype=np.int64).reshape(-1, 3)]]
        triangles += [_split(points[polygons[number]]) for number in np.flatnonzero(sizes > 3)]
        found.append((group, material, np.concatenate(triangles)))
    return found, library


def _read_lines(text: str) -> tuple[Floats, Polygons, str]:
    """Points (V, 3), polygons and library of materials of an OBJ mesh file."""
    points: list[list[float]] = []
    faces: Polygons = {}
    group = material = library = ""
    for number, line in enumerate(text.replace("\\\n", " ").splitlines(), start=1):
        key, _, rest = line.strip().partition(" ")
        try:
            if key == "v":
                points.append([float(word) for word in rest.split()[:3]])
                if len(points[-1]) != 3:
                    raise ValueError("three numbers wanted")
            elif key == "f":
                faces.setdefault((group, material), []).append(_corners(rest, len(points)))
        except ValueError as error:
            raise Fault(f"line {number} cannot be read ({one_line(str(error))[:60]})", "export it again") from None
        if key in ("o", "g"):
            group = rest.strip()
        elif key == "usemtl":
            material = rest.strip()
        elif key == "mtllib":
            library = rest.strip()
    return np.array(points, dtype=np.float64).reshape(-1, 3), faces, library


def _corners(text: str, count: int) -> list[int]:
    """Corner numbers of a polygon in an OBJ mesh file, from 0; a negative number counts from the last corner so far."""
    numbers = [int(word.partition("/")[0]) for word in text.split()]
    if len(numbers) < 3:
        raise ValueError(f"a face of {len(numbers)} corners")
    for n in numbers:
        if n == 0 or n > count or n < -count:
            raise ValueError(f"a face names corner {n} of {count}")
    return [n - 1 if n > 0 else count + n for n in numbers]


def _split(corners: Floats) -> Floats:
    """Triangulate a polygon (n, 3) of an OBJ mesh file: (n - 2, 3, 3)."""
    middle = corners.mean(axis=0)
    normal = np.linalg.svd(corners - middle)[2] if np.isfinite(corners).all() else np.eye(3)
    flat = (corners - middle) @ normal[:2].T
    turned = signed_area(flat) < 0.0
    order = np.arange(len(corners))[::-1] if turned else np.arange(len(corners))
    found = triangulate(flat[order], [])
    if found is None:  # a polygon that crosses itself
        found = np.array([[0, i, i + 1] for i in range(1, len(corners) - 1)])
    found = order[found]
    return corners[found[:, ::-1] if turned else found]
