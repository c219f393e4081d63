"""Settings of the nested filter that it does not share with the default one."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.errors import ConfigError

WEIGHTINGS = ("crlb", "power", "paper")
"""How an amplitude counts: its own standard deviations through the bound, an exponent, or the paper's common factor."""
ENGINES = ("auto", "drjit", "numpy")
"""`auto` takes Dr.Jit where it runs, else numpy."""
CLASSIFIERS = ("amplitude", "geometric", "network")
"""Rules by which components are taken for wall returns."""
MOST = {"num_agents": 1_000_000, "num_points": 1_000_000, "window": 10_000}
"""Largest counts: ten times and more what any study of this package takes."""


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
    gate: float = 16.3
    """Largest squared Mahalanobis distance of delay and two cosines that still associates (chi^2, 3 dof: 0.999)."""
    specular_ratio: float = 0.35
    """Amplitude over that of free space of the same length, above which a component is a wall return."""
    classifier: str = "amplitude"
    """Who tells wall returns from landmark paths: the rule above, `geometric`, or the trained `network`."""
    window: int = 40
    """Cycles of history that are kept."""
    birth_cycles: int = 12
    """Cycles of history that a track needs before a landmark can come of it, two in three of them with a measurement;
    all of them where the panel's codes may make the gaps."""
    birth_margin: float = 9.0
    """By how much chi^2 a hypothesis must win over the next one."""
    max_misses: int = 4
    """Cycles without a component after which a track dies, unless its past lets expect longer gaps."""
    merge_distance: float = 9.0
    """Squared Mahalanobis distance below which two landmarks are one."""

    def __post_init__(self) -> None:
        for name, value, allowed in (
            ("weighting", self.weighting, WEIGHTINGS),
            ("engine", self.engine, ENGINES),
            ("classifier", self.classifier, CLASSIFIERS),
        ):
            if value not in allowed:
                raise ConfigError(f"nested.{name}: '{value}' received; give one of {', '.join(allowed)}")
        for name in ("num_agents", "num_points", "min_agents", "min_points", "capacity"):
            if getattr(self, name) < 4:
                raise ConfigError(f"nested.{name}: {getattr(self, name)} received; give at least 4")
        for name in ("birth_cycles", "window", "max_misses"):
            if getattr(self, name) < 1:
                raise ConfigError(f"nested.{name}: {getattr(self, name)} received; give at least 1")
        for name, most in MOST.items():
            if getattr(self, name) > most:
                raise ConfigError(f"nested.{name}: {getattr(self, name)} received; give at most {most}")
        if self.window < self.birth_cycles:
            raise ConfigError(f"nested.window: {self.window} received; give at least birth_cycles, {self.birth_cycles}")
        for name in ("agent_cell", "point_cell", "common_length_std", "common_cosine_std", "gate", "specular_ratio",
                     "birth_margin", "merge_distance"):  # fmt: skip
            number = getattr(self, name)
            if not (np.isfinite(number) and number > 0.0):
                raise ConfigError(f"nested.{name}: {number} received; give a positive number")
        if not 0.0 < self.resample_below <= 1.0:
            raise ConfigError(f"nested.resample_below: {self.resample_below} received; give a number in (0, 1]")
