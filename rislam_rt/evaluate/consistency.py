"""Consistency of a filter: its errors normalised by its own covariances (NEES, NIS)."""

import numpy as np

from rislam_rt.arrays import Floats


def normalised_squares(errors: Floats, covariances: Floats) -> Floats:
    """Normalised squared errors `e^T P^-1 e` (...,), NEES or NIS, of errors (..., D) with covariances (..., D, D).

    NEES of state errors, NIS of innovations; chi-square with D degrees of freedom when the filter is consistent.
    Infinite where a covariance is not positive definite.
    """
    errors, covariances = np.broadcast_arrays(np.asarray(errors)[..., None], np.asarray(covariances))
    errors = errors[..., :1]
    definite = np.linalg.eigvalsh(covariances)[..., 0] > 0.0
    safe = np.where(definite[..., None, None], covariances, np.eye(covariances.shape[-1]))
    squares = np.sum(errors * np.linalg.solve(safe, errors), axis=(-2, -1))
    return np.where(definite, squares, np.inf)
