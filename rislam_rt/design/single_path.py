"""The best code for one path: exact over discrete levels, and the references around it.

`|h_0 + sum_n h_n exp(-j 2 pi k_n / H)|` is largest for levels that are, each on its own, nearest to some common phase.
As that phase turns by one level spacing, every element changes its nearest level once, so N + 1 candidates remain (and
their H turns, if there is a direct term): arXiv 2211.04704; Pekcan and Ayanoglu.
"""

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers


def exact_code(response: Complexes, levels: int, direct: Complexes | complex = 0.0) -> tuple[Integers, Floats]:
    """Levels (..., N) that maximise the gain of responses (..., N), and that gain's magnitude (...,).

    `direct` (...,) is the part of the gain that does not pass the panel. O(N log N), vectorised over the batch.
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
    best, turn = _best_candidate(sums, np.asarray(direct, dtype=np.complex128), levels)
    passed = np.empty(response.shape, dtype=np.int64)
    np.put_along_axis(passed, rank_order, np.broadcast_to(np.arange(count), response.shape), axis=-1)
    index = (start.astype(np.int64) - (passed < best[..., None]) - turn[..., None]) % levels
    total = np.asarray(direct) + np.sum(response * np.exp(-1j * step * index), axis=-1)
    return index, np.abs(total)


def _best_candidate(sums: Complexes, direct: Complexes, levels: int) -> tuple[Integers, Integers]:
    """Which of the candidates (..., N + 1), and which of their H turns, is largest with the direct term added."""
    if not np.any(direct):
        best = np.argmax(sums.real**2 + sums.imag**2, axis=-1)
        return best, np.zeros_like(best)
    turned = sums[..., None] * np.exp(2j * np.pi / levels * np.arange(levels))
    total = direct[..., None, None] + turned
    flat = np.argmax((total.real**2 + total.imag**2).reshape(*sums.shape[:-1], -1), axis=-1)
    return flat // levels, flat % levels


def continuous_phases(response: Complexes, direct: Complexes | complex = 0.0) -> Floats:
    """Phases xi (..., N) [rad] that align every element with the direct term (with phase 0 if there is none)."""
    return np.angle(response) - np.angle(np.asarray(direct, dtype=np.complex128))[..., None]


def nearest_code(response: Complexes, levels: int, direct: Complexes | complex = 0.0) -> Integers:
    """`continuous_phases` rounded to the nearest level, element by element: (..., N)."""
    turns = continuous_phases(response, direct) * levels / (2.0 * np.pi)
    return np.floor(turns + 0.5).astype(np.int64) % levels
