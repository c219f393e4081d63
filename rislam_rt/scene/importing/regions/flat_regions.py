"""Flat regions of a mesh welded at its corners: neighbouring triangles in one plane joined, with plane and size."""

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from rislam_rt.arrays import Booleans, Floats, Integers, cross
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.triangles import connected, triangle_cross, triangle_heights

FLAT_ANGLE = np.radians(0.5)
"""Angle [rad] of neighbouring triangles below which they are one plane: half a degree looks flat to whoever drew it."""

WELD = 2e-5
"""Distance [m] of corners below which they are one: what float32 leaves open in a file of 100 m."""


class Welded(NamedTuple):
    """A welded mesh, whose triangles share their corners."""

    vertices: Floats
    """(V, 3) [m]."""
    faces: Integers
    """(F, 3) indices into `vertices`."""
    part: Integers
    """(F,) part of the file that each comes from."""


class Edges(NamedTuple):
    """Pairs (a, b) of a mesh's triangles that share an edge."""

    a: Integers
    b: Integers
    turn: Floats
    """(E,) [rad] angle at which the two triangles meet, zero in one plane, whichever way either is turned."""


class FlatRegions(NamedTuple):
    """R flat regions of a mesh whose triangles share their corners."""

    mesh: Welded
    """The mesh, its triangles turned to their region's normal."""
    region: Integers
    """(F,) region of each triangle."""
    normal: Floats
    """(R, 3) unit normal of each region's plane."""
    offset: Floats
    """(R,) [m] of each region's plane: `normal . x = offset`."""
    area: Floats
    """(R,) [m^2] of each region."""
    width: Floats
    """(R,) [m] short side of the rectangle with the same second moments."""
    residual: Floats
    """(R,) [m] distance of a region's farthest corner from its plane."""
    component: Integers
    """(R,) part of the mesh connected by edges that each region is in; one that touches at a corner is none of it."""
    edges: Edges

    @property
    def part(self) -> Integers:
        """Part (R,) of the file that each flat region of a mesh comes from."""
        part = np.zeros(len(self.area), dtype=np.int64)
        part[self.region] = self.mesh.part
        return part

    def faces_of(self, regions: Integers) -> Integers:
        """Triangles (T, 3) of a mesh in given flat regions."""
        return self.mesh.faces[np.isin(self.region, regions)]


def weld(triangles: list[Floats]) -> Welded:
    """Weld parts (T, 3, 3) [m] of a mesh at common corners, without doubles and triangles without area."""
    corners = np.concatenate([t.reshape(-1, 3) for t in triangles])
    part = np.repeat(np.arange(len(triangles)), [len(t) for t in triangles])
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    pairs = cKDTree(vertices).query_pairs(WELD, output_type="ndarray")
    group = connected(pairs, len(vertices))
    _, first = np.unique(group, return_index=True)
    vertices, faces = vertices[first], group[index.ravel()].reshape(-1, 3)
    _, single = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    keep = np.intersect1d(np.flatnonzero(triangle_heights(vertices[faces]) > WELD), single)
    return Welded(vertices, faces[keep], part[keep])


def find_facets(mesh: Welded) -> FlatRegions:
    """Part a mesh into flat regions: neighbouring triangles of one part that meet at less than `FLAT_ANGLE`."""
    triangles = mesh.vertices[mesh.faces]
    cross = triangle_cross(triangles)
    area, normal = 0.5 * np.linalg.norm(cross, axis=1), unit(cross)
    edges = _edges(mesh.faces, normal)
    flat = (edges.turn < FLAT_ANGLE) & (mesh.part[edges.a] == mesh.part[edges.b])
    region = connected(np.stack([edges.a[flat], edges.b[flat]], axis=-1), len(mesh.faces))
    count = int(region.max(initial=-1)) + 1
    order = np.lexsort((-area, region))
    biggest = order[np.searchsorted(region[order], np.arange(count))]
    side = np.sign(np.einsum("fi,fi->f", normal, normal[biggest][region]))
    faces = np.where((side < 0.0)[:, None], mesh.faces[:, ::-1], mesh.faces)
    plane, offset, width, residual = _planes(triangles, area, region, normal[biggest])
    piece = connected(np.stack([edges.a, edges.b], axis=-1), len(mesh.faces))
    component = np.asarray(np.unique(piece[biggest], return_inverse=True)[1], dtype=np.int64)
    total = np.asarray(np.bincount(region, area, count), dtype=np.float64)
    turned = mesh._replace(faces=faces)
    return FlatRegions(turned, region, plane, offset, total, width, residual, component, edges)


def bounds_of(facets: FlatRegions, regions: Integers) -> Floats:
    """Bounds (2, 3) [m] of flat regions of a mesh: lowest and highest corner."""
    corners = facets.mesh.vertices[facets.faces_of(regions)].reshape(-1, 3)
    return np.stack([corners.min(axis=0), corners.max(axis=0)])


def crease_groups(facets: FlatRegions, chosen: Booleans, low: float, high: float) -> Integers:
    """Group (R,) of each flat region: chosen ones whose common edges turn by `low` to `high` [rad] have one."""
    edges, region = facets.edges, facets.region
    a, b = region[edges.a], region[edges.b]
    joined = (a != b) & (edges.turn >= low) & (edges.turn <= high) & chosen[a] & chosen[b]
    return connected(np.stack([a[joined], b[joined]], axis=-1), len(facets.area))


def _edges(faces: Integers, normal: Floats) -> Edges:
    """Pairs of a mesh's triangles that share an edge, with the angles at which they meet, to find flat regions."""
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    owner = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort((owner, ends[:, 1], ends[:, 0]))
    same = (ends[order][1:] == ends[order][:-1]).all(axis=1)
    a, b = owner[order][:-1][same], owner[order][1:][same]
    cosine = np.abs(np.einsum("ei,ei->e", normal[a], normal[b]))
    sine = np.linalg.norm(cross(normal[a], normal[b]), axis=1)
    return Edges(a, b, np.arctan2(sine, cosine))


def _planes(triangles: Floats, area: Floats, region: Integers, side: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Least-squares normal (on the side of `side` (R, 3)), offset, width and residual of each flat region."""
    count = len(side)
    total = np.bincount(region, area, count)
    middle = triangles.mean(axis=1)
    center = np.stack([np.bincount(region, area * middle[:, i], count) for i in range(3)], axis=-1) / total[:, None]
    local = triangles - center[region][:, None]
    inner = local.mean(axis=1)
    # the second moment of a triangle: area / 12 times (the sum of its corners' products and 9 times its middle's)
    moment = (np.einsum("tci,tcj->tij", local, local) + 9.0 * inner[:, :, None] * inner[:, None, :]) / 12.0
    spread = np.zeros((count, 3, 3))
    np.add.at(spread, region, area[:, None, None] * moment)
    values, vectors = np.linalg.eigh(spread / total[:, None, None])
    normal = vectors[:, :, 0]
    normal *= np.where(np.einsum("ri,ri->r", normal, side) < 0.0, -1.0, 1.0)[:, None]
    height = np.abs(np.einsum("tci,ti->tc", local, normal[region])).max(axis=1)
    residual = np.zeros(count)
    np.maximum.at(residual, region, height)
    width = np.sqrt(12.0 * np.maximum(values[:, 1], 0.0))
    return normal, np.einsum("ri,ri->r", normal, center), width, residual
