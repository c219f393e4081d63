"""Agent particles: motion and resampling that keep mean and covariance exactly.

What a room cannot tell (a shift or drift of everything together) no later measurement mends. An ordinary resampling
of N particles shifts the mean by a standard deviation over sqrt(N) and takes 1/N of the variance away; over hundreds
of resamplings such directions get lost. So whatever is drawn here is corrected to the exact first two moments.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.nested.cloud import kernel_width

ROOM = 10
"""Particles a dimension that are needed to correct a covariance."""
KERNEL_DIMS = 4
"""Dimensions that the kernel's width counts: start position and velocity in the plane; the rest follows from them."""


class Whitened(NamedTuple):
    """Weighted samples in coordinates in which they have mean zero and unit covariance, null directions left out."""

    values: Floats
    """(N, K)."""
    mean: Floats
    """(D,)."""
    factor: Floats
    """(D, K): `sample = mean + factor @ value`."""


def moments(weight: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Weighted mean (D,) and covariance (D, D) of values (N, D)."""
    mean = weight @ values
    centred = values - mean
    return mean, (centred * weight[:, None]).T @ centred


def systematic_ancestors(weight: Floats, count: int, *, rng: np.random.Generator) -> Integers:
    """Ancestors (count,) by systematic resampling: particle i is drawn `count w_i` times on average, unbiased."""
    edges = np.cumsum(weight)
    comb = (np.arange(count) + rng.random()) / count * edges[-1]
    return np.minimum(np.searchsorted(edges, comb, side="right"), len(weight) - 1)


def whiten(weight: Floats, values: Floats) -> Whitened:
    """Weighted values (N, D) made standard."""
    mean, covariance = moments(weight, values)
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-30))
    spread, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    keep = (spread > 1e-10) & (spread < np.inf)
    root = np.sqrt(spread[keep])
    kept = vectors[:, keep]
    return Whitened((values - mean) / scale @ kept / root, mean, scale[:, None] * kept * root)


def standardise(weight: Floats, values: Floats) -> Floats:
    """Values (N, K) corrected to weighted mean zero and, where N allows, unit covariance, by the least movement."""
    values = values - weight @ values
    if values.shape[1] == 0 or 1.0 / np.sum(weight**2) < ROOM * values.shape[1]:
        return values
    spread, vectors = np.linalg.eigh((values * weight[:, None]).T @ values)
    return values @ (vectors * np.maximum(spread, 1e-3) ** -0.5 @ vectors.T)


def exact_noise(weight: Floats, values: Floats, dims: int, *, rng: np.random.Generator) -> Floats:
    """(N, dims) standard normal noise that has no correlation with values (N, D) and exact moments in this sample."""
    noise = rng.standard_normal((len(weight), dims))
    known = whiten(weight, values).values
    if 1.0 / np.sum(weight**2) >= ROOM * max(known.shape[1], 1):
        noise = noise - weight @ noise
        noise = noise - known @ ((known * weight[:, None]).T @ noise)
    return standardise(weight, noise)


def resample(weight: Floats, values: Floats, count: int, *, rng: np.random.Generator) -> tuple[Integers, Floats]:
    """Ancestors (count,) and the values (count, D) of their children, of equal weight.

    Systematic resampling and a smooth kernel about every survivor (Liu and West, 2001) on all of the values together,
    so that what they have in common stays in common; then mean and covariance are restored exactly.
    """
    standard = whiten(weight, values)
    ancestors = systematic_ancestors(weight, count, rng=rng)
    width = kernel_width(count, min(max(standard.values.shape[1], 1), KERNEL_DIMS))
    chosen = standard.values[ancestors]
    moved = np.sqrt(1.0 - width**2) * chosen + width * rng.standard_normal(chosen.shape)
    moved = standardise(np.full(count, 1.0 / count), moved)
    return ancestors, standard.mean + moved @ standard.factor.T
