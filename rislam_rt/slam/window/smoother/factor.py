"""Solutions and inverses of symmetric positive matrices, by Cholesky's factor of a matrix scaled to a unit diagonal."""

import numpy as np
import scipy

from rislam_rt.arrays import Floats


def _factorise(matrix: Floats) -> tuple[Floats, Floats]:
    """The factor and the scale (D,), damped where rounding made the matrix indefinite."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-30))
    for damping in (0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3):
        scaled = matrix * scale * scale[:, None]
        if damping:
            scaled += damping * np.eye(len(scaled))
        factor, bad = scipy.linalg.lapack.dpotrf(scaled.T, lower=1, overwrite_a=1)
        if not bad:
            break
    return factor, scale


def solution(matrix: Floats, right: Floats) -> Floats:
    """The matrix's inverse times (D,)."""
    factor, scale = _factorise(matrix)
    found, _ = scipy.linalg.lapack.dpotrs(factor, right * scale, lower=1)
    return np.asarray(found * scale)


def inverse(matrix: Floats) -> Floats:
    """The matrix's inverse, symmetric."""
    factor, scale = _factorise(matrix)
    inside, _ = scipy.linalg.lapack.dpotri(factor, lower=1, overwrite_c=1)
    inside *= scale * scale[:, None]
    full = inside + inside.T
    np.fill_diagonal(full, np.diag(inside))
    return np.asarray(full)
