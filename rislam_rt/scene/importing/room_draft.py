"""Draft of an imported room: what reflects, what hides, and remarks; then agent, RIS panel and files."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats, cross
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.planes import plane_tangents
from rislam_rt.geometry.triangles import triangle_planes
from rislam_rt.scene.check.mesh_queries import ray_hits
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.importing.free_space import FreeSpace, find_free
from rislam_rt.scene.meshes import Mesh
from rislam_rt.scene.motion.suggested_motion import BASELINE
from rislam_rt.scene.room_files import CYCLES, RoomFiles, panel, reflector
from rislam_rt.scene.scene_folder import mesh_file

FROM_EDGE = 0.1
"""Least distance [m] of a proposed RIS panel's centre from the edges of its host, if the panel is no larger."""
SIZE = 6
"""Elements along each side of a proposed RIS panel, half a wavelength apart: the paper's, in wavelengths."""


@dataclass(frozen=True, slots=True, eq=False)
class RoomDraft:
    """Draft of an imported room: reflectors and occluders by name, and remarks on how they came about."""

    reflectors: dict[str, tuple[Mesh, dict[str, Any]]]
    """Mesh and table of the material of each reflector."""
    occluders: dict[str, Mesh] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)

    @property
    def triangles(self) -> Floats:
        """Triangles (T, 3, 3) [m] of all reflectors and occluders of a room's draft."""
        meshes = [mesh for mesh, _ in self.reflectors.values()] + list(self.occluders.values())
        return np.concatenate([mesh.triangles for mesh in meshes])


def finish_room(draft: RoomDraft, name: str, origin: str, carrier_ghz: float) -> tuple[RoomFiles, list[str]]:
    """Finish an imported room's draft, with an agent on a free line and a RIS panel above it: its files, all remarks.

    Raises
    ------
    Fault
        There is no place for an agent.
    """
    free = find_free(draft.triangles)
    if free is None:
        mend = "check --units and --up; a room wants walls around a free way of 0.3 m"
        raise Fault("no free place inside is found for the agent", mend)
    start, end = free.way
    agent = {"start": start.round(4).tolist(), "velocity": ((end - start) / 60.0).round(6).tolist(), **CYCLES}
    table: dict[str, Any] = {"name": name}
    table["reflector"] = [reflector(key, material) for key, (_, material) in draft.reflectors.items()]
    table["shade"] = [{"name": key, "mesh": mesh_file(key)} for key in draft.occluders]
    ris, about = propose_panel(draft, free, carrier_ghz)
    table |= {"ris": ris} if ris else {}
    table["agent"] = agent | BASELINE
    meshes = {key: mesh for key, (mesh, _) in draft.reflectors.items()} | draft.occluders
    length = float(np.linalg.norm(end - start))
    way = f"{length:.2g} m in a minute, {free.clearance:g} m off all surfaces"
    remarks = [*draft.remarks, f"proposed way: {way}; {about}"]
    if free.enclosed < 1.0:
        remarks.append(f"open: {1.0 - free.enclosed:.0%} of rays from the start leave the room")
    readme = f"{origin} " + " ".join(f"{remark[:1].upper()}{remark[1:]}." for remark in remarks)
    return RoomFiles({key: value for key, value in table.items() if value != []}, meshes, readme), remarks


def propose_panel(draft: RoomDraft, free: FreeSpace, carrier_ghz: float) -> tuple[dict[str, Any] | None, str]:
    """Propose a RIS panel above or beside the agent's line, the paper's size in wavelengths, with `energy` elements,
    which the check has nothing against: its table or None, and a remark."""
    spacing = float(f"{0.5e-9 * SPEED_OF_LIGHT / carrier_ghz:.3g}")
    names = [key for key, (mesh, _) in draft.reflectors.items() for _ in range(len(mesh.faces))]
    triangles = np.concatenate([mesh.triangles for mesh, _ in draft.reflectors.values()])
    middle, along = free.way.mean(axis=0), unit(free.way[1] - free.way[0])
    side = np.array([-along[1], along[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    for look in (up, unit(side + 0.5 * up), unit(-side + 0.5 * up), side, -side, along, -along):
        hit = int(ray_hits(middle, look[None], draft.triangles)[0])
        if not 0 <= hit < len(names):
            continue
        normal, offset = (part[0] for part in triangle_planes(triangles[hit : hit + 1]))
        center = middle + look * float((offset - normal @ middle) / (normal @ look))
        normal = normal * (1.0 if (middle - center) @ normal > 0.0 else -1.0) + 0.0
        right, _ = plane_tangents(normal)
        if _fits(center, normal, right, names[hit], draft, free, max(FROM_EDGE, 0.5 * SIZE * spacing)):
            lie = center.round(9).tolist(), normal.tolist(), right.tolist(), names[hit]
            about = f"a panel of {SIZE} x {SIZE} elements for {carrier_ghz:g} GHz on '{names[hit]}'"
            return panel(*lie, size=SIZE, element="energy", spacing=spacing), about
    return None, "no panel: nothing flat is free above or beside the way"


def _fits(
    center: Floats, normal: Floats, right: Floats, host: str, draft: RoomDraft, free: FreeSpace, half: float
) -> bool:
    """Whether the corners of a RIS panel proposed for the draft, `half` a side [m] from its centre, lie on one host and
    are seen from the middle of the agent's line."""
    down = cross(normal, right)
    corners = center + half * np.array([right + down, right - down, -right + down, -right - down])
    middle = free.way.mean(axis=0)
    hits = ray_hits(middle, unit(corners - middle), draft.triangles)
    own, seen = draft.reflectors[host][0].triangles, draft.triangles[hits]
    return bool((hits >= 0).all()) and all((own == triangle).all(axis=(1, 2)).any() for triangle in seen)
