"""Solutions and inverses of symmetric positive matrices by Cholesky's factor, whose errors no scaling changes."""

import numpy as np
import scipy

from rislam_rt.arrays import Floats


def _factorise(matrix: Floats) -> Floats:
    """The factor, by a share of the diagonal damped where rounding made the matrix indefinite."""
    factor, bad = scipy.linalg.lapack.dpotrf(matrix.T, lower=1)
    for damping in (1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3):
        if not bad:
            break
        damped = matrix + damping * np.diag(np.maximum(np.diag(matrix), 1e-30))
        factor, bad = scipy.linalg.lapack.dpotrf(damped.T, lower=1)
    return np.asarray(factor)


def solution(matrix: Floats, right: Floats) -> Floats:
    """The matrix's inverse times (D,)."""
    found, _ = scipy.linalg.lapack.dpotrs(_factorise(matrix), right, lower=1)
    return np.asarray(found)


def inverse(matrix: Floats) -> Floats:
    """The matrix's inverse, symmetric."""
    inside, _ = scipy.linalg.lapack.dpotri(_factorise(matrix), lower=1, overwrite_c=1)
    full = inside + inside.T
    np.fill_diagonal(full, np.diag(inside))
    return np.asarray(full)
