"""A scan, the ranges of one step, and how likely each is the first of a feature never seen."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats


class Scan(NamedTuple):
    """What the receiver measured in a step."""

    length: Floats
    """(M,) ranges [m], in no particular order."""
    std: Floats
    """(M,) standard deviations [m]."""


class Odds(NamedTuple):
    """What a range is weighed against."""

    detection_probability: float
    """That a feature makes a range."""
    clutter_mean: float
    """False ranges a scan, Poisson..."""
    max_range: float
    """...uniform on (0, max_range] [m]."""

    @property
    def clutter_density(self) -> float:
        """Expected false ranges per metre."""
        return self.clutter_mean / self.max_range


def birth_ratio(length: Floats, undetected: float, odds: Odds) -> Floats:
    """(M,) expected density of first detections over that of clutter, for ranges (M,) [m].

    `undetected` features are uniform over the sphere of `odds.max_range`, or half of it; a range has its shell's share.
    """
    inside = (length > 0.0) & (length <= odds.max_range)
    shell = 4.0 * np.pi * np.where(inside, length, 0.5 * odds.max_range) ** 2
    region = 4.0 * np.pi * odds.max_range**2 * odds.max_range / 3
    density = undetected * odds.detection_probability * shell / region
    return np.where(inside, density, 0.0) / odds.clutter_density
