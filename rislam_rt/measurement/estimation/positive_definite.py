"""Solve and invert symmetric positive definite matrices that may be close to singular: unit diagonal, and a ridge."""

import numpy as np
import scipy

from rislam_rt.arrays import Floats

RIDGE = 1e-9
"""Added to the unit diagonal, so that coinciding paths do not stop the solver."""


def inverse(matrix: Floats) -> Floats:
    """Inverse (n, n) of a positive definite matrix that may be close to singular."""
    if not len(matrix):
        return matrix
    scale, factor = _factor(matrix)
    lower = scipy.linalg.lapack.dpotri(factor, lower=1, overwrite_c=1)[0].T
    lower *= scale
    lower *= scale[:, None]
    full = lower + lower.T
    full.flat[:: len(scale) + 1] *= 0.5
    return np.asarray(full)


def solve(matrix: Floats, right: Floats) -> Floats:
    """Solution (n,) of a positive definite system for one right-hand side."""
    if not len(matrix):
        return right
    scale, factor = _factor(matrix)
    return np.asarray(scale * scipy.linalg.lapack.dpotrs(factor, scale * right, lower=1)[0])


def whitened(matrix: Floats, right: Floats) -> Floats:
    """Product `W right` (n, k), W being a whitening matrix of a positive definite one: its inverse is `W^T W`."""
    if not len(matrix):
        return right
    scale, factor = _factor(matrix)
    return np.asarray(scipy.linalg.lapack.dtrtrs(factor, scale[:, None] * right, lower=1)[0])


def _factor(matrix: Floats) -> tuple[Floats, Floats]:
    """Scale (n,) to unit diagonal and lower Cholesky factor of the scaled matrix, with as large a ridge as it takes."""
    scale, ridge = 1.0 / np.sqrt(np.maximum(np.diagonal(matrix), np.finfo(np.float64).tiny)), RIDGE
    while True:
        scaled = matrix * scale
        scaled *= scale[:, None]
        scaled.flat[:: len(scale) + 1] += ridge
        factor, failed = scipy.linalg.lapack.dpotrf(scaled.T, lower=1, clean=1, overwrite_a=1)
        if not failed:
            return scale, factor
        ridge = 100.0 * ridge + RIDGE
