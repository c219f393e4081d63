"""Scene check of occluders: sound meshes, nothing inside but their own scatterer's centre, and not the agent."""

from collections.abc import Iterator

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.model import Occluder, RadioConfig
from rislam_rt.scene.check.mesh_queries import crossings, winding
from rislam_rt.scene.check.triangle_array import TriangleArray
from rislam_rt.scene.findings import Finding


def occluder_errors(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: errors of an occluder off its own scatterer, or about another landmark or the agent."""
    marks, motion = room.scene.landmark_positions, room.scene.agent
    for field, number, shade in occluder_fields(room):
        inside = _inside(marks, shade)
        if number is not None and not inside[number]:
            message = f"it does not enclose the scatterer's position {marks[number].tolist()}"
            yield room.error(field, message, "give a closed mesh in the room's frame, about the position")
            continue
        if number is not None:
            inside[number] = False
        if inside.any():
            message = f"'{room.scene.landmarks[int(np.argmax(inside))]}' lies inside it, where no ray reaches it"
            yield room.error(field, message, "move one of the two")
        for part, points in (("the agent", motion.position), ("Tx", motion.tx), ("Rx", motion.rx)):
            cycle = _enters(points, shade)
            if cycle is not None:
                what = f"{part} is inside it at or after cycle {cycle}"
                yield room.error(field, what, "keep the agent away from it")
                break


def cylinder_warnings(room: TriangleArray, radio: RadioConfig) -> Iterator[Finding]:
    """Scene check: warnings of a cylinder whose far field, for which its law holds, the agent is not in."""
    motion = room.scene.agent
    for number, scatterer in enumerate(room.scene.scatterers):
        if scatterer.law != "cylinder" or scatterer.height is None:
            continue
        limit = 2.0 * scatterer.height**2 / radio.wavelength
        nearest = min(float(np.linalg.norm(p - scatterer.position, axis=-1).min()) for p in (motion.tx, motion.rx))
        if nearest < limit:
            message = f"the agent comes within {nearest:.3g} m, its far field begins at 2 h^2 / lambda = {limit:.3g} m"
            field = f"scatterer[{number}].height_m ({scatterer.name})"
            near_field = np.pi * (scatterer.radius or 0.0) * nearest  # a long one's, by geometrical optics
            mend = f"take a shorter one, or give 'rcs_m2': pi r times the distance, {near_field:.2g} m^2 there"
            yield room.warning(field, message, mend)


def occluder_fields(room: TriangleArray) -> Iterator[tuple[str, int | None, Occluder]]:
    """Scene check: field in the file, number of the scatterer (None: stands alone), and mesh of every occluder."""
    for number, scatterer in enumerate(room.scene.scatterers):
        if scatterer.shade is not None:
            yield f"scatterer[{number}].mesh ({scatterer.name})", number, scatterer.shade
    for number, shade in enumerate(room.scene.occluders):
        yield f"shade[{number}].mesh ({shade.name})", None, shade


def _inside(points: Floats, shade: Occluder) -> Booleans:
    """Whether (N,) points (N, 3) lie inside an occluder."""
    return np.array([abs(winding(point, shade.triangles)) > 0.5 for point in points], dtype=np.bool_)


def _enters(points: Floats, shade: Occluder) -> int | None:
    """First cycle of the agent's track (K, 3) inside an occluder, or after which it enters; None if there is none."""
    if _inside(points[:1], shade)[0]:
        return 0
    cycles, _ = crossings(points[:-1], points[1:], shade.triangles)
    return int(cycles.min()) if len(cycles) else None
