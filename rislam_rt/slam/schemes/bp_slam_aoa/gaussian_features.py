"""Potential features as Gaussian sums given the agent's course, and the returns that they predict.

Places are relative to the start: nothing that is measured tells where that was. A wall is the mirror image of the start
in it, a point its place; a *wanderer* is a point that walks at random, which is what a path over several walls, or over
walls and a point, looks like. Every Gaussian also holds by how much its amplitude exceeds the law of its kind.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory, Step
from rislam_rt.slam.schemes.shared.bistatic_ranges import length_of

WALL, POINT, WANDERER = 0, 1, 2
"""Kinds of feature."""
NUDGE = 1e-5
"""Step of central differences [m]."""
NEAREST = 1e-3
"""Shortest distance that is reckoned with [m]."""
AMPLITUDE_WALK = 0.02
"""Random walk of a feature's log amplitude in one step."""


class Ends(NamedTuple):
    """Where Tx and Rx are on the agent, and how it stands."""

    tx: Floats
    """(3,) [m] from the agent's position, room axes."""
    rx: Floats
    """(3,)."""
    rotation: Floats
    """(3, 3) from body to room axes."""
    upper: bool
    """Whether the array hears the upper half space alone."""


class GaussianFeatures(NamedTuple):
    """C Gaussians of K potential features, those of one feature side by side; the course has n numbers."""

    existence: Floats
    """(K,)."""
    ident: Integers
    """(K,) number for life."""
    owner: Integers
    """(C,) row of the feature, ascending."""
    kind: Integers
    """(C,) WALL, POINT or WANDERER."""
    share: Floats
    """(C,) shares of one feature sum to one."""
    mean: Floats
    """(C, 3) [m], with the course at its mean."""
    slope: Floats
    """(C, 3, n) by how much it moves with the course."""
    covariance: Floats
    """(C, 3, 3) given the course [m^2]."""
    strength: Floats
    """(C,) log amplitude above the law of the kind."""
    strength_variance: Floats
    """(C,)."""
    log_scatter: Floats
    """(C,) logarithm of the mean square of its residuals in reported deviations."""


class PredictedReturns(NamedTuple):
    """Returns that C Gaussians predict: length [m] and two cosines, to second order in the feature's place."""

    seen: Floats
    """(C, 3)."""
    by_mean: Floats
    """(C, 3, 3)."""
    by_place: Floats
    """(C, 3, 3) through the agent's present position alone."""
    by_course: Floats
    """(C, 3, n) through the agent and through the feature."""
    own: Floats
    """(C, 3, 3) covariance given the course."""
    log_amplitude: Floats
    """(C,) mean."""
    in_view: Floats
    """(C,) 1 where it arrives from where the array hears, else 0."""


def no_features(size: int) -> GaussianFeatures:
    """No features yet of BP-SLAM with angles, of a course of `size` numbers."""
    none, whole = np.zeros(0), np.zeros(0, dtype=np.int64)
    return GaussianFeatures(
        none, whole, whole, whole, none, np.zeros((0, 3)), np.zeros((0, 3, size)), np.zeros((0, 3, 3)), none, none, none
    )


def carry(features: GaussianFeatures, step: Step, drift: float) -> GaussianFeatures:
    """Features' beliefs about a new course; wanderers widen by a standard deviation `drift` [m]."""
    missed = features.slope[:, :, : len(step.residual)]
    covariance = features.covariance + missed @ step.residual @ missed.swapaxes(1, 2)
    covariance[features.kind == WANDERER] += drift**2 * np.eye(3)
    return features._replace(
        slope=through(features.slope, step.transfer),
        covariance=covariance,
        strength_variance=features.strength_variance + AMPLITUDE_WALK**2,
    )


def returns_of(kind: Integers, place: Floats, agent: Floats, ends: Ends) -> Floats:
    """Returns of Gaussian features (..., C, 5): length [m], two cosines, height cosine of arrival, log amplitude."""
    tx, rx = agent + ends.tx, agent + ends.rx
    size = np.maximum(length_of(place), NEAREST)
    normal = place / size[..., None]
    depth = 2.0 * np.sum(normal * tx, axis=-1) - size
    is_wall = kind == WALL
    towards = np.where(is_wall[:, None], tx - depth[..., None] * normal, place) - rx
    last = np.maximum(length_of(towards), NEAREST)
    first = np.maximum(length_of(place - tx), NEAREST)
    length = np.where(is_wall, last, first + last)
    arrival = (towards / last[..., None]) @ ends.rotation
    law = np.where(kind == POINT, -np.log(first * last) - 0.5 * np.log(4.0 * np.pi), -np.log(length))
    return np.stack([length, arrival[..., 0], arrival[..., 1], arrival[..., 2], law], axis=-1)


def look(features: GaussianFeatures, course: AgentTrajectory, ends: Ends, free: float) -> PredictedReturns:
    """Returns of all features' Gaussians from the mean position; `free` is the log amplitude of 1 m in free space."""
    kind, mean, agent = features.kind, features.mean, course.mean[:3]
    spread = features.covariance + spread_over(features.slope, course)
    value, vector = np.linalg.eigh(spread)
    axes = (vector * np.sqrt(np.maximum(value, 1e-14))[:, None]).transpose(2, 0, 1)
    small = np.broadcast_to(NUDGE * np.eye(3)[:, None], axes.shape)
    moved = np.concatenate([np.zeros((1, *mean.shape)), small, -small, axes, -axes])
    far = returns_of(kind, mean + moved, agent, ends)
    aside = returns_of(kind, mean, agent + np.concatenate([small, -small]), ends)[..., :3]
    by_mean = np.moveaxis(far[1:4, :, :3] - far[4:7, :, :3], 0, 2) / (2.0 * NUDGE)
    by_place = np.moveaxis(aside[:3] - aside[3:], 0, 2) / (2.0 * NUDGE)
    bend = np.moveaxis(far[7:10, :, :3] + far[10:, :, :3] - 2.0 * far[0, :, :3], 0, 2)
    by_course = by_mean @ features.slope
    by_course[:, :, :3] += by_place
    own = by_mean @ features.covariance @ by_mean.swapaxes(1, 2) + 0.5 * bend @ bend.swapaxes(1, 2)
    in_view = np.where(far[0, :, 3] > -0.05, 1.0, 0.0) if ends.upper else np.ones(len(kind))
    seen = far[0, :, :3] + 0.5 * bend.sum(axis=2)
    return PredictedReturns(seen, by_mean, by_place, by_course, own, far[0, :, 4] + free + features.strength, in_view)


def through(rows: Floats, matrix: Floats) -> Floats:
    """Rows (C, 3, n) times a matrix (n, m), as one product."""
    return np.asarray((rows.reshape(3 * len(rows), len(matrix)) @ matrix).reshape(len(rows), 3, matrix.shape[1]))


def spread_over(rows: Floats, course: AgentTrajectory) -> Floats:
    """Covariance (C, 3, 3) that features' rows (C, 3, n) make of the course's."""
    return through(rows, course.covariance) @ rows.swapaxes(1, 2)
