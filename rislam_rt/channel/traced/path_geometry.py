"""Geometry of traced paths, leg by leg: as the tracer left it in float32, or refined in float64.

Refinement keeps the tracer's word on which walls are met and seen; the images on the walls' planes say where.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.specular_legs import NO_WALL
from rislam_rt.channel.walls import Walls
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.planes import mirror, mirror_direction, signed_distance


class PathGeometry(NamedTuple):
    """Geometry of N traced legs: bounce points, length, and directions at both ends."""

    vertices: Floats
    """(N, D, 3) [m] bounce points from device to far end, zero beyond the last."""
    length: Floats
    """(N,) unfolded [m]."""
    at_device: Floats
    """(N, 3) unit vectors from the device along the leg."""
    at_far_end: Floats
    """(N, 3) unit vectors from the far end along the leg."""


def refined_geometry(walls: Walls, sequences: Integers, device: Floats, far: Floats) -> PathGeometry:
    """Geometry of traced legs from devices to far ends (N, 3) [m] over wall sequences (N, D), refined in float64 on the
    planes.

    The far end is mirrored in the walls from its own end on; the straight line from the device to the last image meets
    the first wall, the one from there to the image before meets the second, and so on.
    """
    real = sequences != NO_WALL
    normal, offset = walls.normal[sequences], walls.offset[sequences]
    images = [far]
    for bounce in reversed(range(sequences.shape[1])):
        image = mirror(images[0], normal[:, bounce], offset[:, bounce])
        images.insert(0, np.where(real[:, bounce, None], image, images[0]))
    at_device = unit(images[0] - device)
    vertices = np.zeros((*sequences.shape, 3))
    point, direction = device, at_device
    for bounce, image in enumerate(images[:-1]):
        here = signed_distance(point, normal[:, bounce], offset[:, bounce])
        span = here - signed_distance(image, normal[:, bounce], offset[:, bounce])
        fraction = np.where(span != 0.0, here / np.where(span != 0.0, span, 1.0), 0.0)
        is_real = real[:, bounce, None]
        point = np.where(is_real, point + fraction[:, None] * (image - point), point)
        direction = np.where(is_real, mirror_direction(direction, normal[:, bounce]), direction)
        vertices[:, bounce] = np.where(is_real, point, 0.0)
    return PathGeometry(vertices, np.linalg.norm(images[0] - device, axis=-1), at_device, -direction)


def segment_directions(walls: Walls, sequences: Integers, at_device: Floats) -> Floats:
    """Unit vectors (N, D + 1, 3) along each segment of traced legs that begin along (N, 3), the last repeated."""
    travel = [at_device]
    for wall in sequences.T:
        travel.append(
            np.where((wall != NO_WALL)[:, None], mirror_direction(travel[-1], walls.normal[wall]), travel[-1])
        )
    return np.stack(travel, axis=1)


def traced_geometry(sequences: Integers, device: Floats, far: Floats, vertices: Floats) -> PathGeometry:
    """Geometry of legs over the bounce points (N, D, 3) [m] that the tracer found."""
    points = polyline(sequences, device, far, vertices)
    bounces = (sequences != NO_WALL).sum(axis=1)
    length = np.linalg.norm(np.diff(points, axis=1), axis=-1).sum(axis=1)
    before_last = points[np.arange(len(points)), bounces]
    return PathGeometry(vertices, length, unit(points[:, 1] - device), unit(before_last - far))


def polyline(sequences: Integers, device: Floats, far: Floats, vertices: Floats) -> Floats:
    """Vertices (N, D + 2, 3) [m] of traced legs: device, bounce points and far end, repeated where bounces are
    fewer."""
    inner = np.where((sequences != NO_WALL)[..., None], vertices, far[:, None])
    return np.concatenate([device[:, None], inner, far[:, None]], axis=1)
