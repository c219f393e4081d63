"""Configuration of the nested filter: settings that it does not share with the default one."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.errors import ConfigError
from rislam_rt.slam.input_checks import check_counts, check_inside, check_named

WEIGHTINGS = ("crlb", "power", "paper")
"""Names of `nested.weighting`: amplitudes weigh by each component's bound, an exponent or the paper's common factor."""
ENGINES = ("auto", "drjit", "numpy")
"""Names of `nested.engine`: `auto` takes Dr.Jit where it runs, else numpy."""
CLASSIFIERS = ("amplitude", "geometric", "network")
"""Names of `nested.classifier`: rules that tell wall returns from landmark paths."""
MOST = {"num_agents": 1_000_000, "num_points": 1_000_000, "birth_cycles": 40}
"""Largest values: of particles ten times and more what any study of this package takes; of cycles, those kept."""


@dataclass(frozen=True, slots=True)
class NestedConfig:
    """Settings of the paper's nested particle filter, beside those that `SlamConfig` gives all filters. SI units."""

    num_agents: int = 2000
    """Number N of agent particles; the largest one where it is adapted."""
    num_points: int = 6000
    """Number M of landmark particles of each landmark and agent particle; the largest one where it is adapted."""
    adaptive: bool = True
    """Whether there are only as many particles as the spread of the belief needs (KLD-sampling)."""
    min_agents: int = 1000
    """Least number of agent particles, where it is adapted."""
    min_points: int = 256
    """Least number of landmark particles of each landmark and agent particle, where it is adapted."""
    agent_cell: float = 0.05
    """Edge [m] of a cell of KLD-sampling, in which agent particles count as alike."""
    point_cell: float = 0.05
    """Edge [m] of a cell of KLD-sampling, in which landmark particles count as alike."""
    weighting: str = "crlb"
    """How amplitudes weigh likelihoods: `crlb` (each component's deviations), `power` (exponent), `paper` (factor)."""
    common_length_std: float = 0.03
    """Standard deviation [m] of every component's length, whatever its amplitude, with `paper` and `power`."""
    common_cosine_std: float = 0.02
    """Standard deviation of every component's cosines, whatever its amplitude, with `paper` and `power`."""
    resample_below: float = 0.5
    """Fraction of the particles below which the effective sample size must not fall, agents and landmarks alike."""
    capacity: int = 150_000_000
    """Largest number of landmark particles in all: at most 20 bytes each, and the passes' own 0.5 GB."""
    engine: str = "auto"
    """Which engine weighs the particles: `drjit`, `numpy`, or `auto` for Dr.Jit if it runs."""
    specular_ratio: float = 0.35
    """Amplitude over that of free space of the same length, above which a component is classified as a wall return."""
    classifier: str = "amplitude"
    """What tells wall returns from landmark paths, where these are thrown away: `amplitude` (`specular_ratio`),
    `geometric`, or the trained `network`."""
    birth_cycles: int = 12
    """Number of measurements that a track needs before it can become a landmark."""

    def __post_init__(self) -> None:
        check_named("nested", self, {"weighting": WEIGHTINGS, "engine": ENGINES, "classifier": CLASSIFIERS})
        check_counts("nested", self, ("num_agents", "num_points", "min_agents", "min_points", "capacity"), 4)
        check_counts("nested", self, ("birth_cycles",))
        for name, most in MOST.items():
            if getattr(self, name) > most:
                raise ConfigError(f"nested.{name}: {getattr(self, name)} received; give at most {most}")
        positive = ("agent_cell", "point_cell", "common_length_std", "common_cosine_std", "specular_ratio")
        check_inside("nested", self, positive, np.inf, "a positive number")
        if not 0.0 < self.resample_below <= 1.0:
            raise ConfigError(f"nested.resample_below: {self.resample_below} received; give a number in (0, 1]")
