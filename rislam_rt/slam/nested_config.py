"""Configuration of the nested filter: settings that it does not share with the default one."""

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Ge, Le

from rislam_rt.ranges import Positive, Share, check_ranges

Particles = Annotated[int, Ge(4), Le(1_000_000)]
"""Number of particles, at most ten times and more what any study of this package takes."""


@dataclass(frozen=True, slots=True)
class NestedConfig:
    """Settings of the paper's nested particle filter, beside those that `SlamConfig` gives all filters. SI units."""

    num_agents: Particles = 2000
    """Number N of agent particles; the largest one where it is adapted."""
    num_points: Particles = 6000
    """Number M of landmark particles of each landmark and agent particle; the largest one where it is adapted."""
    adaptive: bool = True
    """Whether there are only as many particles as the spread of the belief needs (KLD-sampling)."""
    min_agents: Annotated[int, Ge(4)] = 1000
    """Least number of agent particles, where it is adapted."""
    min_points: Annotated[int, Ge(4)] = 256
    """Least number of landmark particles of each landmark and agent particle, where it is adapted."""
    agent_cell: Positive = 0.05
    """Edge [m] of a cell of KLD-sampling, in which agent particles count as alike."""
    point_cell: Positive = 0.05
    """Edge [m] of a cell of KLD-sampling, in which landmark particles count as alike."""
    weighting: Literal["crlb", "power", "paper"] = "crlb"
    """How amplitudes weigh likelihoods: `crlb` (each component's deviations), `power` (exponent), `paper` (factor)."""
    common_length_std: Positive = 0.03
    """Standard deviation [m] of every component's length, whatever its amplitude, with `paper` and `power`."""
    common_cosine_std: Positive = 0.02
    """Standard deviation of every component's cosines, whatever its amplitude, with `paper` and `power`."""
    resample_below: Share = 0.5
    """Fraction of the particles below which the effective sample size must not fall, agents and landmarks alike."""
    capacity: Annotated[int, Ge(4)] = 150_000_000
    """Largest number of landmark particles in all: at most 20 bytes each, and the passes' own 0.5 GB."""
    engine: Literal["auto", "drjit", "numpy"] = "auto"
    """Which engine weighs the particles: `drjit`, `numpy`, or `auto` for Dr.Jit if it runs."""
    specular_ratio: Positive = 0.35
    """Amplitude over that of free space of the same length, above which a component is classified as a wall return."""
    classifier: Literal["amplitude", "geometric", "network"] = "amplitude"
    """What tells wall returns from landmark paths, where these are thrown away: `amplitude` (`specular_ratio`),
    `geometric`, or the trained `network`."""
    birth_cycles: Annotated[int, Ge(1), Le(40)] = 12
    """Number of measurements that a track needs before it can become a landmark, of the 40 that are kept."""

    def __post_init__(self) -> None:
        check_ranges("nested", self)
