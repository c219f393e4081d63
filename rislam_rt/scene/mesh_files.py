"""Mesh files of a scene, each read once and placed in the room."""

from pathlib import Path

import numpy as np

from rislam_rt.scene.mesh_file_checks import too_many_faces
from rislam_rt.scene.mesh_placement import UNITS, place_points
from rislam_rt.scene.meshes import MAX_COORDINATE, MAX_MESH_BYTES, Mesh, MeshReader
from rislam_rt.scene.read_inside_folder import read_inside
from rislam_rt.scene.schema import LimitsSection, MeshesSection, MeshSection


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
