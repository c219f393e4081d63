"""Traced legs in float64: the tracer says which walls are met and seen, the images on their planes say where."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.traced.rows import Found
from rislam_rt.channel.traced.sequences import NO_WALL
from rislam_rt.channel.walls import Walls
from rislam_rt.geometry.angles import unit
from rislam_rt.geometry.planes import mirror, mirror_direction, signed_distance


class Course(NamedTuple):
    """Where N legs run."""

    vertices: Floats
    """(N, D, 3) [m] bounce points from device to far end, zero beyond the last."""
    length: Floats
    """(N,) unfolded [m]."""
    at_device: Floats
    """(N, 3) unit vectors from the device along the leg."""
    at_far_end: Floats
    """(N, 3) unit vectors from the far end along the leg."""


def refined_course(walls: Walls, sequences: Integers, device: Floats, far: Floats) -> Course:
    """Legs between devices and far ends (N, 3) [m] over `sequences` (N, D), exact on the walls' planes.

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
        here_real = real[:, bounce, None]
        point = np.where(here_real, point + fraction[:, None] * (image - point), point)
        direction = np.where(here_real, mirror_direction(direction, normal[:, bounce]), direction)
        vertices[:, bounce] = np.where(here_real, point, 0.0)
    return Course(vertices, np.linalg.norm(images[0] - device, axis=-1), at_device, -direction)


def traced_course(sequences: Integers, device: Floats, far: Floats, found: Found) -> Course:
    """The same legs as the tracer left them."""
    bounces = (sequences != NO_WALL).sum(axis=1)
    row = np.arange(len(sequences))
    points = np.concatenate([found.vertices, np.zeros((len(row), 1, 3))], axis=1)
    points[row, bounces] = far
    last = np.where(bounces[:, None] > 0, points[row, np.maximum(bounces - 1, 0)], device)
    return Course(found.vertices, found.length, unit(points[:, 0] - device), unit(last - far))
