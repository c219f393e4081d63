"""Optimal panel code for a single path: exact over discrete phase levels, continuous, or rounded to the nearest level.

`|sum_n h_n exp(-j 2 pi k_n / H)|` is largest for levels that are, each on its own, nearest to some common phase.
As that phase turns by one level spacing, every element changes its nearest level once, so N + 1 candidates remain:
arXiv 2211.04704; Pekcan and Ayanoglu.
"""

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers


def exact_code(response: Complexes, levels: int) -> tuple[Integers, Floats]:
    """Code for a single path: phase levels (..., N) that maximise the gain of element responses (..., N) exactly, and
    its magnitude (...,).

    O(N log N), vectorised over the batch.
    """
    step = 2.0 * np.pi / levels
    response = np.asarray(response, dtype=np.complex128)
    count = response.shape[-1]
    turns = np.angle(response) / step
    start = np.floor(turns + 0.5)
    rank_order = np.argsort(turns - 0.5 - np.floor(turns - 0.5), axis=-1)
    weighted = response * np.exp(-1j * step * start)
    sums = np.empty((*response.shape[:-1], count + 1), dtype=np.complex128)
    sums[..., 0] = weighted.sum(axis=-1)
    changes = np.take_along_axis(weighted, rank_order, axis=-1)
    np.cumsum(changes, axis=-1, out=sums[..., 1:])
    sums[..., 1:] *= np.exp(1j * step) - 1.0
    sums[..., 1:] += sums[..., :1]
    best = np.argmax(sums.real**2 + sums.imag**2, axis=-1)
    passed = np.empty(response.shape, dtype=np.int64)
    np.put_along_axis(passed, rank_order, np.broadcast_to(np.arange(count), response.shape), axis=-1)
    index = (start.astype(np.int64) - (passed < best[..., None])) % levels
    return index, np.abs(np.sum(response * np.exp(-1j * step * index), axis=-1))


def continuous_phases(response: Complexes) -> Floats:
    """Continuous phases xi (..., N) [rad] that align the responses of all elements."""
    return np.asarray(np.angle(response))


def nearest_code(response: Complexes, levels: int) -> Integers:
    """Phase levels (..., N) nearest to the aligning continuous phases, element by element."""
    turns = continuous_phases(response) * levels / (2.0 * np.pi)
    return np.floor(turns + 0.5).astype(np.int64) % levels
