"""Geometry of the estimated map: its walls as planes, and mirror images of its points in them, with covariances."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.predicted_returns import AXES, by_wall, reflect

MAX_LEAN = np.radians(1.0)
"""Largest RMS angle [rad] between a wall's normal and its mean at which the wall is shown on the map: beyond it the
belief does not know how the wall stands."""


def wall_planes(mean: Floats, covariance: Floats, anchor: Floats, rows: Integers) -> tuple[Floats, Floats, Floats]:
    """Planes of the estimated map's walls: normals (W, 3) away from the agent, offsets (W,) [m], deviations (W, 2) of
    angle [rad] and offset [m]."""
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
    """Mirror images (Q, 3) [m] of the map's points in its walls, and covariances (Q, 3, 3) from the errors of both."""
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
    """Covariances (R, 3, 3) of some of the map's features: diagonal blocks of the joint covariance (3F, 3F)."""
    columns = 3 * rows[:, None] + np.arange(3)
    return covariance[columns[:, :, None], columns[:, None, :]]
