"""Round surfaces in a mesh of flat facets: which facets make one, and the cylinder that some of them are."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.geometry.planes import plane_tangents
from rislam_rt.scene.importing.regions.flat_regions import FLAT_ANGLE, FlatRegions, crease_groups
from rislam_rt.scene.meshes import Mesh, joined
from rislam_rt.scene.shapes import quad

CREASE = np.radians(35.0)
"""Angle [rad] of facets above which they meet in an edge: a round thing is drawn with eleven sides or more."""
WIDEST = 0.5
"""Width [m] above which a facet is a wall of a bay, not a drawing of something round."""
FEWEST = 5
"""Least number of facets of a round surface: fewer are a bevel."""


class RoundPatch(NamedTuple):
    """A round surface made of flat facets of a mesh; a cylinder if it has a radius."""

    regions: Integers
    """Numbers of its facets (flat regions)."""
    axis: Floats
    """(3,) unit vector along the cylinder."""
    center: Floats
    """(3,) [m] a point of the axis."""
    radius: float
    """[m] of the cylinder, 0 for any other round shape."""
    along: tuple[float, float]
    """[m] from where to where it reaches along the axis, from `center`."""
    arc: tuple[float, float]
    """[rad] from where to where it goes round; all the way if that is 2 pi."""


def find_round(facets: FlatRegions) -> list[RoundPatch]:
    """Find a mesh's round surfaces: facets narrower than `WIDEST` that meet at less than `CREASE`."""
    narrow = facets.width < WIDEST
    group = crease_groups(facets, narrow, float(FLAT_ANGLE), float(CREASE))
    order = np.argsort(group, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(group[order])) + 1)
    return [_cylinder(facets, part) for part in parts if len(part) >= FEWEST]


def sides_for(radius: float, sagitta: float, arc: float) -> int:
    """Number of flat sides that keep a cylinder's arc [rad] within a sagitta [m]."""
    step = 2.0 * np.arccos(max(1.0 - sagitta / radius, np.cos(np.pi / 6.0)))
    return max(int(np.ceil(arc / step)), 1)


def prism(found: RoundPatch, sagitta: float) -> tuple[Mesh, float]:
    """Mesh of a cylinder as a prism, its flat sides without ends, and how far they are off it [m].

    All the way round the girth is the true one, so that its shadow is (Cauchy); an arc has its corners on the circle.
    """
    start, end = found.arc
    count = sides_for(found.radius, sagitta, end - start)
    angle = np.linspace(start, end, count + 1)
    half = 0.5 * (end - start) / count
    full = end - start > 2.0 * np.pi - 1e-9
    corner = found.radius * half / np.sin(half) if full else found.radius
    u, v = plane_tangents(found.axis)
    ring = found.center + corner * (np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v)
    if full:
        ring[-1] = ring[0]
    low, high = (ring + height * found.axis for height in found.along)
    sides = [quad(np.stack([low[i], low[i + 1], high[i + 1], high[i]])) for i in range(count)]
    return joined(sides), max(corner - found.radius, found.radius - corner * float(np.cos(half)))


def _cylinder(facets: FlatRegions, regions: Integers) -> RoundPatch:
    """Fit a cylinder to the corners of a patch of facets; radius 0 where they lie on none or do not cover it."""
    normal, area = facets.normal[regions], facets.area[regions]
    values, vectors = np.linalg.eigh(np.einsum("r,ri,rj->ij", area, normal, normal) / area.sum())
    axis = vectors[:, 0] * (1.0 if vectors[np.argmax(np.abs(vectors[:, 0])), 0] > 0.0 else -1.0)
    points = facets.mesh.vertices[np.unique(facets.faces_of(regions))]
    other = RoundPatch(regions, axis, points.mean(axis=0), 0.0, (0.0, 0.0), (0.0, 0.0))
    if values[0] > 0.01:
        return other
    u, v = plane_tangents(axis)
    flat, along = points @ np.stack([u, v], axis=-1), points @ axis
    # |p|^2 = 2 c . p + (r^2 - |c|^2), linear in c (Kasa, IEEE Trans. Instrum. Meas. 1976), about the middle
    middle = flat.mean(axis=0)
    local = flat - middle
    system = np.column_stack([2.0 * local, np.ones(len(local))])
    solution = np.linalg.lstsq(system, np.einsum("ni,ni->n", local, local), rcond=None)[0]
    radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 0.0)))
    around = local - solution[:2]
    if radius == 0.0 or np.abs(np.linalg.norm(around, axis=1) - radius).max() > 0.03 * radius:
        return other
    angle = np.sort(np.arctan2(around[:, 1], around[:, 0]))
    gaps = np.diff(np.append(angle, angle[0] + 2.0 * np.pi))
    widest = int(np.argmax(gaps))
    full = gaps[widest] <= 1.1 * CREASE
    arc = (0.0, 2.0 * np.pi) if full else (angle[(widest + 1) % len(angle)], angle[widest])
    arc = (arc[0], arc[1] + 2.0 * np.pi * (arc[1] < arc[0]))
    height = float(np.ptp(along))
    if abs(area.sum() - radius * (arc[1] - arc[0]) * height) > 0.1 * area.sum():
        return other
    center = (middle + solution[:2]) @ np.stack([u, v])
    return RoundPatch(regions, axis, center, radius, (float(along.min()), float(along.max())), arc)
