"""Import of a room from a scanned mesh, with noise and holes, as clean planes and the clutter that they leave."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.geometry.triangles import distance_to_triangles, triangle_areas
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.importing.import_options import ImportOptions
from rislam_rt.scene.importing.regions.flat_regions import FlatRegions, Welded
from rislam_rt.scene.importing.regions.mesh_simplification import ClutterMesh, in_cells
from rislam_rt.scene.importing.regions.surfaces import SortedSurfaces, Surface, off_walls
from rislam_rt.scene.importing.scans.point_cloud import downsample_mesh
from rislam_rt.scene.importing.scans.scan_outline import BRIDGE, CELL, Outline, outline_planes
from rislam_rt.scene.importing.scans.scan_planes import WIDTHS, ScanPlane, find_planes

FLAT_SHARE = 0.3
"""Share of a mesh's area in wide flat regions below which it is a scan."""
CLOSE = 0.05
"""Distance [m] from a scanned plane up to which it explains what is there: skirting boards, frames, sockets."""


def looks_scanned(facets: FlatRegions, options: ImportOptions) -> bool:
    """Whether an imported mesh has the noise of a scan: hardly any of it is flat."""
    flat = facets.area[(facets.width >= options.narrow) & (facets.residual < 1e-3)].sum()
    return bool(flat < FLAT_SHARE * facets.area.sum())


def sort_scan(mesh: Welded, options: ImportOptions) -> tuple[SortedSurfaces, list[str]]:
    """Sort a scanned mesh into surfaces that reflect and clutter that hides; also remarks on noise and holes.

    Raises
    ------
    Fault
        No plane is found.
    """
    cloud = downsample_mesh(mesh)
    planes = find_planes(cloud)
    outlines = outline_planes(planes, cloud, options.fill)
    kept = [(plane, outline) for plane, outline in zip(planes, outlines, strict=True) if outline is not None]
    kept = [pair for k, pair in enumerate(kept) if not any(_lies_on(pair, larger, cloud.noise) for larger in kept[:k])]
    if not kept:
        raise Fault("no plane is found in the scan", "check --units, or clean the mesh")
    surfaces = []
    for plane, (shape, _) in kept:
        area = float(triangle_areas(shape.triangles).sum())
        surfaces.append(Surface(0, 0, plane.normal, shape, area, WIDTHS * plane.residual))
    rest = _unexplained(mesh, surfaces, max(CLOSE, 2.0 * WIDTHS * cloud.noise))
    triangles = mesh.vertices[mesh.faces[rest]]
    clutter, error, cell = in_cells([ClutterMesh(0, triangles)] if len(triangles) else [], 2.0 * options.wavelength)
    clutter = [ClutterMesh(0, off_walls(c.triangles, surfaces)) for c in clutter]
    clutter = [c for c in clutter if len(c.triangles)]
    shading = float(triangle_areas(triangles).sum())
    found = SortedSurfaces(surfaces, clutter, error, cell, options.narrow, shading, 0.0, [])
    return found, _remarks(kept, cloud.noise)


def _lies_on(pair: tuple[ScanPlane, Outline], larger: tuple[ScanPlane, Outline], noise: float) -> bool:
    """Whether a plane of a scanned room is the back of what stands on a larger one: parallel, within noise, outline."""
    (plane, outline), (wall, around) = pair, larger
    corners = outline.mesh.vertices
    if abs(float(plane.normal @ wall.normal)) < np.cos(np.radians(5.0)):
        return False
    if np.abs(corners @ wall.normal - wall.offset).max() > 2.0 * WIDTHS * noise:
        return False
    apart = distance_to_triangles(outline.mesh.triangles.mean(axis=1), around.mesh.triangles)
    return bool((apart < 4.0 * WIDTHS * noise).all())


def _remarks(kept: list[tuple[ScanPlane, Outline]], noise: float) -> list[str]:
    """Remarks on a scan: its noise, the residuals of its planes, and the holes filled."""
    worst = max(plane.residual for plane, _ in kept)
    filled = sum(outline.filled for _, outline in kept)
    return [
        f"a scan: points lie {1e3 * noise:.2g} mm (standard deviation) off the patches about them",
        f"{len(kept)} planes fitted, residual of the largest {1e3 * kept[0][0].residual:.2g} mm, at most "
        f"{1e3 * worst:.2g} mm (root mean square)",
        f"gaps up to {200 * BRIDGE * CELL:g} cm bridged, {filled:.3g} m^2 of larger holes filled (--fill: up to that "
        f"area each), outlines in cells of {100 * CELL:g} cm",
    ]


def _unexplained(mesh: Welded, surfaces: list[Surface], reach: float) -> Booleans:
    """Whether (F,) all corners of a scan's triangle are farther than `reach` [m] from every fitted plane."""
    walls = np.concatenate([s.mesh.triangles for s in surfaces])
    distance = np.full(len(mesh.vertices), np.inf)
    for normal, offset in ((s.normal, float(s.mesh.vertices[0] @ s.normal)) for s in surfaces):
        distance = np.minimum(distance, np.abs(mesh.vertices @ normal - offset))
    near = np.flatnonzero(distance < reach)  # of a plane; whether of its outline is looked at for these alone
    off: Floats = np.full(len(mesh.vertices), np.inf)
    off[near] = distance_to_triangles(mesh.vertices[near], walls)
    return np.asarray((off[mesh.faces] > reach).all(axis=1))
