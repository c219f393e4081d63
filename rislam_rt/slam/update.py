"""Measurement update: log weights by the likelihood of the innovations, maps by the Kalman gain."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from rislam_rt.arrays import Floats
from rislam_rt.slam.particles import Particles, normalised

LENGTH_FLOOR = 5e-4
"""Standard deviation [m] added to every length: half a millimetre of what the model leaves out."""
COSINE_FLOOR = 2e-4
"""The same for direction cosines."""


class Update(NamedTuple):
    """Particles after a cycle's measurements."""

    particles: Particles
    log_evidence: float
    """Log density of the measurements given all before."""
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
        return Update(particles, 0.0, 0.0)
    flat = jacobian.reshape(dims, -1)
    noise = (std**2 + np.array([LENGTH_FLOOR, COSINE_FLOOR, COSINE_FLOOR]) ** 2).reshape(dims)
    innovation = (seen[None] - predicted).reshape(count, dims)
    cross = particles.covariance @ flat.T
    spread = flat @ cross + np.diag(noise)
    factor = cho_factor(spread, lower=True)
    white = solve_triangular(factor[0], innovation.T, lower=True)
    log_likelihood = -0.5 * np.einsum("dn,dn->n", white, white) - np.sum(np.log(np.diag(factor[0])))
    log_likelihood -= 0.5 * dims * np.log(2.0 * np.pi)
    nis = _mean_nis(particles.log_weight, innovation, spread)
    gain = cho_solve(factor, cross.T).T
    features = particles.features + (innovation @ gain.T).reshape(particles.features.shape)
    covariance = particles.covariance - gain @ cross.T
    log_weight, evidence = normalised(particles.log_weight + log_likelihood)
    updated = particles._replace(log_weight=log_weight, features=features, covariance=0.5 * (covariance + covariance.T))
    return Update(updated, evidence, nis)


def _mean_nis(log_weight: Floats, innovation: Floats, spread: Floats) -> float:
    """NIS of the mean belief: its innovation against the spread of the cloud and of the map together."""
    weight = np.exp(log_weight)
    mean = weight @ innovation
    centred = innovation - mean
    total = spread + (centred * weight[:, None]).T @ centred
    return float(mean @ np.linalg.solve(total, mean))
