"""Walls as planes and the images of points in them, with their uncertainty, from the features of a map."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.returns import AXES, by_wall, reflect

MAX_LEAN = np.radians(1.0)
"""RMS angle [rad] between a wall's normal and its mean above which the belief does not know how the wall stands, and it
is not shown on the map."""


def wall_planes(mean: Floats, covariance: Floats, anchor: Floats, rows: Integers) -> tuple[Floats, Floats, Floats]:
    """Normals (W, 3) away from the agent, offsets (W,), standard deviations (W, 2) of angle and offset at the foot."""
    span = mean[rows] - anchor[rows]
    length = np.sqrt(np.vecdot(span, span))
    normal = span / length[:, None]
    offset = 0.5 * np.vecdot(normal, mean[rows] + anchor[rows])
    blocks = diagonal_blocks(covariance, rows)
    along = np.vecdot(normal, (blocks @ normal[..., None])[..., 0])
    across = np.maximum(np.trace(blocks, axis1=1, axis2=2) - along, 0.0) / 2.0
    return normal, offset, np.stack([np.sqrt(across) / length, 0.5 * np.sqrt(np.maximum(along, 0.0))], axis=-1)


def images_in(
    mean: Floats, covariance: Floats, anchors: Floats, points: Integers, walls: Integers
) -> tuple[Floats, Floats]:
    """Mirror images (Q, 3) of points in walls, and their covariances (Q, 3, 3) from both."""
    if not len(points):
        return np.zeros((0, 3)), np.zeros((0, 3, 3))
    point, wall, anchor = mean[points], mean[walls], anchors[walls]
    span = wall - anchor
    square = np.vecdot(span, span)[:, None, None]
    by_point = AXES - 2.0 * span[:, :, None] * span[:, None, :] / square
    axes = np.arange(3)
    index = np.concatenate([3 * points[:, None] + axes, 3 * walls[:, None] + axes], axis=1)
    jacobian = np.concatenate([by_point, by_wall(point, wall, anchor)], axis=2)
    inner = covariance[index[:, :, None], index[:, None, :]]
    spread = jacobian @ inner @ np.swapaxes(jacobian, 1, 2)
    return reflect(point, wall, anchor), 0.5 * (spread + np.swapaxes(spread, 1, 2))


def diagonal_blocks(covariance: Floats, rows: Integers) -> Floats:
    """Diagonal blocks (R, 3, 3) of some of the map's features."""
    columns = 3 * rows[:, None] + np.arange(3)
    return covariance[columns[:, :, None], columns[:, None, :]]
