"""Surfaces of an imported mesh: its flat regions sorted into those that reflect and clutter that hides."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, cross
from rislam_rt.constants import COPLANAR_OFFSET
from rislam_rt.geometry.triangles import distance_to_triangles, triangle_areas
from rislam_rt.scene.importing.import_options import ImportOptions
from rislam_rt.scene.importing.regions.flat_regions import FLAT_ANGLE, FlatRegions
from rislam_rt.scene.importing.regions.mesh_simplification import (
    ClutterMesh,
    corners_kept,
    has_area,
    in_cells,
    region_mesh,
)
from rislam_rt.scene.importing.regions.region_groups import RegionGroup
from rislam_rt.scene.importing.regions.round_surfaces import RoundPatch, prism
from rislam_rt.scene.meshes import Mesh

RESTING = 5e-3
"""Distance [m] from a wall of the shell up to which the far side of an object stands on it, unseen."""
OUTLINE = 0.125
"""Tolerance [wavelengths] within which outlines of flat regions are simplified."""
SAGITTA = 0.25
"""Tolerance [wavelengths] of flat sides to the cylinder that they stand for; half of it where they reflect."""


class Surface(NamedTuple):
    """Flat surface of an imported mesh that reflects."""

    piece: int
    """Number of the object that it belongs to, 0 for the shell of the room."""
    part: int
    """Part of the file that it comes from, for its names."""
    normal: Floats
    mesh: Mesh
    area: float
    """[m^2] of the regions that it stands for."""
    error: float
    """[m] that it is off the imported mesh."""


class SortedSurfaces(NamedTuple):
    """Imported mesh sorted into surfaces that reflect and clutter that hides, with figures for the report."""

    surfaces: list[Surface]
    clutter: list[ClutterMesh]
    shade_error: float
    """Largest distance [m] that a corner of the clutter was moved."""
    cell: float
    """Side [m] of the cells in which corners of clutter were joined."""
    narrow: float
    """Width [m] below which regions hide and do not reflect."""
    shading: float
    """Area [m^2] of regions that hide and do not reflect."""
    gone: float
    """Area [m^2] of regions that do neither: faces that rest on walls, things smaller than the detail."""
    cylinders: list[tuple[float, int, float]]
    """Radius [m], number of flat sides, and error [m] of each cylinder."""


def sort_regions(
    facets: FlatRegions, pieces: list[RegionGroup], rounds: list[RoundPatch], options: ImportOptions
) -> SortedSurfaces:
    """Sort the flat regions of an imported mesh into surfaces that reflect, clutter that hides, and what is left."""
    owner = np.zeros(len(facets.area), dtype=np.int64)
    for number, piece in enumerate(pieces):
        owner[piece.regions] = number
    rounded = np.zeros(len(owner), dtype=np.bool_)
    for found in rounds:
        # as planes, cylinders get sides of their own; of other round things the sides that are drawn are taken
        rounded[found.regions] = found.radius > 0.0 or options.curved == "shade"
    part = facets.part
    mirror, narrow = _mirrors(facets, rounded, options)
    resting = _resting(facets, pieces, mirror)
    mirror &= ~resting
    group = _coplanar(facets, pieces[0].regions, mirror)
    label = group.copy()
    for number, found in enumerate(rounds):
        if rounded[found.regions[0]]:
            label[found.regions] = len(owner) + number
    kept = corners_kept(facets, label)
    surfaces = []
    for number in np.unique(group[mirror]):
        regions = np.flatnonzero((group == number) & mirror)
        first = int(regions[0])
        mesh, error = region_mesh(facets, regions, kept, OUTLINE * options.wavelength)
        area = float(facets.area[regions].sum())
        surfaces.append(Surface(int(owner[first]), int(part[first]), facets.normal[first], mesh, area, error))
    return _with_clutter(facets, pieces, rounds, surfaces, owner, mirror, resting, narrow, options)


def _mirrors(facets: FlatRegions, rounded: Booleans, options: ImportOptions) -> tuple[Booleans, float]:
    """Whether (R,) each flat region of an imported mesh reflects like a plane, and from which width [m] on."""
    flat = ~rounded & (facets.residual <= OUTLINE * options.wavelength)
    width = np.minimum(facets.width, np.sqrt(facets.area))
    narrow = options.narrow
    chosen = np.sort(width[flat & (width >= narrow)])
    if len(chosen) > options.max_walls:
        narrow = float(chosen[-options.max_walls])
    return flat & (width >= narrow), narrow


def _resting(facets: FlatRegions, pieces: list[RegionGroup], mirror: Booleans) -> Booleans:
    """Whether (R,) each surface of an imported object lies on a wall of the shell from which the object rises."""
    resting = np.zeros(len(mirror), dtype=np.bool_)
    walls = pieces[0].regions[mirror[pieces[0].regions]]
    corners = facets.mesh.vertices[facets.mesh.faces]
    for piece in pieces[1:]:
        chosen = np.isin(facets.region, piece.regions)
        region, points = facets.region[chosen], corners[chosen]
        height = np.einsum("fci,wi->fcw", points, facets.normal[walls]) - facets.offset[walls]
        rises = np.abs(height).max(axis=(0, 1)) > 2.0 * RESTING
        one_side = (height.min(axis=(0, 1)) > -RESTING) | (height.max(axis=(0, 1)) < RESTING)
        near = np.abs(height).max(axis=1) < RESTING
        on = np.zeros(len(points), dtype=np.bool_)
        for wall in np.flatnonzero(rises & one_side & near.any(axis=0)):
            rows = np.flatnonzero(near[:, wall])
            solid = facets.mesh.vertices[facets.faces_of(walls[wall : wall + 1])]
            on[rows] |= distance_to_triangles(points[rows].mean(axis=1), solid) < RESTING
        resting[np.setdiff1d(np.unique(region), np.unique(region[~on]))] = True
    return resting


def _coplanar(facets: FlatRegions, shell: Integers, mirror: Booleans) -> Integers:
    """Wall (R,) that each surface of an imported mesh belongs to: in the shell, those of one plane and part are one."""
    group, part = np.arange(len(mirror)), facets.part
    rows = shell[mirror[shell]]
    for place, i in enumerate(rows):
        if group[i] != i:
            continue
        later = rows[place + 1 :]
        turn = np.linalg.norm(cross(facets.normal[later], facets.normal[i]), axis=1)
        sign = np.sign(facets.normal[later] @ facets.normal[i])
        apart = np.abs(sign * facets.offset[later] - facets.offset[i])
        same = (turn < 0.1 * FLAT_ANGLE) & (part[later] == part[i]) & (group[later] == later)
        for j in later[same & (apart < 10.0 * COPLANAR_OFFSET)]:
            corners = facets.mesh.vertices[facets.faces_of(np.array([j]))]
            if np.abs(corners @ facets.normal[i] - facets.offset[i]).max() < COPLANAR_OFFSET:
                group[j] = i
    return group


def _with_clutter(
    facets: FlatRegions, pieces: list[RegionGroup], rounds: list[RoundPatch], surfaces: list[Surface], owner: Integers,
    mirror: Booleans, resting: Booleans, narrow: float, options: ImportOptions,
) -> SortedSurfaces:  # fmt: skip
    """Complete the sorted surfaces of an imported mesh: cylinders as prisms, what does not reflect as clutter."""
    wavelength, cylinders, prisms = options.wavelength, [], []
    rest = ~mirror & ~resting
    for found in rounds:
        if found.radius < wavelength or found.along[1] - found.along[0] < narrow or resting[found.regions].all():
            continue
        sagitta = SAGITTA * wavelength * (0.5 if options.curved == "planes" else 1.0)
        mesh, error = prism(found, sagitta)
        first = int(found.regions[0])
        thing, part = int(owner[first]), int(facets.part[first])
        cylinders.append((found.radius, len(mesh.faces) // 2, error))
        rest[found.regions] = False
        if options.curved == "planes":
            area = float(facets.area[found.regions].sum())
            surfaces.append(Surface(thing, part, facets.normal[first], mesh, area, error))
        else:
            prisms.append(ClutterMesh(thing, mesh.triangles))
    gone = float(facets.area[resting].sum())
    shell = [s for s in surfaces if s.piece == 0 and len(s.mesh.faces) < 200]
    raw = []
    for number, piece in enumerate(pieces):
        regions = piece.regions[rest[piece.regions]]
        triangles = off_walls(facets.mesh.vertices[facets.faces_of(regions)], shell)
        if len(triangles) and np.ptp(triangles.reshape(-1, 3), axis=0).max() >= narrow:
            raw.append(ClutterMesh(number, triangles))
        else:
            gone += float(facets.area[regions].sum())
            rest[regions] = False
    thin, error, cell = in_cells(raw, wavelength)
    shading = float(facets.area[rest].sum()) + sum(float(triangle_areas(clutter.triangles).sum()) for clutter in prisms)
    thin = [ClutterMesh(c.piece, off_walls(c.triangles, shell)) for c in (*prisms, *thin)]
    thin = [clutter for clutter in thin if len(clutter.triangles)]
    return SortedSurfaces(surfaces, thin, error, cell, narrow, shading, gone, cylinders)


def off_walls(triangles: Floats, walls: list[Surface]) -> Floats:
    """Clutter triangles (T, 3, 3) without those that lie flat on a wall of an imported room's shell."""
    keep = has_area(triangles)
    for wall in walls:
        flat = np.abs((triangles - wall.mesh.vertices[0]) @ wall.normal).max(axis=1) <= RESTING
        rows = np.flatnonzero(keep & flat)
        keep[rows] = distance_to_triangles(triangles[rows].mean(axis=1), wall.mesh.triangles) > RESTING
    return triangles[keep]
