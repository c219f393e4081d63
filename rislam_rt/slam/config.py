"""Configuration of the SLAM filter: the settings `[slam]`."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.slam.input_checks import check_inside, check_named, check_not_negative
from rislam_rt.slam.nested_config import NestedConfig

FILTERS = ("window", "nested")
"""Names that `slam.filter` takes: filters with the same inputs and outputs."""
DEFAULT_NESTED = NestedConfig()
"""Default settings of the nested filter; frozen, so that all settings may share them."""
MAX_SAMPLES = 10_000
"""Largest number of positions for the phase design: ten times and more what any study of this package takes."""


@dataclass(frozen=True, slots=True)
class SlamConfig:
    """Settings of the SLAM filter, which localises the agent and maps the room. SI units."""

    filter: str = "window"
    """Which filter localises and maps: `window` or the paper's `nested` particle filter; same inputs, same outputs."""
    sigma_a: float = 0.01
    """Standard deviation of the white acceleration [m/s^2]."""
    motion: str = "learnt"
    """Motion model: `learnt` estimates the acceleration of each step, from `sigma_a` as a first value; `told` is white
    acceleration of `sigma_a`. Of the default filter; the others are always told."""
    use_vt: bool = True
    """Whether wall returns (virtual transmitters) join the map as planes, or are thrown away as in the paper."""
    heading: str = "known"
    """How the heading is found: `known` by a compass, `estimated`, or, in the nested filter, along the `velocity`."""
    turn_std: float = 0.01
    """Random walk of an estimated heading [rad/sqrt(s)]."""
    height: str = "known"
    """`known` keeps the height and the vertical velocity of the start, `estimated` filters them; the default filter
    takes them for exact at the start alone."""
    max_bounces: int = 2
    """Largest number of wall bounces, both legs together, of a landmark path that the agent looks for."""
    new_density: float = 0.016
    """Expected components of paths that the map lacks, per metre of length, unit of each cosine, and e-fold of
    amplitude; false ones come on top, as many as the agent is told of its receiver."""
    num_samples: int = 32
    """Number of equally likely positions handed to the phase design."""
    nested: NestedConfig = DEFAULT_NESTED
    """Settings that the filter `nested` alone takes."""

    def __post_init__(self) -> None:
        states = ("known", "estimated")
        choices = {"filter": FILTERS, "heading": (*states, "velocity"), "motion": ("learnt", "told"), "height": states}
        check_named("slam", self, choices)
        if self.filter == "window" and self.heading == "velocity":
            raise ConfigError("slam.heading: 'velocity' received; the filter 'window' takes 'known' or 'estimated'")
        if not 1 <= self.num_samples <= MAX_SAMPLES:
            raise ConfigError(f"slam.num_samples: {self.num_samples} received; give 1 to {MAX_SAMPLES}")
        check_inside("slam", self, ("sigma_a", "new_density"), np.inf, "a positive number")
        check_not_negative("slam", self, ("turn_std",))
        if not 0 <= self.max_bounces <= 2:
            raise ConfigError(f"slam.max_bounces: {self.max_bounces} received; give 0, 1 or 2")

    @property
    def axes(self) -> Floats:
        """Ones (3,) for the position's axes that the SLAM filter is configured to estimate, zero for a known height."""
        return np.array([1.0, 1.0, 1.0 if self.height == "estimated" else 0.0])
