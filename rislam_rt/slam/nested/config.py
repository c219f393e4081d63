"""Settings of the nested filter."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.errors import ConfigError

WEIGHTINGS = ("crlb", "power", "paper")
"""How an amplitude counts: its own standard deviations through the bound, an exponent, or the paper's common factor."""
ENGINES = ("auto", "drjit", "numpy")
"""`auto` takes Dr.Jit where it runs, else numpy."""


@dataclass(frozen=True, slots=True)
class NestedConfig:
    """Everything that the nested filter is free to choose. SI units."""

    num_agents: int = 2000
    """N, agent particles: the most of them where their number is adapted."""
    num_points: int = 6000
    """M, landmark particles of each landmark and agent particle: the most of them where their number is adapted."""
    adaptive: bool = True
    """Whether there are only as many particles as the spread of the belief needs (KLD-sampling)."""
    min_agents: int = 1000
    min_points: int = 256
    agent_cell: float = 0.05
    """Edge [m] of a cell in which agent particles count as alike."""
    point_cell: float = 0.05
    """The same for landmark particles."""
    weighting: str = "crlb"
    common_std: tuple[float, float] = (0.03, 0.02)
    """Length [m] and cosine: what `paper` and `power` take for every component, whatever its amplitude."""
    resample_below: float = 0.5
    """Fraction of the particles below which the effective sample size must not fall, agents and landmarks alike."""
    capacity: int = 150_000_000
    """Most landmark particles in all: at most 20 bytes each, and the passes' own 0.5 GB."""
    engine: str = "auto"

    def __post_init__(self) -> None:
        for name, value, allowed in (("weighting", self.weighting, WEIGHTINGS), ("engine", self.engine, ENGINES)):
            if value not in allowed:
                raise ConfigError(f"nested.{name}: '{value}' received; give one of {', '.join(allowed)}")
        for name in ("num_agents", "num_points", "min_agents", "min_points", "capacity"):
            if getattr(self, name) < 4:
                raise ConfigError(f"nested.{name}: {getattr(self, name)} received; give at least 4")
        for name, number in (
            ("agent_cell", self.agent_cell),
            ("point_cell", self.point_cell),
            ("common_std", min(self.common_std)),
        ):
            if not (np.isfinite(number) and number > 0.0):
                raise ConfigError(f"nested.{name}: {number} received; give a positive number")
        if not 0.0 < self.resample_below <= 1.0:
            raise ConfigError(f"nested.resample_below: {self.resample_below} received; give a number in (0, 1]")


PAPER_SCALE = NestedConfig(adaptive=False)
"""2000 agent particles, 6000 particles of every landmark for each of them."""
