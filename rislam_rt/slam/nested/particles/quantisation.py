"""Quantisation of points as 21-bit numbers, three in 8 bytes: passes over particles wait for memory, not arithmetic.

A step is one millionth of a block's largest offset, as fine as single precision is there: x in the upper 21 bits of the
first word, y in those of the second, and z in what both have left, its upper 11 bits in the first word.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from rislam_rt.arrays import Floats

TOP = 2**20 - 1
"""Largest quantised coordinate, in steps."""
WORDS = 2
"""Number of 32-bit words of a quantised point."""
LOW = 2**11 - 1
"""Mask of the 11 bits of a word that x and y leave to z."""
FINEST = 1e-12
"""Least quantisation step [m]."""

Words = npt.NDArray[np.uint32]
"""Arrays of 32-bit words."""


class Quantisation(NamedTuple):
    """Quantised points of a landmark's cloud."""

    words: Any
    """Blocks of M points, two words each."""
    step: Floats
    """Quantisation step (B,) [m] of each block."""


def steps(reach: Floats) -> Floats:
    """Quantisation steps [m] that hold offsets up to `reach` [m]."""
    return np.maximum(reach / TOP, FINEST)


def encode(points: Floats, step: Floats) -> Words:
    """Quantised words (B, M, 2) of points (B, M, 3), with a step [m] for each block (B,)."""
    whole = np.clip(np.rint(points / step[:, None, None]), -TOP, TOP).astype(np.int32).view(np.uint32)
    first, second = join(whole[..., 0], whole[..., 1], whole[..., 2])
    return np.stack([first, second], axis=-1).astype(np.uint32)


def decode(words: Words, step: Floats) -> Floats:
    """Points (B, M, 3) [m] of quantised words; undoes `encode`."""
    parts = split(words[..., 0], words[..., 1])
    return np.stack([part.astype(np.uint32).view(np.int32) >> 11 for part in parts], axis=-1) * step[:, None, None]


def join(x: Any, y: Any, z: Any) -> tuple[Any, Any]:
    """Pack three signed coordinates of 21 bits into two 32-bit words, in arithmetic for numpy and Dr.Jit alike."""
    return (x << 11) | ((z >> 10) & LOW), (y << 11) | ((z & 1023) << 1)


def split(first: Any, second: Any) -> tuple[Any, Any, Any]:
    """Unpack two 32-bit words into three coordinates in the upper 21 bits of a word; a shift of 11 drops the rest."""
    return first, second, (first << 21) | ((second & LOW) << 10)
