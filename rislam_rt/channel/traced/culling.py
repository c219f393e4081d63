"""Culling of candidates before they are traced: kept are those whose bounces on the walls' planes come near the walls.

A lossless test in front of the tracer. In a furnished room one candidate in a hundred survives it, and tracing costs
twenty times as much as culling.
"""

from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.specular_legs import NO_WALL
from rislam_rt.channel.traced.tracer_scene import TracerScene, as_indices, as_points

_NO_WALL = NO_WALL % 2**32

BLOCK = 4_000_000
"""Candidates tested at once: bounds the memory."""


def cull_candidates(
    tracer_scene: TracerScene, sequences: Integers, device: Floats, far: Floats
) -> Iterator[tuple[Integers, Integers]]:
    """Yield, in blocks, the pairs of devices (N, 3) [m] and wall sequences (S, D) that survive culling.

    Far ends (N, 3) go with their devices, a single one (1, 3) with all.
    """
    count = len(device)
    if count == 0:
        yield np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        return
    ends = as_points(device - tracer_scene.origin), as_points(far - tracer_scene.origin)
    step = max(1, BLOCK // count)
    for first in range(0, len(sequences), step):
        part = sequences[first : first + step]
        index = dr.arange(mi.UInt, count * len(part))
        column = index // dr.opaque(mi.UInt, count)
        row = index - column * dr.opaque(mi.UInt, count)
        device_point = dr.gather(mi.Point3f, ends[0], row)
        far_point = dr.gather(mi.Point3f, ends[1], row if len(far) > 1 else dr.zeros(mi.UInt, 1))
        walls = [dr.gather(mi.UInt, as_indices(wall), column) for wall in part.T]
        kept = np.array(dr.compress(_near_walls(tracer_scene, walls, device_point, far_point)), dtype=np.int64)
        yield kept % count, kept // count + first


def _near_walls(tracer_scene: TracerScene, walls: list[mi.UInt], device: mi.Point3f, far: mi.Point3f) -> mi.Bool:
    """Whether each candidate survives culling: its mirror path over `walls` bounces on or near every one of them."""
    # The margin is a thousandth of the room: hundreds of times what float32 leaves uncertain. Where both ends of a
    # bounce are that near the plane the bounce may be anywhere along, and stays.
    wall_boxes, margin = tracer_scene.wall_boxes, tracer_scene.wall_boxes.margin
    real = [wall != _NO_WALL for wall in walls]
    normal = [dr.gather(mi.Vector3f, wall_boxes.normal, wall, here) for wall, here in zip(walls, real, strict=True)]
    offset = [dr.gather(mi.Float, wall_boxes.offset, wall, here) for wall, here in zip(walls, real, strict=True)]
    images: list[Any] = [far]
    for n, o, here in zip(normal[::-1], offset[::-1], real[::-1], strict=True):
        images.insert(0, dr.select(here, images[0] - 2.0 * (dr.dot(n, images[0]) - o) * n, images[0]))
    point: Any = device
    keep = dr.full(mi.Bool, True, dr.width(device))
    for wall, n, o, image, here in zip(walls, normal, offset, images, real, strict=False):
        a, b = dr.dot(n, point) - o, dr.dot(n, image) - o
        fraction = dr.clip(dr.select(a != b, a / (a - b), 0.5), 0.0, 1.0)
        hit = point + fraction * (image - point)
        away = dr.abs(hit - dr.gather(mi.Point3f, wall_boxes.center, wall, here))
        inside = dr.all(away <= dr.gather(mi.Vector3f, wall_boxes.half, wall, here) + mi.Vector3f(margin))
        along = dr.maximum(dr.abs(a), dr.abs(b)) < margin
        crosses = (a * b < 0.0) | (dr.minimum(dr.abs(a), dr.abs(b)) < margin)
        keep &= ~here | (crosses & inside) | along
        point = dr.select(here, hit, point)
    return keep
