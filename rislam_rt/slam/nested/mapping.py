"""The map and pose that others read, from moments: landmarks, images, walls."""

from dataclasses import replace
from typing import Any

import numpy as np

from rislam_rt.model import MapEstimate, SlamEstimate, empty_map
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.map_geometry import MAX_LEAN, diagonal_blocks, images_in, wall_planes
from rislam_rt.slam.moments import even_draws, square_root
from rislam_rt.slam.nested.belief_moments import POSE, Moments
from rislam_rt.slam.nested.filter import NestedState, believed
from rislam_rt.slam.nested.landmark_table import RATIO_SPREAD, LandmarkTable
from rislam_rt.slam.nested.panel_candidate import find_panel_candidate

IMAGE_HITS = 3
"""Measurements of an image before it is shown on the map."""
WALL_HITS = 40
"""The same for a wall."""


def predict(state: NestedState, dt: float, config: SlamConfig) -> SlamEstimate:
    """Belief and map carried over `dt` [s] without noise, to where the next cycle finds the agent; with the suspect."""
    moments = believed(state)
    mean = moments.mean.copy()
    mean[:3] += dt * moments.velocity
    moments = moments._replace(mean=mean)
    ahead = estimate(state, config, moments)
    if state.ris is None:
        return ahead
    unknown = [panel for panel, row in enumerate(state.table.holders) if row < 0]
    found = [find_panel_candidate(state.tracks, state.table, moments, state.body, panel) for panel in unknown]
    return replace(ahead, suspects=tuple(suspect for suspect in found if suspect is not None))


def estimate(state: NestedState, config: SlamConfig, moments: Moments | None = None) -> SlamEstimate:
    """Estimated map, with mean and covariance of the pose and equally likely samples of it."""
    moments = believed(state) if moments is None else moments
    root = square_root(moments.covariance[:3, :3])
    return SlamEstimate(
        moments.position,
        moments.velocity,
        moments.heading,
        moments.covariance[:6, :6],
        moments.position + even_draws(config.num_samples, root.shape[1]) @ root.T,
        state.body,
        build_map(moments, state.table),
    )


def build_map(moments: Moments, table: LandmarkTable) -> MapEstimate:
    """Map of points, first-order images that were seen, and walls that are known.

    Ghosts, such as a corner's image taken for that of one slanted wall, seldom throw a return of their own: a wall is
    shown once it was measured `WALL_HITS` times, its reflection by itself (`LandmarkTable.ratio`), and its normal is
    known to `MAX_LEAN`.
    """
    if not len(table.ident):
        return empty_map()
    mean, covariance = moments.features, moments.covariance[POSE:, POSE:]
    points, images = table.points, table.images[table.image_hits >= IMAGE_HITS]
    # idents only grow, and rows keep their order
    parent, wall = np.searchsorted(table.ident, images[:, :2].T)
    image, spread = images_in(mean, covariance, table.anchor, parent, wall)
    strength, ratio = np.exp(table.log_strength[0][points]), np.exp(table.ratio[wall])
    normal, offset, std = wall_planes(mean, covariance, table.anchor, table.walls)
    known = (table.ratio_variance[table.walls] < RATIO_SPREAD**2) & (table.hits[table.walls] >= WALL_HITS)
    known &= np.sqrt(2.0) * std[:, 0] < MAX_LEAN
    probability = table.ris_probability[points]
    named = None if probability.shape[1] == 1 else _padded(np.argmax(probability, axis=1), len(images))
    return MapEstimate(
        np.concatenate([table.ident[points], images[:, 2]]),
        np.concatenate([mean[points], image]),
        np.concatenate([diagonal_blocks(covariance, points), spread]),
        np.concatenate([np.full(len(points), -1), np.searchsorted(points, parent)]),
        _padded(probability.max(axis=1), len(images)),
        np.concatenate([strength, ratio]),
        normal[known],
        offset[known],
        std[known],
        named,
    )


def _padded(values: Any, count: int) -> Any:
    """Values (P,) of the map's points, then a 0 for each of `count` images."""
    return np.concatenate([values, np.zeros(count, dtype=values.dtype)])
