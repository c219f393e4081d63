"""From moments to the estimate that others read: pose, landmarks, images, walls."""

from dataclasses import replace
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import MapEstimate, SlamEstimate, empty_map
from rislam_rt.slam.book import RATIO_SPREAD, Book
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.filter import FilterState, believed
from rislam_rt.slam.moments import POSE, Moments, even_draws, square_root
from rislam_rt.slam.returns import AXES, reflect
from rislam_rt.slam.suspect import find_suspect

IMAGE_HITS = 3
"""Measurements of an image before it is shown on the map."""
WALL_HITS = 40
"""The same for a wall."""
MAX_LEAN = np.radians(1.0)
"""RMS angle [rad] between a wall's normal and its mean above which the belief does not know how the wall stands, and it
is not shown on the map."""


def predict(state: FilterState, dt: float, config: SlamConfig) -> SlamEstimate:
    """The belief carried over `dt` [s] without noise, to where the next cycle finds the agent; with the suspect."""
    moments = believed(state)
    mean = moments.mean.copy()
    mean[:3] += dt * moments.velocity
    moments = moments._replace(mean=mean)
    ahead = estimate(state, config, moments)
    if state.ris is None:
        return ahead
    unknown = [panel for panel, row in enumerate(state.book.holders) if row < 0]
    found = [find_suspect(state.tracks, state.book, moments, state.body, panel) for panel in unknown]
    return replace(ahead, suspects=tuple(suspect for suspect in found if suspect is not None))


def estimate(state: FilterState, config: SlamConfig, moments: Moments | None = None) -> SlamEstimate:
    """Mean and covariance of the pose, equally likely samples of it, and the map."""
    moments = believed(state) if moments is None else moments
    root = square_root(moments.covariance[:3, :3])
    return SlamEstimate(
        moments.position,
        moments.velocity,
        moments.heading,
        moments.covariance[:6, :6],
        moments.position + even_draws(config.num_samples, root.shape[1]) @ root.T,
        state.body,
        build_map(moments, state.book),
    )


def build_map(moments: Moments, book: Book) -> MapEstimate:
    """Points, first-order images that were seen, and walls that are known.

    Ghosts, such as a corner's image taken for that of one slanted wall, seldom throw a return of their own: a wall is
    shown once it was measured `WALL_HITS` times, its reflection by itself (`Book.ratio`), and its normal is known to
    `MAX_LEAN`.
    """
    if not len(book.ident):
        return empty_map()
    mean, covariance = moments.features, moments.covariance[POSE:, POSE:]
    points, images = book.points, book.images[book.image_hits >= IMAGE_HITS]
    # idents only grow, and rows keep their order
    parent, wall = np.searchsorted(book.ident, images[:, :2].T)
    image, spread = images_in(mean, covariance, book.anchor, parent, wall)
    strength, ratio = np.exp(book.log_strength[0][points]), np.exp(book.ratio[wall])
    normal, offset, std = wall_planes(mean, covariance, book.anchor, book.walls)
    known = (book.ratio_variance[book.walls] < RATIO_SPREAD**2) & (book.hits[book.walls] >= WALL_HITS)
    known &= np.sqrt(2.0) * std[:, 0] < MAX_LEAN
    probability = book.ris_probability[points]
    named = None if probability.shape[1] == 1 else _padded(np.argmax(probability, axis=1), len(images))
    return MapEstimate(
        np.concatenate([book.ident[points], images[:, 2]]),
        np.concatenate([mean[points], image]),
        np.concatenate([_blocks(covariance, points), spread]),
        np.concatenate([np.full(len(points), -1), np.searchsorted(points, parent)]),
        _padded(probability.max(axis=1), len(images)),
        np.concatenate([strength, ratio]),
        normal[known],
        offset[known],
        std[known],
        named,
    )


def _padded(values: Any, count: int) -> Any:
    """Values (P,) of points, then a 0 for each of `count` images."""
    return np.concatenate([values, np.zeros(count, dtype=values.dtype)])


def wall_planes(mean: Floats, covariance: Floats, anchor: Floats, rows: Integers) -> tuple[Floats, Floats, Floats]:
    """Normals (W, 3) away from the agent, offsets (W,), standard deviations (W, 2) of angle and offset at the foot."""
    span = mean[rows] - anchor[rows]
    length = np.sqrt(np.vecdot(span, span))
    normal = span / length[:, None]
    offset = 0.5 * np.vecdot(normal, mean[rows] + anchor[rows])
    blocks = _blocks(covariance, rows)
    along = np.vecdot(normal, (blocks @ normal[..., None])[..., 0])
    across = np.maximum(np.trace(blocks, axis1=1, axis2=2) - along, 0.0) / 2.0
    return normal, offset, np.stack([np.sqrt(across) / length, 0.5 * np.sqrt(np.maximum(along, 0.0))], axis=-1)


def images_in(
    mean: Floats, covariance: Floats, anchors: Floats, points: Integers, walls: Integers
) -> tuple[Floats, Floats]:
    """Mirror images (Q, 3) of points in walls, and their covariances (Q, 3, 3) from both."""
    point, wall, anchor = mean[points], mean[walls], anchors[walls]
    span = wall - anchor
    square = np.vecdot(span, span)[:, None, None]
    image = reflect(point, wall, anchor)
    depth = np.vecdot(span, point - 0.5 * (wall + anchor))[:, None, None] / square
    by_point = AXES - 2.0 * span[:, :, None] * span[:, None, :] / square
    by_wall = -2.0 * (depth * AXES + span[:, :, None] * (image - wall)[:, None, :] / square)
    axes = np.arange(3)
    index = np.concatenate([3 * points[:, None] + axes, 3 * walls[:, None] + axes], axis=1)
    jacobian = np.concatenate([by_point, by_wall], axis=2)
    inner = covariance[index[:, :, None], index[:, None, :]]
    return image, jacobian @ inner @ np.swapaxes(jacobian, 1, 2)


def _blocks(covariance: Floats, rows: Integers) -> Floats:
    """Diagonal blocks (R, 3, 3) of some features."""
    columns = 3 * rows[:, None] + np.arange(3)
    return covariance[columns[:, :, None], columns[:, None, :]]
