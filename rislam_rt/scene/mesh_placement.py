"""Mesh files of a scene, each read once and placed in the room: unit of length, axis that points up, and zero."""

from pathlib import Path

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.meshes import MAX_COORDINATE, MAX_MESH_BYTES, Mesh, MeshReader, too_many_faces
from rislam_rt.scene.scene_folder import read_inside
from rislam_rt.scene.schema import LimitsSection, MeshesSection, MeshSection

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
"""Length [m] of each unit that a mesh file may be in."""


class MeshFiles:
    """Reader of a scene's mesh files, each read once and kept for the digest, together within the limit of faces."""

    def __init__(self, folder: Path, limits: LimitsSection, placement: MeshesSection) -> None:
        self.folder, self.limits, self.placement = folder, limits, placement
        self.contents: dict[str, bytes] = {}
        self.reader = MeshReader()
        self.faces = 0

    def mesh(self, place: str, section: MeshSection) -> Mesh:
        """Read a scene's mesh `file` or `file#node`, placed in the room as its section or else `[meshes]` says."""
        name, _, node = place.partition("#")
        if name not in self.contents:
            self.contents[name] = read_inside(self.folder, name, MAX_MESH_BYTES)
        most = self.limits.faces
        up, unit = section.up_axis or self.placement.up, UNITS[section.units or self.placement.units]
        reach = MAX_COORDINATE / unit
        mesh = self.reader.parse(self.contents[name], name, node or None, most, self.limits.nodes, reach)
        self.faces += len(mesh.faces)
        if self.faces > most:
            raise too_many_faces(self.faces, most)
        origin = self.placement.origin if section.origin is None else section.origin
        return Mesh(place_points(mesh.vertices, up, unit, np.array(origin)), mesh.faces)


def place_points(points: Floats, up: str, unit: float, origin: Floats) -> Floats:
    """Turn, scale and move points (..., 3) of a mesh file into the room's frame: axis `up` becomes z, `origin` zero.

    Parameters
    ----------
    up
        `y` or `z`.
    unit
        [m] One unit of the file.
    origin
        (3,) [m] in the turned frame.
    """
    if up == "y":
        x, y, z = np.moveaxis(points, -1, 0)
        points = np.stack([x, -z, y], axis=-1)
    if unit != 1.0:
        points = points * unit
    return points - origin if origin.any() else points
