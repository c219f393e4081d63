"""Ranges of one cycle: measured ones, how likely each is a new feature's first, and the model of a bistatic range."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats


class Scan(NamedTuple):
    """Ranges that the receiver measured in one cycle."""

    length: Floats
    """Ranges (M,) [m], in no particular order."""
    std: Floats
    """Standard deviations (M,) [m] of the ranges."""


class Odds(NamedTuple):
    """Detection probability of features and density of false ranges, against which a range is weighed."""

    detection_probability: float
    """Probability that a feature makes a range in a cycle."""
    clutter_mean: float
    """Mean number of false ranges in a scan, Poisson."""
    max_range: float
    """Largest range [m]: false ones are uniform on (0, max_range]."""

    @property
    def clutter_density(self) -> float:
        """Expected false ranges per metre."""
        return self.clutter_mean / self.max_range


def birth_ratio(length: Floats, undetected: float, odds: Odds) -> Floats:
    """Expected density (M,) of new features' first detections over that of clutter, at ranges (M,) [m].

    `undetected` features are uniform over the sphere of `odds.max_range`, or half of it; a range has its shell's share.
    """
    inside = (length > 0.0) & (length <= odds.max_range)
    shell = 4.0 * np.pi * np.where(inside, length, 0.5 * odds.max_range) ** 2
    region = 4.0 * np.pi * odds.max_range**2 * odds.max_range / 3
    density = undetected * odds.detection_probability * shell / region
    return np.where(inside, density, 0.0) / odds.clutter_density


class Bistatic(NamedTuple):
    """Model of a feature's range, `|p_T - a| + |a - p_R|` of a feature at `a`, both ends carried by the agent."""

    tx: Floats
    """Tx (3,) [m] from the agent's position, turned by the heading."""
    rx: Floats
    """Rx (3,) [m] from the agent's position, turned by the heading."""


def length_of(vector: Floats) -> Floats:
    """Euclidean lengths (...,) of vectors (..., 3), for ranges, without the temporaries of a norm."""
    square = vector[..., 0] ** 2
    for axis in range(1, vector.shape[-1]):
        square = square + vector[..., axis] ** 2
    return np.sqrt(square)
