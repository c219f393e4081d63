"""Solution and inverse of symmetric positive definite matrices by Cholesky's factor, whose errors no scaling
changes."""

import numpy as np
import scipy

from rislam_rt.arrays import Floats


def _factorise(matrix: Floats) -> Floats:
    """Cholesky factor of a symmetric matrix (D, D), damped by a share of its diagonal where rounding made it
    indefinite."""
    factor, bad = scipy.linalg.lapack.dpotrf(matrix.T, lower=1)
    for damping in (1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3):
        if not bad:
            break
        damped = matrix + damping * np.diag(np.maximum(np.diag(matrix), 1e-30))
        factor, bad = scipy.linalg.lapack.dpotrf(damped.T, lower=1)
    return np.asarray(factor)


def solution(matrix: Floats, right: Floats) -> Floats:
    """Solution (D,) of a symmetric positive definite linear system, from its matrix (D, D) and right-hand side (D,)."""
    found, _ = scipy.linalg.lapack.dpotrs(_factorise(matrix), right, lower=1)
    return np.asarray(found)


def form_and_log_det(matrix: Floats, right: Floats) -> tuple[float, float]:
    """Quadratic form `b^T A^-1 b` of a symmetric positive definite matrix (D, D) and a vector (D,), and the logarithm
    of the matrix's determinant."""
    factor = _factorise(matrix)
    half, _ = scipy.linalg.lapack.dtrtrs(factor, right, lower=1)
    return float(half @ half), 2.0 * float(np.log(factor.diagonal()).sum())


def log_evidence(information: Floats, slope: Floats, std: Floats) -> float:
    """Log marginal likelihood of unknowns of independent centred normal priors of deviations `std` (D,), against all
    being zero, by what is told of them: an information matrix (D, D), and its product (D,) with the values told."""
    inside = std[:, None] * information * std
    inside.flat[:: len(std) + 1] += 1.0
    form, log_det = form_and_log_det(inside, slope * std)
    return 0.5 * (form - log_det)


def log_evidences(information: Floats, slope: Floats, priors: Floats) -> Floats:
    """Log marginal likelihoods (N,) as `log_evidence`, of unknowns with joint priors of covariances `priors`
    (N, D, D)."""
    root = np.linalg.cholesky(priors)
    turned = np.swapaxes(root, 1, 2)
    factor = np.linalg.cholesky(turned @ information @ root + np.eye(len(slope)))
    half = np.linalg.solve(factor, (turned @ slope)[..., None])[..., 0]
    log_det = np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
    return np.asarray(0.5 * np.vecdot(half, half) - log_det)


def inverse(matrix: Floats) -> Floats:
    """Inverse (D, D) of a symmetric positive definite matrix, exactly symmetric."""
    inside, _ = scipy.linalg.lapack.dpotri(_factorise(matrix), lower=1, overwrite_c=1)
    full = np.asarray(inside + inside.T)
    full.flat[:: len(full) + 1] *= 0.5
    return full
