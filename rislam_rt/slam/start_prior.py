"""Start prior: what the agent is told of its first position, velocity and heading."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats, freeze
from rislam_rt.ranges import NotNegative, check_ranges


@dataclass(frozen=True, slots=True, eq=False)
class StartPrior:
    """Gaussian prior of the agent's first position, velocity and heading, as it is told."""

    position: Floats
    """Mean (3,) [m] of the position."""
    velocity: Floats
    """Mean (3,) [m/s] of the velocity."""
    heading: float
    """Mean [rad] of the heading."""
    position_std: NotNegative = 0.01
    """Standard deviation [m] of the position along each axis; the height is exact when it is known."""
    velocity_std: NotNegative = 0.01
    """Standard deviation [m/s] of the velocity along each axis."""
    heading_std: NotNegative = 0.0
    """Standard deviation [rad] of the heading, where it is estimated."""

    def __post_init__(self) -> None:
        freeze(self, np.float64, position=(3,), velocity=(3,))
        check_ranges("start", self)
