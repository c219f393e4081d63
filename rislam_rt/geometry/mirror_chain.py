"""Mirror images over several walls, one after the other, with their derivatives by point and planes."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.planes import mirror, plane_tangents


class MirrorChain(NamedTuple):
    """A point mirrored in D walls, one after the other."""

    image: Floats
    """(..., 3) [m]."""
    linear: Floats
    """(3, 3) derivative of the image with respect to the point."""
    planes: Floats
    """(..., D, 3, 3): wall, coordinate, and two tilts [1/rad] and the offset [1] of that wall."""


def mirror_chain(point: Floats, normal: Floats, offset: Floats) -> MirrorChain:
    """Mirror points (..., 3) in planes (D, 3), (D,) in turn, with derivatives by the chain rule."""
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
