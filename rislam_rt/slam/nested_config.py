"""Settings of the nested filter that it does not share with the default one."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.errors import ConfigError
from rislam_rt.slam.setting_checks import check_counts, check_inside, check_named

WEIGHTINGS = ("crlb", "power", "paper")
"""How an amplitude counts: its own standard deviations through the bound, an exponent, or the paper's common factor."""
ENGINES = ("auto", "drjit", "numpy")
"""`auto` takes Dr.Jit where it runs, else numpy."""
CLASSIFIERS = ("amplitude", "geometric", "network")
"""Rules by which components are taken for wall returns."""
MOST = {"num_agents": 1_000_000, "num_points": 1_000_000, "birth_cycles": 40}
"""Largest counts: of particles ten times and more what any study of this package takes; of cycles, those kept."""


@dataclass(frozen=True, slots=True)
class NestedConfig:
    """What the nested filter is free to choose, beside what `SlamConfig` says to both filters. SI units."""

    num_agents: int = 2000
    """N, agent particles: the most of them where their number is adapted."""
    num_points: int = 6000
    """M, landmark particles of each landmark and agent particle: the most of them where their number is adapted."""
    adaptive: bool = True
    """Whether there are only as many particles as the spread of the belief needs (KLD-sampling)."""
    min_agents: int = 1000
    """Least number of agent particles, where it is adapted."""
    min_points: int = 256
    """The same of landmark particles."""
    agent_cell: float = 0.05
    """Edge [m] of a cell in which agent particles count as alike."""
    point_cell: float = 0.05
    """The same for landmark particles."""
    weighting: str = "crlb"
    """How amplitudes count: `crlb`, `power`, or `paper`."""
    common_length_std: float = 0.03
    """[m] of the length, which `paper` and `power` take for every component, whatever its amplitude..."""
    common_cosine_std: float = 0.02
    """...and of either cosine."""
    resample_below: float = 0.5
    """Fraction of the particles below which the effective sample size must not fall, agents and landmarks alike."""
    capacity: int = 150_000_000
    """Most landmark particles in all: at most 20 bytes each, and the passes' own 0.5 GB."""
    engine: str = "auto"
    """Where the heavy passes run: `drjit`, `numpy`, or `auto` for Dr.Jit if it can."""
    specular_ratio: float = 0.35
    """Amplitude over that of free space of the same length, above which a component is a wall return."""
    classifier: str = "amplitude"
    """Who tells wall returns from landmark paths, where these are thrown away: the rule above, `geometric`, or the
    trained `network`."""
    birth_cycles: int = 12
    """Measurements that a track needs before a landmark can come of it."""

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
