"""Motion prior of a bound: standard deviations of the start, and white-noise acceleration from there on."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError


@dataclass(frozen=True, slots=True)
class MotionPrior:
    """Prior of a bound on the agent's motion: standard deviations per axis of acceleration noise and of the start."""

    acceleration: float = 0.01
    """Standard deviation sigma_a [m/s^2] of the white-noise acceleration."""
    start_position: float = 0.01
    """Standard deviation [m] of the start position."""
    start_velocity: float = 0.01
    """Standard deviation [m/s] of the start velocity."""
    axes: int = 2
    """Number of unknown axes: 2, height known, the agent moves in a horizontal plane; 3, height unknown too."""
    climb: float | None = None
    """Vertical sigma_a [m/s^2] of an agent whose height and climb are known at the start alone (3 axes); None: as in
    the other directions."""

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
        """Standard deviations (axes,) [m/s^2] of the white-noise acceleration of each axis."""
        sigma = np.full(self.axes, self.acceleration)
        if self.climb is not None:
            sigma[2] = self.climb
        return sigma

    @property
    def start(self) -> Floats:
        """Standard deviations (2 axes,) of position and velocity at the start [m, m/s]."""
        std = np.repeat([self.start_position, self.start_velocity], self.axes)
        if self.climb is not None:
            std[[2, 5]] = 0.0
        return std
