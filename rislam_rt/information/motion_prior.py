"""What a bound takes for known of the motion: the start, and white-noise acceleration from there on."""

from dataclasses import dataclass

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

    def __post_init__(self) -> None:
        for name in ("acceleration", "start_position", "start_velocity"):
            if not getattr(self, name) >= 0.0:
                raise ConfigError(f"motion.{name}: {getattr(self, name)} received; give a standard deviation")
        if self.axes not in (2, 3):
            raise ConfigError(f"motion.axes: {self.axes} received; give 2 or 3")
