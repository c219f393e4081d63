"""Planes `normal . x = offset`: mirror images and chains of them, tangents, the plane behind a virtual landmark."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, cross
from rislam_rt.geometry.angles import unit


def mirror(point: Floats, normal: Floats, offset: Floats) -> Floats:
    """Mirror images (..., 3) of points in planes with unit normals (..., 3) and offsets (...,) [m]."""
    distance = np.sum(point * normal, axis=-1) - offset
    return point - 2.0 * distance[..., None] * normal


def crossing(start: Floats, stop: Floats, own: Floats, far: Floats) -> Floats:
    """Points (..., 3) where the segments between places (..., 3) cross a plane, at signed distances (...,) from their
    ends; one of the ends where they do not cross it."""
    share = np.clip(own / np.where(np.abs(own - far) > 1e-9, own - far, 1e-9), 0.0, 1.0)
    return np.asarray(start + share[..., None] * (stop - start))


def mirror_direction(direction: Floats, normal: Floats) -> Floats:
    """Directions (..., 3) after reflection on planes with unit normals (..., 3)."""
    return direction - 2.0 * np.sum(direction * normal, axis=-1)[..., None] * normal


def signed_distance(point: Floats, normal: Floats, offset: Floats) -> Floats:
    """Signed distances (...,) [m] of points (..., 3) from planes, positive on the normal's side."""
    return np.sum(point * normal, axis=-1) - offset


def plane_between(point: Floats, image: Floats) -> tuple[Floats, Floats]:
    """The plane that mirrors `point` (..., 3) to `image` (..., 3): unit normal `image - point`, through the midpoint.

    Returns the normals (..., 3), turned so that the offsets (...,) [m] are not negative.
    """
    normal = unit(image - point)
    offset = 0.5 * np.sum((image + point) * normal, axis=-1)
    sign = np.where(offset < 0.0, -1.0, 1.0)
    return normal * sign[..., None], offset * sign


def plane_tangents(normal: Floats) -> tuple[Floats, Floats]:
    """Two orthogonal unit vectors (3,) that span the plane of a unit normal (3,)."""
    first = unit(cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))]))
    return first, cross(normal, first)


class MirrorChain(NamedTuple):
    """Mirror image of a point in D walls, one after the other, with its derivatives by the point and by the walls."""

    image: Floats
    """Mirror image (..., 3) [m] after all D walls."""
    linear: Floats
    """Derivative (3, 3) of the image with respect to the point."""
    planes: Floats
    """Derivatives (..., D, 3, 3) by wall and coordinate of the image with respect to that wall's two tilts [m/rad] and
    offset [1]."""


def mirror_chain(point: Floats, normal: Floats, offset: Floats) -> MirrorChain:
    """Mirror points (..., 3) in D planes, normals (D, 3) and offsets (D,) [m], in turn, with derivatives."""
    depth = len(offset)
    linear = np.eye(3)
    planes = np.zeros((*point.shape[:-1], depth, 3, 3))
    for d in range(depth):
        reflection = np.eye(3) - 2.0 * np.outer(normal[d], normal[d])
        planes[..., :d, :, :] = reflection @ planes[..., :d, :, :]
        distance = (point @ normal[d] - offset[d])[..., None]
        for column, tangent in enumerate(plane_tangents(normal[d])):
            planes[..., d, :, column] = -2.0 * ((point @ tangent)[..., None] * normal[d] + distance * tangent)
        planes[..., d, :, 2] = 2.0 * normal[d]
        point = mirror(point, normal[d], offset[d])
        linear = reflection @ linear
    return MirrorChain(point, linear, planes)
