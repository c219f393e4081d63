"""Settings of Channel-SLAM."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError


@dataclass(frozen=True, slots=True)
class ChannelSlamConfig:
    """Model and effort. SI units."""

    birth_turns: int = 6
    """Gaussians of a new virtual transmitter over the turn about the walk, from horizontal to horizontal."""
    max_paths: int = 32
    """Virtual transmitters at a time; the paths that were confirmed first have them."""
    course_stride: int = 40
    """Cycles from one past state of the agent that is kept to the next."""
    wanderers: float = 0.5
    """Probability that a new virtual transmitter is not a point that stays."""
    drift_length_std: float = 0.003
    """Random walk of a wandering transmitter's distance in one step [m]."""
    drift_angle_std: float = 0.01
    """Random walk of the cosine of its angle off the walk in one step."""
    sigma_a: float = 0.01
    """Standard deviation of the white acceleration [m/s^2]."""
    height: str = "known"
    """`known` keeps the height and the vertical velocity of the start, `estimated` filters them."""
    specular_ratio: float | None = 0.35
    """Amplitude over that of free space of the same length, above which a component is a wall return; None: there are
    none."""
    planes: bool = True
    """Whether wall returns have virtual transmitters (images of the Tx, that move with it), or are set aside."""
    smallest_std: float = 0.003
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
    share_threshold: float = 1e-3
    """Share of a virtual transmitter's Gaussians below which one is dropped."""
    shown_std: float = 0.5
    """Standard deviation [m] below which a virtual transmitter is shown on the map."""
    num_samples: int = 32
    """Positions handed to the phase design."""

    def __post_init__(self) -> None:
        for name in ("birth_turns", "max_paths", "course_stride", "confirm_hits", "num_samples"):
            if getattr(self, name) < 1:
                raise ConfigError(f"channel_slam.{name}: {getattr(self, name)} received; give at least 1")
        if self.max_misses < 0:
            raise ConfigError(f"channel_slam.max_misses: {self.max_misses} received; give 0 or more")
        for name in ("sigma_a", "smallest_std", "gate", "range_acceleration", "strain_limit", "shown_std"):
            _check(name, getattr(self, name), np.inf, "a positive number")
        for name in ("share_threshold", "outlier_probability"):
            _check(name, getattr(self, name), 1.0, "a number in (0, 1)")
        for name in ("drift_length_std", "drift_angle_std"):
            if not 0.0 <= getattr(self, name) < np.inf:
                received = getattr(self, name)
                raise ConfigError(f"channel_slam.{name}: {received} received; give a number that is not negative")
        if not 0.0 <= self.wanderers < 1.0:
            raise ConfigError(f"channel_slam.wanderers: {self.wanderers} received; give a share below 1")
        if self.height not in ("known", "estimated"):
            raise ConfigError(f"channel_slam.height: '{self.height}' received; give 'known' or 'estimated'")
        if self.specular_ratio is not None:
            _check("specular_ratio", self.specular_ratio, np.inf, "a positive number, or none")

    @property
    def axes(self) -> Floats:
        """(3,) ones for the axes that are filtered."""
        return np.array([1.0, 1.0, 1.0 if self.height == "estimated" else 0.0])

    @property
    def weak_kinds(self) -> Floats:
        """(3,) probabilities of point, wall and wanderer for the transmitter of a weak path."""
        return np.array([1.0 - self.wanderers, 0.0, self.wanderers])

    @property
    def strong_kinds(self) -> Floats:
        """(3,) the same for a path as strong as a wall return; a corner of two walls returns like a point."""
        return np.array([0.2, 0.5, 0.3])

    @property
    def moving_detection(self) -> float:
        """A tracked range either belongs to its transmitter or not; with `clutter_density`, the odds of the two."""
        return 0.5

    @property
    def clutter_density(self) -> float:
        """Odds of `outlier_probability`, spread over a metre [1/m]."""
        return self.outlier_probability / (1.0 - self.outlier_probability)


def _check(name: str, value: float, below: float, wanted: str) -> None:
    if not (np.isfinite(value) and 0.0 < value < below):
        raise ConfigError(f"channel_slam.{name}: {value} received; give {wanted}")
