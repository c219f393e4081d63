"""Duplicate walls: which planes of the map are one wall, by comparing one plane with two."""

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.assignment import squared_distance
from rislam_rt.slam.map_geometry import wall_planes
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import AXES, by_wall, reflect
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable


def second_planes(
    features: Floats, covariance: Floats, landmarks: WindowTable, walls: Integers, middle: Floats
) -> Booleans:  # fmt: skip
    """Whether walls of the map, rows (W,), are duplicates of another of them, features (F, 3) [m] being known within a
    covariance (3F, 3F) [m^2], and the agent at `middle` (3,) [m].

    Of the planes of one wall, the first is that whose expected square of lean, off upright or level, is least: what
    level returns do not tell goes wrong first.
    """
    second = np.zeros(len(walls), dtype=np.bool_)
    if len(walls) < 2:
        return second
    blocks = covariance.reshape(len(features), 3, len(features), 3).swapaxes(1, 2)[walls[:, None], walls]
    same = same_wall(features[walls], blocks, landmarks.anchor[walls], middle) > CONSTANTS.log_born
    normal, _, std = wall_planes(features, covariance, landmarks.anchor, walls)
    lean = np.minimum(np.abs(normal[:, 2]), np.hypot(normal[:, 0], normal[:, 1]))
    order = np.argsort(lean**2 + std[:, 0] ** 2, kind="stable").tolist()
    for place, wall in enumerate(order):
        second[wall] = any(same[wall, other] and not second[other] for other in order[:place])
    return second


def same_wall(place: Floats, blocks: Floats, anchor: Floats, middle: Floats) -> Floats:
    """Log odds (W, W) that two walls are one: images `place` (W, 3) [m] of anchors (W, 3) [m], with covariances
    `blocks` (W, W, 3, 3) [m^2] among them; the diagonal means nothing.

    Compared is where they mirror the agent at `middle` (3,) [m]. Of one wall the images differ by their covariance and
    by what a wall leans, with the tails of Student's t. Another wall is anywhere as births have it, but not within
    `depth` of the first, where one would hide the other; that the map holds one wall twice is `rare`.
    """
    slope = by_wall(middle, place, anchor)
    wide = slope[:, None] @ blocks @ np.swapaxes(slope, 1, 2)
    span = reflect(np.broadcast_to(middle, place.shape), place, anchor) - middle
    gap, square = span[:, None] - span, np.vecdot(span, span)
    across = square[:, None, None] * AXES - span[:, :, None] * span[:, None, :]
    own = np.diagonal(wide, axis1=0, axis2=1).transpose(2, 0, 1) + CONSTANTS.lean**2 * across
    spread = own[:, None] + own - wide - np.swapaxes(wide, 2, 3) + 1e-8 * AXES
    one, tail = log_same_place(gap, spread), CONSTANTS.tail
    length = np.linalg.norm(gap, axis=2)
    along = gap / np.maximum(length, 1e-9)[..., None]
    std = np.sqrt(np.vecdot(along, (spread @ along[..., None])[..., 0]))
    apart = np.log(
        np.maximum(scipy.special.stdtr(tail, (length - 2.0 * CONSTANTS.depth) / np.maximum(std, 1e-9)), 1e-12)
    )
    area = np.sqrt(square[:, None] * square)  # none where the agent stands in one of the planes
    two = apart - np.log(8.0 * np.pi * CONSTANTS.size * np.maximum(area, np.finfo(np.float64).tiny))
    return np.asarray(one - two + CONSTANTS.log_rare)


def log_same_place(gap: Floats, spread: Floats) -> Floats:
    """Log density of gaps (..., 3) [m] between two walls' images that are the same place within covariances
    (..., 3, 3) [m^2], with the tails of Student's t."""
    tail, (far, log_det) = CONSTANTS.tail, squared_distance(gap, spread)
    scale = scipy.special.gammaln(0.5 * (tail + 3.0)) - scipy.special.gammaln(0.5 * tail) - 1.5 * np.log(np.pi * tail)
    return np.asarray(scale - 0.5 * log_det - 0.5 * (tail + 3.0) * np.log1p(far / tail))
