"""Placement of an imported file in the room: units, axis, origin, and whether what comes out has the size of a room."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.triangles import triangle_cross
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.importing.import_options import ImportOptions
from rislam_rt.scene.importing.mesh_source import MeshPart
from rislam_rt.scene.mesh_placement import UNITS, place_points
from rislam_rt.scene.meshes import MAX_COORDINATE

SMALLEST_ROOM, LARGEST_ROOM = 1.0, 200.0
"""Diagonals [m] outside of which an imported room is taken to be in a wrong unit, unless the user gave one."""
USUAL = (2.0, 60.0)
"""Diagonals [m] of the rooms for which another unit is proposed."""


def place_parts(parts: list[MeshPart], suffix: str, options: ImportOptions) -> tuple[list[Floats], list[str]]:
    """Place the parts of an imported mesh in the room: triangles (T, 3, 3) [m] of each, z up, and remarks.

    Raises
    ------
    Fault
        The result has no room's size (one that is large in units that the user gave may be meant), or lies too far
        from the room's zero.
    """
    units = options.units or "m"
    up = options.up or ("y" if suffix in (".glb", ".gltf") else "z")
    origin = np.array(options.origin, dtype=np.float64)
    placed = [place_points(part.triangles, up, UNITS[units], origin) for part in parts]
    corners = np.concatenate([t.reshape(-1, 3) for t in placed])
    size = np.ptp(corners, axis=0)
    doubts = check_size(float(np.linalg.norm(size)) / UNITS[units], options.units)
    check_near(corners, origin)
    remarks = [*doubts, f"{size[0]:.3g} x {size[1]:.3g} x {size[2]:.3g} m, with units = {units}, up = {up}"]
    facing = np.abs(triangle_cross(np.concatenate(placed))).sum(axis=0)  # twice the area seen along each axis
    other = "y" if up == "z" else "z"
    if options.up is None and facing[1] > 1.2 * facing[2] and size[1] < size[2]:
        remarks.append(f"its largest surfaces look sideways: if it lies on its side, give --up {other}")
    return placed, remarks


def check_near(points: Floats, origin: Floats) -> None:
    """Refuse an imported room whose points (N, D) [m] lie too far from its zero, as in a map's coordinates, and say
    which `--origin` brings it near; `origin` (D,) [m] is the one that it was placed by, D = 2 of a floor plan.

    Raises
    ------
    Fault
        A coordinate exceeds `MAX_COORDINATE`.
    """
    far = float(np.abs(points).max())
    if far > MAX_COORDINATE:
        low = [f"{value:.0f}" for value in np.floor(points.min(axis=0) + origin) + 0.0] + ["0"] * (3 - points.shape[1])
        mend = f"give --origin {','.join(low)}, a point beside it that becomes the room's zero"
        raise Fault(
            f"it lies {far:.7g} m from the zero of its coordinates, and {MAX_COORDINATE:.0f} m are the most", mend
        )


def check_size(extent: float, units: str | None) -> list[str]:
    """Refuse an imported room that has no room's size, and say which unit would mend it.

    `extent` is its diagonal in units of the file. Of a unit that the user gave, what is too small for any agent is
    refused where another unit fits; of what is large, which may be meant, a remark is returned.

    Raises
    ------
    Fault
        Too small, or too large and the units were not given.
    """
    size = extent * UNITS[units or "m"]
    if SMALLEST_ROOM <= size <= LARGEST_ROOM:
        return []
    fitting = [u for u, length in UNITS.items() if USUAL[0] <= extent * length <= USUAL[1]]
    words = " or ".join(f"--units {u} ({extent * UNITS[u]:.2g} m)" for u in fitting)
    what = f"{'in metres' if units is None else f'with --units {units}'} it would measure {size:.4g} m across"
    if units is not None and (size > LARGEST_ROOM or not words):
        return [f"{what}: give {words} if that is not meant"] if words else []
    mend = f"give {words}" if words else "give --units mm, cm, m or in"
    if words and units is None:
        mend += ", or --units m if it is meant"
    if not words and size < SMALLEST_ROOM:
        mend += "; degrees of longitude and latitude have to be projected to metres first"
    if extent * UNITS["mm"] > LARGEST_ROOM:
        mend = "no unit makes a room of it: mend the coordinates that lie far off"
    raise Fault(what, mend)
