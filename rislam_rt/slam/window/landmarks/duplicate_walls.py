"""Duplicate walls: which planes of the map are one wall, or what two other walls make, by comparing one plane less."""

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.assignment import squared_distance
from rislam_rt.slam.map_geometry import wall_planes
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import AXES, by_wall, reflect
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.solver_limits import NEARBY


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
    one, tail = _log_density(gap, spread), CONSTANTS.tail
    length = np.linalg.norm(gap, axis=2)
    along = gap / np.maximum(length, 1e-9)[..., None]
    std = np.sqrt(np.vecdot(along, (spread @ along[..., None])[..., 0]))
    apart = np.log(
        np.maximum(scipy.special.stdtr(tail, (length - 2.0 * CONSTANTS.depth) / np.maximum(std, 1e-9)), 1e-12)
    )
    area = np.sqrt(square[:, None] * square)  # none where the agent stands in one of the planes
    two = apart - np.log(8.0 * np.pi * CONSTANTS.size * np.maximum(area, np.finfo(np.float64).tiny))
    return np.asarray(one - two + CONSTANTS.log_rare)


def images_of_pairs(features: Floats, covariance: Floats, landmarks: WindowTable) -> Booleans:
    """Whether each feature (F,) of the map is a wall that was born of the return over two other walls, features (F, 3)
    [m] being known within a covariance (3F, 3F) [m^2].

    It was if, from where it was born, both are nearer and throw the agent's image to where it has it. A wall of its own
    has it anywhere, as births have it; that the return over two walls is held for a wall is `rare`, and it may be over
    any two.
    """
    walls = landmarks.walls
    count, found = len(walls), np.zeros(len(features), dtype=np.bool_)
    if count < 3:
        return found
    place, anchor = features[walls], landmarks.anchor[walls]
    each = reflect(anchor[:, None], place, anchor)  # (W, W, 3): from where the first was born, in the second
    length = np.linalg.norm(each - anchor[:, None], axis=2)
    nearer = length < np.diagonal(length)[:, None]
    both = reflect(each[:, :, None], place, anchor)
    apart = np.linalg.norm(both - place[:, None, None], axis=3)
    pair = nearer[:, :, None] & nearer[:, None] & ~np.eye(count, dtype=np.bool_)
    wall, first, second = (pair & (apart < NEARBY)).nonzero()
    if not len(wall):
        return found
    span = place[second] - anchor[second]
    flip = AXES - 2.0 * span[:, :, None] * (span / np.vecdot(span, span)[:, None])[:, None, :]
    by_first, by_second = (
        by_wall(spot, place[row], anchor[row]) for spot, row in ((anchor[wall], first), (each[wall, first], second))
    )
    slopes = np.concatenate([np.tile(-AXES, (len(wall), 1, 1)), flip @ by_first, by_second], axis=2)
    rows = np.stack([wall, first, second], axis=1)
    blocks = covariance.reshape(len(features), 3, len(features), 3).swapaxes(1, 2)[walls[:, None], walls]
    spread = blocks[rows[:, :, None], rows[:, None, :]].swapaxes(2, 3).reshape(-1, 9, 9)
    reach = length[wall, wall]
    spread = slopes @ spread @ np.swapaxes(slopes, 1, 2) + 1e-8 * AXES
    one = _log_density(both[wall, first, second] - place[wall], spread)
    two = np.log((count - 1.0) * (count - 2.0)) - np.log(8.0 * np.pi * CONSTANTS.size * reach**2)
    found[walls[wall[one - two + CONSTANTS.log_rare > CONSTANTS.log_born]]] = True
    return found


def _log_density(gap: Floats, spread: Floats) -> Floats:
    """Log density of gaps (..., 3) [m] between two walls' images that are the same place within covariances
    (..., 3, 3) [m^2], with the tails of Student's t."""
    tail, (far, log_det) = CONSTANTS.tail, squared_distance(gap, spread)
    scale = scipy.special.gammaln(0.5 * (tail + 3.0)) - scipy.special.gammaln(0.5 * tail) - 1.5 * np.log(np.pi * tail)
    return np.asarray(scale - 0.5 * log_det - 0.5 * (tail + 3.0) * np.log1p(far / tail))
