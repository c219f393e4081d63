"""Scan of ranges measured in one cycle, and how likely each range is a new feature's first."""

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
