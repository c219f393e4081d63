"""Configuration of Channel-SLAM."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.slam.schemes.shared.checks import check_counts, check_height, check_inside, check_not_negative
from rislam_rt.slam.schemes.shared.scan import Odds
from rislam_rt.slam.schemes.shared.sums import axes_filtered


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
        name = "channel_slam"
        check_counts(name, self, ("birth_turns", "max_paths", "course_stride", "confirm_hits", "num_samples"))
        check_counts(name, self, ("max_misses",), 0)
        positive = ("sigma_a", "smallest_std", "gate", "range_acceleration", "strain_limit", "shown_std")
        check_inside(name, self, positive, np.inf, "a positive number")
        check_inside(name, self, ("share_threshold", "outlier_probability"), 1.0, "a number in (0, 1)")
        check_not_negative(name, self, ("drift_length_std", "drift_angle_std"))
        if not 0.0 <= self.wanderers < 1.0:
            raise ConfigError(f"{name}.wanderers: {self.wanderers} received; give a share below 1")
        check_height(name, self.height)
        check_inside(name, self, ("specular_ratio",), np.inf, "a positive number, or none")

    @property
    def axes(self) -> Floats:
        """(3,) ones for the axes that Channel-SLAM filters."""
        return axes_filtered(self.height)

    @property
    def odds(self) -> Odds:
        """A tracked range either belongs to its transmitter or not: the odds of `outlier_probability`, over a metre."""
        return Odds(0.5, self.outlier_probability / (1.0 - self.outlier_probability), 1.0)
