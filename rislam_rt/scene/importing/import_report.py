"""Report of an import: how much of a mesh became walls and occluders, and how far they are off."""

from collections import Counter
from typing import Any

from rislam_rt.constants import COPLANAR_ANGLE, COPLANAR_OFFSET
from rislam_rt.geometry.plane_segmentation import planar_regions
from rislam_rt.scene.importing.options import ImportOptions
from rislam_rt.scene.importing.regions.flat_regions import FlatRegions
from rislam_rt.scene.importing.regions.surfaces import SortedSurfaces, Surface
from rislam_rt.scene.meshes import Mesh


def summarise_import(
    facets: FlatRegions, found: SortedSurfaces, surfaces: list[Surface], unseen: float, reflectors: dict[str, Any],
    occluders: dict[str, Mesh], options: ImportOptions, *, scanned: bool,
) -> list[str]:  # fmt: skip
    """Report of an import: numbers, areas and errors of what became of a mesh, one line each."""
    walls = sum(
        len(planar_regions(mesh.triangles, COPLANAR_ANGLE, COPLANAR_OFFSET).offset) for mesh, _ in reflectors.values()
    )
    total, waves = float(facets.area.sum()), found.narrow / options.wavelength
    triangles = sum(len(mesh.faces) for mesh in occluders.values())
    mirror = sum(s.area for s in surfaces)
    remarks = [
        f"{len(facets.mesh.faces)} triangles, {total:.4g} m^2: {walls} walls of {mirror:.4g} m^2 in {len(reflectors)} "
        f"reflectors, {len(occluders)} occluders of {triangles} triangles",
        f"walls are within {max(1e3 * max(s.error for s in surfaces), 0.01):.2g} mm of the mesh",
    ]
    if found.shading:
        width = f"{100 * found.narrow:.2g} cm ({waves:.2g} wavelengths at {options.carrier_ghz:g} GHz)"
        narrow = f"narrower than {width}" + (" or round" if options.curved == "shade" else "")
        why = "that lie on no plane" if scanned else narrow
        remarks.append(f"{found.shading:.3g} m^2 {why} shade and do not reflect")
    if found.shade_error:
        how = f"corners joined in cells of {1e3 * found.cell:.2g} mm, moved {1e3 * found.shade_error:.2g} mm at most"
        remarks.append(f"clutter is thinned: {how}")
    alike = Counter((round(radius, 3), sides, round(error, 4)) for radius, sides, error in found.cylinders)
    for (radius, sides, error), count in alike.most_common(8):
        what = "reflect" if options.curved == "planes" else "shade (--curved planes: reflect)"
        many = "a cylinder" if count == 1 else f"each of {count} cylinders"
        off = f"{1e3 * error:.2g} mm"
        remarks.append(f"{many} of {radius:.3g} m became {sides} flat sides within {off} that {what}")
    if found.gone > 1e-4 * total:
        remarks.append(f"{found.gone:.3g} m^2 are left out: faces that stand on walls, things below the detail")
    if unseen > 0.0:
        remarks.append(f"{unseen:.3g} m^2 are left out that nobody inside can see")
    if found.narrow > options.narrow * (1.0 + 1e-9):
        remarks.append(f"the {options.max_walls} widest walls reflect (--max-walls)")
    return remarks
