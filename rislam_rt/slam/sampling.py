"""Sampling: Gaussian samples without random numbers (quasi-random draws), square roots of covariances, and systematic
resampling, by which weighted particles survive.
"""

from functools import lru_cache

import numpy as np
import scipy

from rislam_rt.arrays import Floats, Integers


def square_root(covariance: Floats) -> Floats:
    """Square root (D, K) of a covariance (D, D), `factor @ factor.T = covariance`, null directions left out."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-30))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    keep = values > 1e-12
    return scale[:, None] * vectors[:, keep] * np.sqrt(values[keep])


def square_roots(covariance: Floats) -> Floats:
    """Square roots (N, D, D) of covariances (N, D, D) as by `square_root`, null directions being columns of zeros."""
    scale = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 1e-30))
    values, vectors = np.linalg.eigh(covariance / (scale[:, :, None] * scale[:, None, :]))
    return np.asarray(scale[:, :, None] * vectors * np.sqrt(np.where(values > 1e-12, values, 0.0))[:, None, :])


PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29)
"""Bases of Halton's sequence, one for each dimension."""


def radical_inverse(count: int, base: int) -> Floats:
    """First terms (count,) of van der Corput's sequence in (0, 1) for sampling: the digits of 1, 2, ... mirrored at the
    point.

    `scipy.stats.qmc.Halton` without its half second of import.
    """
    left, unit, found = np.arange(1, count + 1), 1.0 / base, np.zeros(count)
    while left.any():
        found += (left % base) * unit
        left, unit = left // base, unit / base
    return found


@lru_cache(maxsize=16)
def even_draws(count: int, dims: int) -> Floats:
    """Equally likely, deterministic samples (count, dims) of a standard normal, corrected to mean 0 and covariance 1.

    Halton's sequence through the normal quantile.
    """
    if not dims:
        return np.zeros((count, 0))
    draws = scipy.special.ndtri(np.stack([radical_inverse(count, base) for base in PRIMES[:dims]], axis=1))
    if count <= dims + 1:
        return np.zeros((count, dims)) if count == 1 else np.asarray(draws - draws.mean(axis=0))
    draws -= draws.mean(axis=0)
    return np.asarray(np.linalg.solve(np.linalg.cholesky(draws.T @ draws / count), draws.T).T)


def ancestors_at(weight: Floats, size: int, comb: Floats) -> Integers:
    """Ancestor rows (K, size) by systematic resampling of each row of weights (K, N), whose comb (K,) starts in [0, 1).

    Particle i of a row is drawn `size w_i` times on average; the ancestors come in the order of the particles.
    """
    edges = np.cumsum(weight, axis=1)
    teeth = (np.arange(size) + comb[:, None]) / size * edges[:, -1:]
    rows = [np.searchsorted(edge, tooth, side="right") for edge, tooth in zip(edges, teeth, strict=True)]
    return np.minimum(np.array(rows, dtype=np.int64).reshape(len(weight), size), weight.shape[1] - 1)


def systematic_ancestors(weight: Floats, count: int, *, rng: np.random.Generator) -> Integers:
    """Ancestor rows (count,) by systematic resampling of one set of particle weights (N,), unbiased."""
    return ancestors_at(weight[None], count, rng.random(1))[0]
