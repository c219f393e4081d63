"""From the window's belief to the estimate that others read."""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import MapEstimate, SlamEstimate, empty_map
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.mapping import MAX_LEAN, images_in, wall_planes
from rislam_rt.slam.moments import even_draws, poses_of, square_root
from rislam_rt.slam.window import gauss
from rislam_rt.slam.window.book import Book, image_ident
from rislam_rt.slam.window.filter import WindowState
from rislam_rt.slam.window.gauss import HEAD
from rislam_rt.slam.window.suspect import find_suspect


def predict(state: WindowState, dt: float, config: SlamConfig) -> SlamEstimate:
    """The belief carried over `dt` [s] without noise, to where the next cycle finds the agent; with the suspect."""
    ahead = estimate(state, config, dt)
    if state.scene.ris is None or ahead.map.ris >= 0:
        return ahead
    mean, _ = gauss.now(state.window)
    poses = poses_of(mean[:3], np.asarray(state.heading[-1] + mean[6]), state.scene.body)
    suspect = find_suspect(state.tracks, state.book, mean, state.cycle - 1, poses)
    return replace(ahead, suspects=() if suspect is None else (suspect,))


def estimate(state: WindowState, config: SlamConfig, ahead: float = 0.0) -> SlamEstimate:
    """Mean and covariance of the pose, equally likely samples of it, and the map."""
    mean, covariance = gauss.now(state.window)
    spread = covariance.copy()
    spread[:3, :3] += np.diag(state.shift**2)
    position = mean[:3] + ahead * mean[3:6]
    root = square_root(spread[:3, :3])
    return SlamEstimate(
        position,
        mean[3:6],
        float(state.heading[-1] + mean[6]),
        spread[:6, :6],
        position + even_draws(config.num_samples, root.shape[1]) @ root.T,
        state.scene.body,
        build_map(mean[HEAD:].reshape(-1, 3), covariance[HEAD:, HEAD:], state.book, state.shift),
    )


def build_map(features: Floats, covariance: Floats, book: Book, shift: Floats) -> MapEstimate:
    """Points, their images in each wall, and the walls; the start's error moves all of it together."""
    if not len(book.ident):
        return empty_map()
    covariance = covariance + np.tile(np.diag(shift**2), (len(features), len(features)))
    points, walls = book.points, book.walls
    parent, wall = np.repeat(points, len(walls)), np.tile(walls, len(points))
    place, spread = images_in(features, covariance, book.anchor, parent, wall)
    columns = 3 * points[:, None] + np.arange(3)
    normal, offset, std = wall_planes(features, covariance, book.anchor, walls)
    known = np.sqrt(2.0) * std[:, 0] < MAX_LEAN
    strength, ratio = np.exp(book.log_strength[0][points]), np.exp(book.ratio[wall])
    return MapEstimate(
        np.concatenate([book.ident[points], image_ident(book.ident[parent], book.ident[wall])]),
        np.concatenate([features[points], place]),
        np.concatenate([covariance[columns[:, :, None], columns[:, None, :]], spread]),
        np.concatenate([np.full(len(points), -1), np.searchsorted(points, parent)]),
        np.concatenate([book.ris_probability[points], np.zeros(len(place))]),
        np.concatenate([strength, ratio]),
        normal[known],
        offset[known],
        std[known],
    )
