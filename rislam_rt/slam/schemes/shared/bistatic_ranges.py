"""Ranges of a feature that the agent hears over two ends, which it carries."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats


class Bistatic(NamedTuple):
    """The range of a feature `a` is `|p_T - a| + |a - p_R|`, both ends carried by the agent."""

    tx: Floats
    """(3,) [m] Tx from the agent's position, turned by the heading."""
    rx: Floats
    """(3,) [m]."""


def length_of(vector: Floats) -> Floats:
    """Euclidean lengths (...,) of vectors (..., 3), without the temporaries of a norm."""
    square = vector[..., 0] ** 2
    for axis in range(1, vector.shape[-1]):
        square = square + vector[..., axis] ** 2
    return np.sqrt(square)
