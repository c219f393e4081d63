"""What the agent is told about its start."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats, freeze
from rislam_rt.errors import ConfigError


@dataclass(frozen=True, slots=True, eq=False)
class StartPrior:
    """What the agent is told about its first pose: a Gaussian about it."""

    position: Floats
    """(3,) [m]."""
    velocity: Floats
    """(3,) [m/s]."""
    heading: float
    """[rad]."""
    position_std: float = 0.01
    """[m], each axis; the height is exact when it is known."""
    velocity_std: float = 0.01
    """[m/s], each axis."""
    heading_std: float = 0.0
    """[rad], where the heading is estimated."""

    def __post_init__(self) -> None:
        freeze(self, "position", np.float64, (3,))
        freeze(self, "velocity", np.float64, (3,))
        for name in ("position_std", "velocity_std", "heading_std"):
            if not getattr(self, name) >= 0.0:
                raise ConfigError(f"start.{name}: {getattr(self, name)} received; give a number that is not negative")
