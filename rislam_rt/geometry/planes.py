"""Planes `normal . x = offset`: mirror images, tangents, and the plane behind a virtual landmark."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import unit


def mirror(point: Floats, normal: Floats, offset: Floats) -> Floats:
    """Mirror images (..., 3) of points in planes with unit normals (..., 3) and offsets (...,) [m]."""
    distance = np.sum(point * normal, axis=-1) - offset
    return point - 2.0 * distance[..., None] * normal


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
    first = unit(np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))]))
    return first, np.cross(normal, first)
