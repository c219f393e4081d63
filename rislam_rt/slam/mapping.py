"""From particles to the estimate that others read: pose, landmarks, images, walls."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import MapEstimate, SlamEstimate, empty_map
from rislam_rt.slam.book import Book
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.filter import FilterState
from rislam_rt.slam.particles import Particles, moments
from rislam_rt.slam.returns import reflect

IMAGE_HITS = 3
"""Measurements of an image before it is shown on the map."""


def predict(state: FilterState, dt: float, config: SlamConfig) -> SlamEstimate:
    """The belief carried over `dt` [s] without noise: where the next cycle will find the agent."""
    particles = state.particles
    return estimate(
        state._replace(particles=particles._replace(position=particles.position + dt * particles.velocity)), config
    )


def estimate(state: FilterState, config: SlamConfig) -> SlamEstimate:
    """Mean and covariance of the pose, equally likely samples of it, and the map."""
    particles = state.particles
    pose = np.concatenate([particles.position, particles.velocity], axis=1)
    mean, covariance = moments(particles.log_weight, pose)
    return SlamEstimate(
        mean[:3],
        mean[3:],
        float(state.heading[state.cycle % len(state.heading)]),
        covariance,
        particles.position[_even_rows(particles.log_weight, config.num_samples)],
        state.body,
        build_map(particles, state.book),
    )


def build_map(particles: Particles, book: Book) -> MapEstimate:
    """Points, first-order images that were seen, and walls."""
    if not len(book.ident):
        return empty_map()
    count, size = len(particles.log_weight), len(book.ident)
    mean, covariance = moments(particles.log_weight, particles.features.reshape(count, -1))
    mean, covariance = mean.reshape(size, 3), covariance + particles.covariance
    points, row = book.points, {int(ident): place for place, ident in enumerate(book.ident)}
    images = book.images[book.image_hits >= IMAGE_HITS]
    places, spreads = [mean[points]], [_blocks(covariance, points)]
    for point, wall, _ in images:
        image, spread = _image(mean, covariance, book, row[int(point)], row[int(wall)])
        places.append(image[None])
        spreads.append(spread[None])
    place_of = {int(book.ident[p]): order for order, p in enumerate(points)}
    strength = np.exp(book.log_strength[0][points])
    ratio = np.exp(np.array([book.ratio[row[int(wall)]] for wall in images[:, 1]]))
    normal, offset, std = _walls(mean, covariance, book)
    return MapEstimate(
        np.concatenate([book.ident[points], images[:, 2]]),
        np.concatenate(places),
        np.concatenate(spreads),
        np.concatenate([np.full(len(points), -1), [place_of[int(p)] for p in images[:, 0]]]),
        np.concatenate([book.ris_probability[points], np.zeros(len(images))]),
        np.concatenate([strength, ratio]),
        normal,
        offset,
        std,
    )


def _walls(mean: Floats, covariance: Floats, book: Book) -> tuple[Floats, Floats, Floats]:
    """Normals (W, 3) away from the agent, offsets (W,), standard deviations (W, 2) of angle and offset at the foot."""
    rows = book.walls
    span = mean[rows] - book.anchor[rows]
    length = np.linalg.norm(span, axis=-1)
    normal = span / length[:, None]
    offset = 0.5 * np.sum(normal * (mean[rows] + book.anchor[rows]), axis=-1)
    blocks = _blocks(covariance, rows)
    along = np.einsum("wi,wij,wj->w", normal, blocks, normal)
    across = np.maximum(np.trace(blocks, axis1=1, axis2=2) - along, 0.0) / 2.0
    return normal, offset, np.stack([np.sqrt(across) / length, 0.5 * np.sqrt(np.maximum(along, 0.0))], axis=-1)


def _image(mean: Floats, covariance: Floats, book: Book, point: int, wall: int) -> tuple[Floats, Floats]:
    """Mirror image (3,) of a point in a wall, and its covariance (3, 3) from both."""
    anchor = book.anchor[wall]
    span = mean[wall] - anchor
    square = span @ span
    depth = span @ (mean[point] - 0.5 * (mean[wall] + anchor)) / square
    image = mean[point] - 2.0 * depth * span
    by_point = np.eye(3) - 2.0 * np.outer(span, span) / square
    by_wall = -2.0 * (depth * np.eye(3) + np.outer(span, image - mean[wall]) / square)
    index = np.concatenate([3 * point + np.arange(3), 3 * wall + np.arange(3)])
    jacobian = np.concatenate([by_point, by_wall], axis=1)
    return reflect(mean[point], mean[wall], anchor), jacobian @ covariance[np.ix_(index, index)] @ jacobian.T


def _blocks(covariance: Floats, rows: Integers) -> Floats:
    """Diagonal blocks (R, 3, 3) of some features."""
    return np.array([covariance[3 * r : 3 * r + 3, 3 * r : 3 * r + 3] for r in rows]).reshape(-1, 3, 3)


def _even_rows(log_weight: Floats, count: int) -> Integers:
    """Rows (count,) at even quantiles of the weights: equally likely samples without a random number."""
    edges = np.cumsum(np.exp(log_weight))
    return np.minimum(np.searchsorted(edges, (np.arange(count) + 0.5) / count * edges[-1]), len(log_weight) - 1)
