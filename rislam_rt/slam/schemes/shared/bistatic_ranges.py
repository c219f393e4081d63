"""Bistatic ranges of a feature: lengths from Tx over the feature to Rx, which the agent carries both."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats


class Bistatic(NamedTuple):
    """Model of a feature's range, `|p_T - a| + |a - p_R|` of a feature at `a`, both ends carried by the agent."""

    tx: Floats
    """Tx (3,) [m] from the agent's position, turned by the heading."""
    rx: Floats
    """Rx (3,) [m] from the agent's position, turned by the heading."""


def length_of(vector: Floats) -> Floats:
    """Euclidean lengths (...,) of vectors (..., 3), without the temporaries of a norm."""
    square = vector[..., 0] ** 2
    for axis in range(1, vector.shape[-1]):
        square = square + vector[..., axis] ** 2
    return np.sqrt(square)
