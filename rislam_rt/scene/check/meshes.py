"""Scene check of meshes, their materials, and point scatterers: names, degenerate and doubled faces, size, place."""

from collections import Counter
from collections.abc import Iterator

import numpy as np

from rislam_rt.errors import SceneError
from rislam_rt.model import RadioConfig, Scene
from rislam_rt.model.itu import ITU_MATERIALS, itu_parameters
from rislam_rt.model.slab import normal_reflection
from rislam_rt.scene.check.mesh_queries import touching
from rislam_rt.scene.check.occluders import occluder_fields
from rislam_rt.scene.check.triangle_array import KEEP_AWAY, MIN_CLEARANCE, TriangleArray, without_area
from rislam_rt.scene.check.units import ROOM_FIELD
from rislam_rt.scene.findings import Finding, error_at, warning_at

FAINT = 10.0 ** (-10.0 / 20.0)
"""Reflection coefficient of a slab, to that of the same material without a back, below which its thickness hides it."""


def name_errors(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: errors of reflectors, occluders or landmarks that have one name."""
    names = [r.name for r in room.scene.reflectors] + list(room.scene.landmarks)
    names += [shade.name for shade in room.scene.occluders]
    for name, count in Counter(names).items():
        if count > 1:
            yield room.error("name", f"{count} parts are called '{name}'", "give every part a name of its own")


def face_errors(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: errors of reflectors and occluders with faces without area."""
    reflectors = enumerate(room.scene.reflectors)
    parts = [(f"reflector[{number}].mesh ({one.name})", one.triangles) for number, one in reflectors]
    for field, triangles in [*parts, *((field, shade.triangles) for field, _, shade in occluder_fields(room))]:
        bad = without_area(triangles)
        if bad.any():
            message = f"{int(bad.sum())} faces without area, the first is face {int(np.argmax(bad))}"
            yield room.error(field, message, "remove degenerate faces from the mesh")


def scatterer_errors(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: errors of point scatterers outside the meshes' bounds, on a surface, or larger than the room."""
    diagonal = float(np.linalg.norm(room.bounds[1] - room.bounds[0]))
    for number, scatterer in enumerate(room.scene.scatterers):
        field, at = f"scatterer[{number}].position ({scatterer.name})", scatterer.position
        if scatterer.radius is not None and scatterer.radius > diagonal:
            message = f"{scatterer.radius:g} m, and the room measures {diagonal:.3g} m across"
            yield room.error(f"scatterer[{number}].radius ({scatterer.name})", message, "give its radius in metres")
        elif len(room.outside(at[None])):
            yield room.error(field, f"{at.tolist()} lies outside the meshes' bounds {room.box}", "move it inside")
        else:
            _, near = touching(at[None], room.triangles, MIN_CLEARANCE)
            if len(near):
                yield room.error(field, f"{at.tolist()} lies on '{room.name(near[0])}'", KEEP_AWAY)


def mesh_warnings(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: warnings of a room with a size in wrong units, and of doubled faces of one mesh."""
    diagonal = float(np.linalg.norm(room.bounds[1] - room.bounds[0]))
    if diagonal > 200.0 or diagonal < 0.2:
        mend = f"metres wanted: is it in {'millimetres' if diagonal > 200.0 else 'kilometres'}?"
        yield room.warning(ROOM_FIELD, f"the room measures {diagonal:.3g} m across", mend)
    corners = np.round(room.triangles, 6) + 0.0
    order = np.lexsort(np.moveaxis(corners, -1, 0)[::-1], axis=-1)
    keys = np.take_along_axis(corners, order[..., None], axis=1).reshape(len(corners), 9)
    _, first, count = np.unique(np.column_stack([keys, room.owner]), axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        name = room.name(first[np.argmax(count > 1)])
        message = f"{int((count - 1).sum())} faces lie exactly on others of their mesh, the first in '{name}'"
        yield room.warning("reflector", message, "leave the doubles out")


def material_errors(scene: Scene, file: str, radio: RadioConfig) -> Iterator[Finding]:
    """Scene check: errors of reflectors whose ITU-R P.2040 material is not specified at the carrier."""
    ghz = radio.carrier / 1e9
    for number, reflector in enumerate(scene.reflectors):
        name = reflector.material.itu
        if name is None:
            continue
        try:
            itu_parameters(name, radio.carrier)
        except SceneError:
            ranges = " or ".join(f"{row[0]:g} to {row[1]:g} GHz" for row in ITU_MATERIALS[name])
            message = f"'{name}' is not specified at the carrier of {ghz:g} GHz, only from {ranges}"
            field = f"reflector[{number}].material.itu ({reflector.name})"
            yield error_at(file, field, message, "take another material, or radio.carrier_ghz in that range")


def faint_slabs(scene: Scene, file: str, radio: RadioConfig) -> Iterator[Finding]:
    """Scene check of meshes' materials: warnings of those as thick as half waves of the carrier in them, at normal
    incidence: both faces' reflections cancel, and the radio hardly hears the wall (ITU-R P.2040, single-layer slab)."""
    ghz, warned = radio.carrier / 1e9, set()
    for number, reflector in enumerate(scene.reflectors):
        material, found = reflector.material, normal_reflection(reflector.material, radio.carrier)
        if found is None or found.slab >= FAINT * found.half_space or material in warned:
            continue
        warned.add(material)
        others = sum(other.material == material for other in scene.reflectors) - 1
        name = f"'{material.itu}'" if material.itu else f"permittivity {material.permittivity:g}"
        thick, half = 1e3 * material.thickness, 1e3 * found.half_wave
        other = thick + (0.5 if thick < 0.75 * half else -0.5) * half
        message = (
            f"{thick:.3g} mm of {name} reflect {found.slab:.2g} of the amplitude at {ghz:g} GHz and normal incidence, "
            f"a thick slab {found.half_space:.2g}: it is {thick / half:.2f} half waves thick, and hardly heard"
        )
        mend = f"check the thickness ({other:.2g} mm reflect most), or give reflection = {found.half_space:.2g} instead"
        field = f"reflector[{number}].material.thickness_m ({reflector.name}{f' and {others} more' if others else ''})"
        yield warning_at(file, field, message, mend)
