"""Configuration of the filter, and what the agent is told about its start."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.slam.nested_config import NestedConfig
from rislam_rt.slam.setting_checks import check_inside, check_named, check_not_negative

FILTERS = ("window", "nested")
"""Filters with the same inputs and outputs."""
DEFAULT_NESTED = NestedConfig()
"""Frozen, so that all settings may share it."""
MAX_SAMPLES = 10_000
"""Of positions for the design: ten times and more what any study of this package takes."""


@dataclass(frozen=True, slots=True)
class SlamConfig:
    """Everything that the filter is free to choose. SI units."""

    filter: str = "window"
    """Who localises and maps: the default, or the paper's `nested` particle filter; same inputs, same outputs."""
    sigma_a: float = 0.01
    """Standard deviation of the white acceleration [m/s^2]."""
    motion: str = "learnt"
    """`learnt`: how lively each step is, `sigma_a` being a first guess; `told`: white acceleration of `sigma_a`. Of the
    default filter; others are told."""
    use_vt: bool = True
    """Whether wall returns (virtual transmitters) join the map as planes, or are thrown away as in the paper."""
    heading: str = "known"
    """`known` by a compass or `estimated`; of the nested filter also along the `velocity`."""
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
    """Positions handed to the phase design."""
    nested: NestedConfig = DEFAULT_NESTED
    """What only the filter `nested` takes."""

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
        """(3,) ones for the axes that are filtered."""
        return np.array([1.0, 1.0, 1.0 if self.height == "estimated" else 0.0])
