"""Mirror images over several walls, one after the other, with their derivatives by point and planes."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.planes import mirror, plane_tangents


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
