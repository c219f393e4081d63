"""A scan, the ranges of one step, and how likely each is the first of a feature never seen."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.schemes.shared.ranges import RangeModel


class Scan(NamedTuple):
    """What one anchor (or the agent's own receiver) measured in a step."""

    length: Floats
    """(M,) ranges [m], in no particular order."""
    std: Floats
    """(M,) standard deviations [m]."""

    def take(self, rows: Integers) -> "Scan":
        """Some of the ranges of a scan."""
        return Scan(self.length[rows], self.std[rows])


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


def birth_ratio(scan: Scan, undetected: float, model: RangeModel, dims: int, odds: Odds) -> Floats:
    """(M,) expected density of first detections over that of clutter.

    `undetected` features are uniform over the region, whose measure is the integral of the model's shell.
    """
    inside = (scan.length > 0.0) & (scan.length <= odds.max_range)
    length = np.where(inside, scan.length, 0.5 * odds.max_range)
    region = model.shell(np.array(odds.max_range), dims) * odds.max_range / dims
    density = undetected * odds.detection_probability * model.shell(length, dims) / region
    return np.where(inside, density, 0.0) / odds.clutter_density
