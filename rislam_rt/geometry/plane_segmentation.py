"""Plane segmentation of a triangle mesh: which triangles lie in one plane, and the plane that fits their corners."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, cross
from rislam_rt.geometry.triangles import triangle_heights, triangle_planes

FLOAT32_ROUNDING = 2.0**-24
"""Largest relative error of a coordinate held in float32, as mesh files hold them."""

EXACT = 16.0 * 2.0**-52
"""Distance from a plane, relative to the corners' coordinates, within which it is exact: a fit would add rounding."""

_GENERIC = np.array([0.36, 0.48, 0.80])
"""A unit vector in no special direction, along which normals are sorted."""


class PlanarRegions(NamedTuple):
    """Segmentation of T triangles into G planes, numbered in the order of first appearance."""

    group: Integers
    """Number (T,) of each triangle's plane."""
    normal: Floats
    """Unit normals (G, 3) of the planes, on the side of the group's first triangle."""
    offset: Floats
    """Offsets (G,) [m] of the planes along their normals."""


class _Mesh(NamedTuple):
    """Mesh of T triangles, sorted by the component of their normals along `_GENERIC`, sign dropped."""

    triangles: Floats
    normal: Floats
    key: Floats
    slack: Floats
    """Angle (T,) [rad] by which a triangle's normal may differ from that of its plane."""

    def in_plane(self, normal: Floats, distance: float, turn: float, offset: float) -> Integers:
        """Rows of the triangles in a plane: normals within `slack + turn`, all corners within `offset` [m]."""
        here, widest = abs(float(_GENERIC @ normal)), float(self.slack.max()) + turn
        low, high = np.searchsorted(self.key, [here - widest, here + widest])
        angle = np.linalg.norm(cross(self.normal[low:high], normal), axis=-1)
        rows = low + np.flatnonzero(angle <= self.slack[low:high] + turn)
        return rows[np.abs(self.triangles[rows] @ normal - distance).max(axis=1, initial=0.0) <= offset]


def planar_regions(triangles: Floats, angle: float, offset: float) -> PlanarRegions:
    """Segment a triangle mesh (T, 3, 3) into planes, each fitted to all the corners of its triangles.

    A triangle belongs to a plane when its normal agrees up to sign within `angle` [rad], and what float32 corners do to
    the normal of so small a triangle besides, and when all its corners lie within `offset` [m]. Planes grow from the
    triangle whose normal is surest, fitted anew to whatever they gain.
    """
    if len(triangles) == 0:
        return PlanarRegions(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros(0))
    order, mesh = _sorted_mesh(triangles, angle)
    group = np.full(len(triangles), -1, dtype=np.int64)
    for seed in np.argsort(mesh.slack, kind="stable"):  # the surest normal first
        if group[seed] < 0:
            group[_grown(mesh, int(seed), group < 0, angle, offset)] = group.max() + 1
    unsorted = np.empty_like(group)
    unsorted[order] = group
    _, first, number = np.unique(unsorted, return_index=True, return_inverse=True)
    place = np.argsort(np.argsort(first))
    return _fitted(triangles, place[number.ravel()])


def fit_plane(points: Floats, side: Floats) -> tuple[Floats, float]:
    """Unit normal (3,) and offset [m] of the plane with the least squared distances to points (N, 3).

    The normal points to the side of `side` (3,). Total least squares: the singular vector of the smallest value.
    """
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][-1]
    normal = np.copysign(1.0, normal @ side) * normal
    return normal, float(normal @ middle)


def _sorted_mesh(triangles: Floats, angle: float) -> tuple[Integers, _Mesh]:
    """Order (T,) of a mesh's triangles by their normals along `_GENERIC`, and the mesh in that order."""
    normal, _ = triangle_planes(triangles)
    key = np.abs(normal @ _GENERIC)
    order = np.argsort(key, kind="stable")
    altitude = triangle_heights(triangles)
    rounding = FLOAT32_ROUNDING * float(np.abs(triangles).max())
    slack = angle + np.minimum(2.0 * rounding / np.maximum(altitude, 2.0 * rounding), 1.0)
    return order, _Mesh(triangles[order], normal[order], key[order], slack[order])


def _grown(mesh: _Mesh, seed: int, free: Booleans, angle: float, offset: float) -> Integers:
    """Rows of the free triangles that lie in the plane grown from a seed triangle."""
    normal = mesh.normal[seed]
    distance, turn = float(normal @ mesh.triangles[seed].mean(axis=0)), float(mesh.slack[seed]) - angle
    members = np.array([seed])
    while True:
        found = mesh.in_plane(normal, distance, turn, offset)
        found = found[free[found]]
        if seed not in found:
            found = np.sort(np.append(found, seed))
        if len(found) <= len(members):
            return members if len(found) < len(members) else found
        members, turn = found, 0.0
        normal, distance = fit_plane(mesh.triangles[members].reshape(-1, 3), normal)


def _fitted(triangles: Floats, group: Integers) -> PlanarRegions:
    """Planes of groups (T,) of triangles: that of the first where it is exact, else fitted to all corners."""
    normal, offset = triangle_planes(triangles)
    _, first = np.unique(group, return_index=True)
    normal, offset = normal[first], offset[first]
    residual = np.abs(np.einsum("tci,ti->tc", triangles, normal[group]) - offset[group][:, None]).max(axis=1)
    worst = np.zeros(len(first))
    np.maximum.at(worst, group, residual)
    members = np.argsort(group, kind="stable")
    ends = np.searchsorted(group[members], np.arange(len(first) + 1))
    for number in np.flatnonzero(worst > EXACT * float(np.abs(triangles).max())):
        corners = triangles[members[ends[number] : ends[number + 1]]].reshape(-1, 3)
        normal[number], offset[number] = fit_plane(corners, normal[number])
    return PlanarRegions(group, normal, offset)
