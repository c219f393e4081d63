"""Configuration of the SLAM filter: the settings `[slam]`."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Le

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.ranges import NotNegative, Positive, check_ranges
from rislam_rt.slam.nested_config import NestedConfig

DEFAULT_NESTED = NestedConfig()
"""Default settings of the nested filter; frozen, so that all settings may share them."""


@dataclass(frozen=True, slots=True)
class SlamConfig:
    """Settings of the SLAM filter, which localises the agent and maps the room. SI units."""

    filter: Literal["window", "nested"] = "window"
    """Which filter localises and maps: `window` or the paper's `nested` particle filter; same inputs, same outputs."""
    sigma_a: Positive = 0.01
    """Standard deviation of the white acceleration [m/s^2]."""
    motion: Literal["learnt", "told"] = "learnt"
    """Motion model: `learnt` estimates the acceleration of each step, from `sigma_a` as a first value; `told` is white
    acceleration of `sigma_a`. Of the default filter; the others are always told."""
    use_vt: bool = True
    """Whether wall returns (virtual transmitters) join the map as planes, or are thrown away as in the paper."""
    heading: Literal["known", "estimated", "velocity"] = "known"
    """How the heading is found: `known` by a compass, `estimated`, or, in the nested filter, along the `velocity`."""
    turn_std: NotNegative = 0.01
    """Random walk of an estimated heading [rad/sqrt(s)]."""
    height: Literal["known", "estimated"] = "known"
    """How well the start's height and vertical velocity are known: `known`, exactly; `estimated`, within the start's
    deviations. The default filter follows climbs with either, unless the motion is told and the height known; the other
    filters keep a known height for good."""
    max_bounces: Annotated[int, Ge(0), Le(2)] = 2
    """Largest number of wall bounces, both legs together, of a landmark path that the agent looks for."""
    new_density: Positive = 0.016
    """Expected components of paths that the map lacks, per metre of length, unit of each cosine, and e-fold of
    amplitude; false ones come on top, as many as the agent is told of its receiver."""
    num_samples: Annotated[int, Ge(1), Le(10_000)] = 32
    """Number of equally likely positions handed to the phase design; no study of this package takes a tenth of the
    most."""
    nested: NestedConfig = DEFAULT_NESTED
    """Settings that the filter `nested` alone takes."""

    def __post_init__(self) -> None:
        check_ranges("slam", self)
        if self.filter == "window" and self.heading == "velocity":
            raise ConfigError("slam.heading: 'velocity' received; the filter 'window' takes 'known' or 'estimated'")

    @property
    def axes(self) -> Floats:
        """Ones (3,) for the position's axes that the SLAM filter is configured to estimate, zero for a known height."""
        return np.array([1.0, 1.0, 1.0 if self.height == "estimated" else 0.0])
