"""Errors of estimates: of positions, after alignment, and normalised by a filter's own covariances (NEES, NIS)."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import GeometryError


def position_errors(estimate: Floats, truth: Floats) -> Floats:
    """Position errors (...,) [m]: distances between estimated and true positions (..., D)."""
    return np.asarray(np.linalg.norm(np.asarray(estimate) - np.asarray(truth), axis=-1))


def rmse(estimate: Floats, truth: Floats) -> float:
    """Root mean square [m] of the position errors over all positions (..., D)."""
    return root_mean_square(position_errors(estimate, truth))


def root_mean_square(errors: Floats) -> float:
    """Root of the mean square of errors of any shape.

    Raises
    ------
    GeometryError
        There is nothing to average.
    """
    errors = np.asarray(errors, dtype=np.float64)
    if not errors.size:
        raise GeometryError("errors: none received; give at least one")
    return float(np.sqrt(np.mean(errors**2)))


def align(estimate: Floats, truth: Floats) -> Floats:
    """Estimated positions (K, 3) turned about z and shifted onto the true ones at the least squared distances, to leave
    relative errors."""
    centred, target = estimate - estimate.mean(axis=0), truth - truth.mean(axis=0)
    # The angle that maximises sum target . R centred, with complex numbers for the plane.
    overlap = np.sum(np.conj(centred[:, 0] + 1j * centred[:, 1]) * (target[:, 0] + 1j * target[:, 1]))
    angle = np.angle(overlap) if overlap != 0.0 else 0.0
    c, s = np.cos(angle), np.sin(angle)
    return centred @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + truth.mean(axis=0)


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
