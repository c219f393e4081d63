"""Start prior: what the agent is told of its first position, velocity and heading."""

from dataclasses import dataclass, replace

import numpy as np

from rislam_rt.arrays import Floats, freeze
from rislam_rt.constants import MAX_START_HEADING
from rislam_rt.errors import ConfigError
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
        if not abs(self.heading) <= MAX_START_HEADING:
            raise ConfigError(
                f"start.heading: {self.heading:g} rad received; give radians, not degrees: np.radians(...)"
            )


def heading_from_velocity(start: StartPrior) -> StartPrior:
    """Start prior whose heading, of which nothing was given, is the direction of its velocity, as of an agent that
    looks where it goes.

    One error turns both, while the prior has them independent, and a filter that hears how the agent moves in its own
    frame would learn the turn from either. So each counts half (covariance intersection: Julier and Uhlmann 1997): with
    `a = atan(velocity_std / speed)` [rad] of the horizontal speed [m/s], the heading's deviation becomes
    `hypot(heading_std, sqrt(2) a)`, the velocity's `sqrt(2) velocity_std`; together they know the turn to `a`.

    Raises
    ------
    ConfigError
        The speed is not above its own deviation: its direction says nothing.
    """
    speed, std = float(np.hypot(*start.velocity[:2])), start.velocity_std
    if speed <= std:
        raise ConfigError(
            f"start: no heading, and a speed of {speed:g} m/s known to {std:g} m/s has no direction; give --heading DEG"
        )
    heading = float(np.arctan2(start.velocity[1], start.velocity[0]))
    heading_std = float(np.hypot(start.heading_std, np.sqrt(2.0) * np.arctan(std / speed)))
    return replace(start, heading=heading, heading_std=heading_std, velocity_std=float(np.sqrt(2.0)) * std)
