"""A scanned mesh as a point cloud with normals and areas, subsampled."""

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.spatial import cKDTree

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.triangles import triangle_cross
from rislam_rt.scene.importing.regions.flat_regions import Welded

SPACING = 0.04
"""Side [m] of the cubes in each of which one point of a scanned mesh is kept."""
NEIGHBOURS = 30
"""Neighbouring points of a scan for the normal at each: a patch some 12 cm wide."""
SMOOTHING = 3
"""Times that the normals at a scanned mesh's corners are averaged over their neighbours."""


class PointCloud(NamedTuple):
    """Point cloud of N points subsampled from a scanned mesh."""

    points: Floats
    """(N, 3) [m] positions."""
    normal: Floats
    """(N, 3) unit normal of a small patch about each point."""
    area: Floats
    """(N,) [m^2] that each point stands for."""
    noise: float
    """Standard deviation [m] of points off the patches about them, their median."""


def downsample_mesh(mesh: Welded) -> PointCloud:
    """Point cloud of a scanned mesh: a corner for every cube of `SPACING` and side, with the normal of its patch.

    Both faces of a thin board stay apart where the mesh says which side is which.
    """
    facing, share = _facing(mesh)
    side = np.argmax(np.abs(facing), axis=1)
    side = 2 * side + (np.take_along_axis(facing, side[:, None], axis=1)[:, 0] < 0.0)
    key = np.column_stack([np.floor(mesh.vertices / SPACING).astype(np.int64), side])
    _, first, box = np.unique(key, axis=0, return_index=True, return_inverse=True)
    points, facing, count = mesh.vertices[first], facing[first], min(NEIGHBOURS, len(first))
    area = np.asarray(np.bincount(box.ravel(), share), dtype=np.float64)
    # neighbours in place and facing: a turn of a right angle counts as much as four cubes
    space = np.concatenate([points, 4.0 * SPACING * facing], axis=1)
    near = points[cKDTree(space).query(space, count)[1].reshape(len(points), count)]
    near = near - near.mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", near, near) / count)
    normal = vectors[:, :, 0]
    normal *= np.where(np.einsum("ni,ni->n", normal, facing) < 0.0, -1.0, 1.0)[:, None]
    # three of the patch's degrees of freedom went into its own plane
    noise = np.sqrt(np.maximum(values[:, 0], 0.0) * count / max(count - 3, 1))
    return PointCloud(points, normal, area, float(np.median(noise)))


def _facing(mesh: Welded) -> tuple[Floats, Floats]:
    """Smoothed normal (V, 3) of a scanned mesh at each corner, and the area (V,) [m^2] that it stands for."""
    triangles = mesh.vertices[mesh.faces]
    cross = triangle_cross(triangles)
    share, facing = np.zeros(len(mesh.vertices)), np.zeros((len(mesh.vertices), 3))
    np.add.at(share, mesh.faces, np.linalg.norm(cross, axis=1)[:, None] / 6.0)
    for corner in range(3):
        np.add.at(facing, mesh.faces[:, corner], cross)
    rows = mesh.faces.ravel()
    ones = np.ones(len(rows))
    touch = coo_matrix((ones, (rows, np.repeat(np.arange(len(mesh.faces)), 3))), shape=(len(facing), len(mesh.faces)))
    around = (touch @ touch.T).tocsr()
    for _ in range(SMOOTHING):
        facing = unit(np.asarray(around @ facing))
    return facing, share
