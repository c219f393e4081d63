"""Settings of Channel-SLAM."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError


@dataclass(frozen=True, slots=True)
class ChannelSlamConfig:
    """Model and effort. SI units."""

    num_particles: int = 100
    """Of the agent."""
    num_directions: int = 48
    """Gaussians over which a new virtual transmitter is spread, on the half sphere about the agent."""
    sigma_a: float = 0.01
    """Standard deviation of the white acceleration [m/s^2]."""
    height: str = "known"
    """`known` keeps the height and the vertical velocity of the start, `estimated` filters them."""
    specular_ratio: float | None = 0.35
    """Amplitude over that of free space of the same length, above which a component is a wall return and is set aside;
    None keeps all."""
    smallest_std: float = 0.005
    """Smallest standard deviation of a range that is believed [m]."""
    outlier_probability: float = 0.01
    """Probability that a tracked range has nothing to do with its virtual transmitter, as after a swap of labels."""
    gate: float = 9.0
    """Largest squared normalised innovation of a range that still continues a track (chi^2, 1 dof: 0.997)."""
    range_acceleration: float = 0.03
    """Standard deviation of the drift of a track's range rate [m/s^2]."""
    confirm_hits: int = 5
    """Ranges that a track needs before a virtual transmitter is born of it."""
    max_misses: int = 5
    """Cycles without a range after which a track, and its virtual transmitter, is given up."""
    strain_limit: float = 4.0
    """Running mean of a path's squared normalised innovation above which its virtual transmitter starts anew."""
    prune_weight: float = 5e-3
    """Share of a virtual transmitter's Gaussians below which one is dropped."""
    resample_below: float = 0.5
    """Fraction of the particles that the effective sample size must not fall below."""
    shown_std: float = 0.5
    """Standard deviation [m] below which a virtual transmitter is shown on the map."""
    num_samples: int = 32
    """Positions handed to the phase design."""

    def __post_init__(self) -> None:
        for name in ("num_particles", "num_directions", "confirm_hits", "num_samples"):
            if getattr(self, name) < 1:
                raise ConfigError(f"channel_slam.{name}: {getattr(self, name)} received; give at least 1")
        if self.max_misses < 0:
            raise ConfigError(f"channel_slam.max_misses: {self.max_misses} received; give 0 or more")
        for name in ("sigma_a", "smallest_std", "gate", "range_acceleration", "strain_limit", "shown_std"):
            _check(name, getattr(self, name), np.inf, "a positive number")
        for name in ("prune_weight", "outlier_probability"):
            _check(name, getattr(self, name), 1.0, "a number in (0, 1)")
        _check("resample_below", self.resample_below, 1.0 + 1e-12, "a number in (0, 1]")
        if self.height not in ("known", "estimated"):
            raise ConfigError(f"channel_slam.height: '{self.height}' received; give 'known' or 'estimated'")
        if self.specular_ratio is not None:
            _check("specular_ratio", self.specular_ratio, np.inf, "a positive number, or none")

    @property
    def axes(self) -> Floats:
        """(3,) ones for the axes that are filtered."""
        return np.array([1.0, 1.0, 1.0 if self.height == "estimated" else 0.0])


def _check(name: str, value: float, below: float, wanted: str) -> None:
    if not (np.isfinite(value) and 0.0 < value < below):
        raise ConfigError(f"channel_slam.{name}: {value} received; give {wanted}")
