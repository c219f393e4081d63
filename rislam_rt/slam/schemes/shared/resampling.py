"""Weights and resampling of many clouds at once, with a kernel that keeps mean and covariance of parts of a cloud."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.systematic_resampling import ancestors_at

CELL = 16
"""Particles that a kernel looks at: few enough for a thin ring to look straight, enough for a covariance."""


def systematic_rows(weight: Floats, *, rng: np.random.Generator) -> Integers:
    """Ancestors (K, N) for weights (K, N): row by row, each particle is drawn `N w` times on average, unbiased.

    The ancestors come in the order of the particles, so that neighbours in a sorted cloud stay neighbours.
    """
    return ancestors_at(weight, weight.shape[1], rng.random(len(weight)))


def effective_fraction(weight: Floats) -> Floats:
    """Effective sample size over N (K,) of normalised weights (K, N)."""
    return 1.0 / (np.sum(weight**2, axis=1) * weight.shape[1])


def normalised_rows(log_weight: Floats) -> Floats:
    """Weights (K, N) that sum to one in every row; a hopeless row becomes a uniform one."""
    top = log_weight.max(axis=1, keepdims=True)
    weight = np.exp(log_weight - np.where(np.isfinite(top), top, 0.0))
    total = weight.sum(axis=1, keepdims=True)
    return np.where(total > 0.0, weight / np.where(total > 0.0, total, 1.0), 1.0 / weight.shape[1])


def cell_levels(count: int) -> int:
    """Levels of the k-d split of `count` particles that leave `CELL` or more in a cell, and split evenly."""
    levels = 0
    while count % 2 == 0 and count >= 2 * CELL:
        count //= 2
        levels += 1
    return levels


def cell_order(clouds: Floats, levels: int) -> Integers:
    """Order (K, N) of clouds (K, N, D) in which each of `2^levels` runs of particles is a compact cell.

    A k-d split: every part is halved at the median of its widest axis. N must be a multiple of `2^levels`.
    """
    batch, count, dims = clouds.shape
    order = np.broadcast_to(np.arange(count), (batch, count)).copy()
    for level in range(levels):
        size = count >> level
        parts = np.take_along_axis(clouds, order[..., None], axis=1).reshape(-1, size, dims)
        axis = np.argmax(parts.max(axis=1) - parts.min(axis=1), axis=1)
        along = np.take_along_axis(parts, axis[:, None, None], axis=2)[..., 0]
        split = np.argpartition(along, size // 2, axis=1)
        order = np.take_along_axis(order.reshape(-1, size), split, axis=1).reshape(batch, count)
    return order


def smooth(clouds: Floats, width: Floats, levels: int, *, rng: np.random.Generator) -> Floats:
    """Clouds (K, N, D), sorted into cells, with every particle moved by a kernel of its cell.

    Each cell is shrunk towards its mean and widened by differences of its own members, so that mean and covariance of
    every cell stay (Liu and West, 2001, cell by cell). A ring stays a ring; one kernel for all of it would fill it.

    Parameters
    ----------
    width
        (K,) kernel width in standard deviations of a cell, 0 to 1.
    """
    batch, count, dims = clouds.shape
    size = count >> levels
    parts = clouds.reshape(batch, 1 << levels, size, dims)
    mean = parts.mean(axis=2, keepdims=True)
    first, second = rng.permutation(size), rng.permutation(size)
    spread = width[:, None, None, None]
    change = (parts[:, :, first] - parts[:, :, second]) * (spread / np.sqrt(2.0))
    moved = mean + np.sqrt(1.0 - spread**2) * (parts - mean) + change
    return moved.reshape(batch, count, dims)


def kernel_width(count: int, dims: int, effective: Floats) -> Floats:
    """Kernel widths (K,): Silverman's for `count` particles in `dims` dimensions, less as fewer ancestors were lost.

    `effective` (K,) is the effective sample size over N: a step that told nothing moves nothing.
    """
    silverman = (4.0 / (dims + 2.0)) ** (1.0 / (dims + 4.0)) * count ** (-1.0 / (dims + 4.0))
    return min(silverman, 0.9) * np.sqrt(np.clip(1.0 - effective, 0.0, 1.0))


def resample_systematic(
    clouds: Floats, log_weight: Floats, share: float, *, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Partly resampled clouds (K, N, D) and the log weights (K, N) that are left to them.

    Particles are drawn by `weight^share` and keep `weight^(1 - share)`: improbable modes keep more particles than their
    weight would buy, and are still there when later evidence turns to them.
    """
    levels = cell_levels(clouds.shape[1])
    order = cell_order(clouds, levels)
    ordered = np.take_along_axis(log_weight, order, axis=1)
    drawn = normalised_rows(share * ordered)
    ancestors = systematic_rows(drawn, rng=rng)
    chosen = np.take_along_axis(clouds, np.take_along_axis(order, ancestors, axis=1)[..., None], axis=1)
    width = kernel_width(clouds.shape[1] >> levels, clouds.shape[2], effective_fraction(drawn))
    return smooth(chosen, width, levels, rng=rng), (1.0 - share) * np.take_along_axis(ordered, ancestors, axis=1)
