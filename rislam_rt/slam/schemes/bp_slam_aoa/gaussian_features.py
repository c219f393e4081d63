"""Potential features as Gaussian sums given the agent's trajectory, and the returns that they predict, with angles.

Places are relative to the start: nothing that is measured tells where that was. A wall is the mirror image of the start
in it, a point its place; a *wanderer* is a point that walks at random, which is what a path over several walls, or over
walls and a point, looks like. Every Gaussian also holds by how much its amplitude exceeds the law of its kind.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory, Step
from rislam_rt.slam.schemes.shared.ranges import length_of

WALL, POINT, WANDERER = 0, 1, 2
"""Kinds of feature: a wall, a point scatterer, a path of no lasting place."""
NUDGE = 1e-5
"""Step of central differences [m]."""
NEAREST = 1e-3
"""Shortest distance [m] to a feature in predictions."""
AMPLITUDE_WALK = 0.02
"""Random walk of a feature's log amplitude in one step."""


class Ends(NamedTuple):
    """Places of Tx and Rx on the agent in room axes, and the agent's rotation."""

    tx: Floats
    """Tx (3,) [m] from the agent's position, in room axes."""
    rx: Floats
    """Rx (3,) [m] from the agent's position, in room axes."""
    rotation: Floats
    """Rotation (3, 3) from body to room axes."""
    upper: bool
    """Whether the array hears the upper half space alone."""


class GaussianFeatures(NamedTuple):
    """Gaussian sums of K potential features, C Gaussians in all, a feature's side by side; n numbers of trajectory."""

    existence: Floats
    """Existence probability (K,)."""
    ident: Integers
    """Number (K,) of the feature, for life."""
    owner: Integers
    """Row (C,) of each Gaussian's feature, ascending."""
    kind: Integers
    """Kind (C,) of each Gaussian: WALL, POINT or WANDERER."""
    share: Floats
    """Share (C,) of each Gaussian; those of one feature sum to one."""
    mean: Floats
    """Mean place (C, 3) [m] from the start, with the trajectory at its mean."""
    slope: Floats
    """Derivative (C, 3, n) of the place by the trajectory."""
    covariance: Floats
    """Covariance (C, 3, 3) [m^2] given the trajectory."""
    strength: Floats
    """Log amplitude (C,) above the law of the kind."""
    strength_variance: Floats
    """Variance (C,) of that log amplitude."""
    log_scatter: Floats
    """Logarithm (C,) of the mean square of the feature's residuals in reported deviations."""


class PredictedReturns(NamedTuple):
    """Returns that C Gaussians of features predict: length [m], two cosines, to second order in the feature's place."""

    seen: Floats
    """Lengths [m] and cosines (C, 3), curvature included."""
    by_mean: Floats
    """Derivatives (C, 3, 3) of the returns by the feature's place."""
    by_place: Floats
    """Derivatives (C, 3, 3) of the returns by the agent's present position alone."""
    by_course: Floats
    """Derivatives (C, 3, n) of the returns by the trajectory, through the agent and through the feature."""
    own: Floats
    """Covariances (C, 3, 3) of the returns given the trajectory."""
    log_amplitude: Floats
    """Mean log amplitudes (C,)."""
    in_view: Floats
    """Ones (C,) where the return arrives from where the array hears, else zeros."""


def no_features(size: int) -> GaussianFeatures:
    """Empty set of features' Gaussian sums of BP-SLAM with angles, for a trajectory of `size` numbers."""
    none, whole = np.zeros(0), np.zeros(0, dtype=np.int64)
    return GaussianFeatures(
        none, whole, whole, whole, none, np.zeros((0, 3)), np.zeros((0, 3, size)), np.zeros((0, 3, 3)), none, none, none
    )


def carry(features: GaussianFeatures, step: Step, drift: float) -> GaussianFeatures:
    """Features' Gaussian sums given the trajectory after a time step; wanderers widen by a deviation `drift` [m]."""
    missed = features.slope[:, :, : len(step.residual)]
    covariance = features.covariance + missed @ step.residual @ missed.swapaxes(1, 2)
    covariance[features.kind == WANDERER] += drift**2 * np.eye(3)
    return features._replace(
        slope=through(features.slope, step.transfer),
        covariance=covariance,
        strength_variance=features.strength_variance + AMPLITUDE_WALK**2,
    )


def returns_of(kind: Integers, place: Floats, agent: Floats, ends: Ends) -> Floats:
    """Returns (..., C, 5) that Gaussian features predict: length [m], three direction cosines in the body frame, log
    amplitude by law."""
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


def predict_returns(features: GaussianFeatures, course: AgentTrajectory, ends: Ends, free: float) -> PredictedReturns:
    """Returns that all Gaussian features predict from the mean position; `free` is the log amplitude of 1 m."""
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
    """Products (C, 3, m) of Gaussian features' rows (C, 3, n) and a matrix (n, m), as one product."""
    return np.asarray((rows.reshape(3 * len(rows), len(matrix)) @ matrix).reshape(len(rows), 3, matrix.shape[1]))


def spread_over(rows: Floats, course: AgentTrajectory) -> Floats:
    """Covariances (C, 3, 3) of Gaussian features or their returns by the trajectory's, from derivatives (C, 3, n)."""
    return through(rows, course.covariance) @ rows.swapaxes(1, 2)
