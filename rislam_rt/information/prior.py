"""Prior information from what a filter holds: a covariance, or a cloud of particles."""

import numpy as np

from rislam_rt.arrays import Floats

LEAST_VARIANCE = 1e-8
"""(0.1 mm)^2: no belief about a position is taken for better than this, nor inverted when it has collapsed."""


MOST_VARIANCE = 1e6
"""(1 km)^2: what is less certain than this, or not finite, counts as known to this."""


def prior_from_covariance(covariance: Floats) -> Floats:
    """Information (..., D, D) [1/m^2] of covariances (..., D, D) [m^2], held between (0.1 mm)^2 and (1 km)^2."""
    covariance = np.clip(np.nan_to_num(covariance, nan=MOST_VARIANCE), -MOST_VARIANCE, MOST_VARIANCE)
    value, vector = np.linalg.eigh(0.5 * (covariance + np.swapaxes(covariance, -1, -2)))
    return (vector / np.maximum(value, LEAST_VARIANCE)[..., None, :]) @ np.swapaxes(vector, -1, -2)


def prior_from_particles(position: Floats, log_weight: Floats | None = None) -> Floats:
    """Information (..., D, D) [1/m^2] of a cloud (..., S, D) [m] with log weights (..., S), equal by default.

    A Gaussian of the cloud's mean and covariance stands for it: of all densities with that covariance it has the
    least information.
    """
    position = np.asarray(position, dtype=np.float64)
    if log_weight is None:
        log_weight = np.zeros(position.shape[:-1])
    weight = np.exp(log_weight - np.max(log_weight, axis=-1, keepdims=True))
    weight = (weight / weight.sum(axis=-1, keepdims=True))[..., None]
    centred = position - np.sum(weight * position, axis=-2, keepdims=True)
    return prior_from_covariance(np.swapaxes(weight * centred, -1, -2) @ centred)
