"""Measurement update: log weights by the likelihood of the innovations, maps by the Kalman gain."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from rislam_rt.arrays import Floats
from rislam_rt.slam.particles import Particles, normalised

TAIL = 4.0
"""Degrees of freedom of Student's t, by which a return far off its prediction counts for less: paths that nobody
expected, in the same resolution cell, make the errors' tails heavy."""
LENGTH_FLOOR = 5e-4
"""Standard deviation [m] added to every length: half a millimetre of what the model leaves out."""
COSINE_FLOOR = 2e-4
"""The same for direction cosines."""


class Update(NamedTuple):
    """Particles after a cycle's measurements."""

    particles: Particles
    log_evidence: float
    """Log density of the measurements given all before."""
    surprise: Floats
    """(A,) squared innovation of each return at the mean belief, per degree of freedom."""
    nis: float
    """Squared innovation of the mean belief, normalised; chi^2 with 3 A degrees of freedom."""


def update(particles: Particles, predicted: Floats, jacobian: Floats, seen: Floats, std: Floats) -> Update:
    """Update by A associated returns at once.

    Parameters
    ----------
    predicted
        (N, A, 3) each particle's prediction.
    jacobian
        (A, 3, F, 3) derivative with respect to the map, at the mean belief.
    seen, std
        (A, 3).
    """
    count, dims = len(particles.log_weight), predicted.shape[1] * 3
    if dims == 0:
        return Update(particles, 0.0, np.zeros(0), 0.0)
    flat = jacobian.reshape(dims, -1)
    noise = (std**2 + np.array([LENGTH_FLOOR, COSINE_FLOOR, COSINE_FLOOR]) ** 2).reshape(dims)
    innovation = (seen[None] - predicted).reshape(count, dims)
    cross = particles.covariance @ flat.T
    spread = flat @ cross + np.diag(noise)
    factor = cho_factor(spread, lower=True)
    white = solve_triangular(factor[0], innovation.T, lower=True)
    log_likelihood = -0.5 * np.einsum("dn,dn->n", white, white) - np.sum(np.log(np.diag(factor[0])))
    log_likelihood -= 0.5 * dims * np.log(2.0 * np.pi)
    mean, total = _at_mean(particles.log_weight, innovation, spread)
    surprise = _each(mean, total)
    noise *= np.repeat(np.maximum(1.0, (TAIL + 3.0 * surprise) / (TAIL + 3.0)), 3)
    spread = flat @ cross + np.diag(noise)
    mean, total = _at_mean(particles.log_weight, innovation, spread)
    gain = cho_solve(factor, cross.T).T
    features = particles.features + (innovation @ gain.T).reshape(particles.features.shape)
    covariance = particles.covariance - gain @ cross.T
    log_weight, evidence = normalised(particles.log_weight + log_likelihood)
    updated = particles._replace(log_weight=log_weight, features=features, covariance=0.5 * (covariance + covariance.T))
    return Update(updated, evidence, surprise, float(mean @ np.linalg.solve(total, mean)))


def _at_mean(log_weight: Floats, innovation: Floats, spread: Floats) -> tuple[Floats, Floats]:
    """Innovation (D,) of the mean belief, and its covariance (D, D): the map's and the cloud's together."""
    weight = np.exp(log_weight)
    mean = weight @ innovation
    centred = innovation - mean
    return mean, spread + (centred * weight[:, None]).T @ centred


def _each(mean: Floats, total: Floats) -> Floats:
    """(A,) squared innovation of each return by itself, per degree of freedom."""
    gap = mean.reshape(-1, 3)
    rows = np.arange(len(gap))
    blocks = total.reshape(len(gap), 3, len(gap), 3)[rows, :, rows, :]
    return np.einsum("ai,ai->a", gap, np.linalg.solve(blocks, gap[..., None])[..., 0]) / 3.0
