"""What a bound takes for known of the motion: the start, and white-noise acceleration from there on."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError


@dataclass(frozen=True, slots=True)
class MotionPrior:
    """What a bound takes for known of the motion: white-noise acceleration, and the start; deviations per axis."""

    acceleration: float = 0.01
    """sigma_a [m/s^2]."""
    start_position: float = 0.01
    """[m]."""
    start_velocity: float = 0.01
    """[m/s]."""
    axes: int = 2
    """2: height known, the agent moves in a horizontal plane; 3: all of it unknown."""
    climb: float | None = None
    """sigma_a upwards [m/s^2] of an agent whose height and climb are known at the start alone (3 axes); None: as in the
    other directions."""

    def __post_init__(self) -> None:
        for name in ("acceleration", "start_position", "start_velocity"):
            if not getattr(self, name) >= 0.0:
                raise ConfigError(f"motion.{name}: {getattr(self, name)} received; give a standard deviation")
        if self.axes not in (2, 3):
            raise ConfigError(f"motion.axes: {self.axes} received; give 2 or 3")
        if self.climb is not None and (self.axes != 3 or not self.climb >= 0.0):
            raise ConfigError(f"motion.climb: {self.climb} received; give a standard deviation, with 3 axes")

    @property
    def accelerations(self) -> Floats:
        """(axes,) sigma_a of each axis [m/s^2]."""
        sigma = np.full(self.axes, self.acceleration)
        if self.climb is not None:
            sigma[2] = self.climb
        return sigma

    @property
    def start(self) -> Floats:
        """(2 axes,) deviations of position and velocity at the start [m, m/s]."""
        std = np.repeat([self.start_position, self.start_velocity], self.axes)
        if self.climb is not None:
            std[[2, 5]] = 0.0
        return std
