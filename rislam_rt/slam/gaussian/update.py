"""Measurement update: an extended Kalman filter in every particle, whose weight follows the innovation's density."""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Floats
from rislam_rt.model import Body
from rislam_rt.slam.gaussian.particles import Particles, mixture
from rislam_rt.slam.moments import normalised, poses_of
from rislam_rt.slam.returns import Returns, linearise

TAIL = 4.0
"""Degrees of freedom of Student's t, by which a return far off its prediction counts for less: paths that nobody
expected, in the same resolution cell, make the errors' tails heavy."""
FLOOR = np.array([5e-4, 2e-4, 2e-4])
"""Standard deviations [m, 1, 1] added to length and cosines: what the model leaves out."""


class Update(NamedTuple):
    """Particles after a cycle's measurements."""

    particles: Particles
    log_evidence: float
    """Log density of the measurements given all before."""
    white: Floats
    """(A, 3) innovation of each return by itself, whitened: standard normal when all is well."""
    nis: float
    """Squared innovation of the mean belief, normalised; chi^2 with 3 A degrees of freedom."""


def update(
    particles: Particles,
    returns: Returns,
    twin: Returns,
    anchor: Floats,
    body: Body,
    seen: Floats,
    std: Floats,
    *,
    rng: np.random.Generator,
) -> Update:
    """Update by A associated returns at once.

    Parameters
    ----------
    returns, twin
        The returns, and for each the one that it came out as one with, halfway between (itself if it stands alone).
    anchor
        (F, 3) fixed points of the walls.
    seen, std
        (A, 3) length [m] and cosines.
    """
    if not len(seen):
        return Update(particles, 0.0, np.zeros((0, 3)), 0.0)
    predicted, jacobian = predict_returns(particles, returns, twin, anchor, body)
    innovation = (seen - predicted).reshape(len(predicted), -1)
    shown = particles.shown
    cross = particles.covariance[:, :, shown] @ np.swapaxes(jacobian, 1, 2)
    inner = jacobian @ cross[:, shown]
    noise = (std**2 + FLOOR**2).ravel()
    weight = np.exp(particles.log_weight)
    mean, total = mixture(weight, innovation, inner + np.diag(noise))
    white = _each(mean, total)
    noise = noise * np.repeat(np.maximum(1.0, (TAIL + np.sum(white**2, axis=1)) / (TAIL + 3.0)), 3)
    spread = inner + np.diag(noise)
    mean, total = mixture(weight, innovation, spread)
    moved, log_likelihood = correct(particles, cross, spread, innovation)
    log_weight, evidence = normalised(particles.log_weight + log_likelihood)
    return Update(moved._replace(log_weight=log_weight), evidence, white, float(mean @ np.linalg.solve(total, mean)))


def predict_returns(
    particles: Particles, returns: Returns, twin: Returns, anchor: Floats, body: Body
) -> tuple[Floats, Floats]:
    """What each particle expects to see (N, A, 3), and its derivative (N, 3 A, 7 + 3F) by pose and features."""
    position, heading = particles.mean[:, :3], particles.mean[:, 6]
    poses, features = poses_of(position, heading, body), particles.features
    count, rows = len(position), len(returns.tx)
    jacobian = np.zeros((count, rows, 3, 7 + 3 * features.shape[1]))
    predicted = np.zeros((count, rows, 3))
    sides = (returns,) if twin is returns else (returns, twin)
    for side in sides:
        linear, share = linearise(side, features, anchor, poses), 1.0 / len(sides)
        predicted += share * linear.seen
        jacobian[..., :3] += share * linear.by_pose
        jacobian[..., 6] += share * linear.by_heading(poses, position)
        jacobian[..., 7:] += share * linear.by_feature.reshape(count, rows, 3, -1)
    return predicted, jacobian.reshape(count, 3 * rows, -1)


def correct(particles: Particles, cross: Floats, spread: Floats, innovation: Floats) -> tuple[Particles, Floats]:
    """Kalman's update of every particle, and the log density (N,) of its innovation.

    Parameters
    ----------
    cross
        (N, D, B) covariance of state and prediction.
    spread
        (N, B, B) covariance of the innovation.
    innovation
        (N, B).
    """
    mean, covariance = particles.mean.copy(), particles.covariance.copy()
    log_likelihood = np.zeros(len(mean))
    for n in range(len(mean)):
        factor = np.linalg.cholesky(spread[n])
        both = np.concatenate([cross[n].T, innovation[n][:, None]], axis=1)
        solved = scipy.linalg.solve_triangular(factor, both, lower=True, check_finite=False)
        root, scaled = solved[:, :-1], solved[:, -1]
        mean[n] += root.T @ scaled
        covariance[n] -= root.T @ root
        log_likelihood[n] = -0.5 * scaled @ scaled - np.log(np.diagonal(factor)).sum()
    log_likelihood -= 0.5 * innovation.shape[1] * np.log(2.0 * np.pi)
    return particles._replace(mean=mean, covariance=covariance), log_likelihood


def _each(mean: Floats, total: Floats) -> Floats:
    """(A, 3) whitened innovation of each return by itself."""
    gap = mean.reshape(-1, 3)
    rows = np.arange(len(gap))
    blocks = total.reshape(len(gap), 3, len(gap), 3)[rows, :, rows, :]
    return np.asarray(np.linalg.solve(np.linalg.cholesky(blocks), gap[..., None])[..., 0])
