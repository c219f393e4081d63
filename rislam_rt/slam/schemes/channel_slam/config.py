"""Configuration of Channel-SLAM by delays alone."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge

from rislam_rt.ranges import Chance, Count, Positive, check_ranges
from rislam_rt.slam.schemes.shared.delay_config import DelayConfig
from rislam_rt.slam.schemes.shared.ranges import Odds


@dataclass(frozen=True, slots=True)
class ChannelSlamConfig(DelayConfig):
    """Settings of Channel-SLAM, whose features are virtual transmitters: model and effort. SI units."""

    max_paths: Count = 32
    """Largest number of virtual transmitters at a time; the paths that were confirmed first have them."""
    outlier_probability: Chance = 0.01
    """Probability that a tracked range has nothing to do with its virtual transmitter, as after a swap of labels."""
    gate: Positive = 9.0
    """Largest squared normalised innovation of a range that still continues a track (chi^2, 1 dof: 0.997)."""
    range_acceleration: Positive = 0.03
    """Standard deviation of the drift of a track's range rate [m/s^2]."""
    confirm_hits: Count = 5
    """Number of ranges that a track needs before a virtual transmitter is born of it."""
    max_misses: Annotated[int, Ge(0)] = 5
    """Number of cycles without a range after which a track, and its virtual transmitter, is given up."""
    strain_limit: Positive = 4.0
    """Running mean of a path's squared normalised innovation above which its virtual transmitter starts anew."""
    shown_std: Positive = 0.5
    """Standard deviation [m] below which a virtual transmitter is shown on the map."""

    def __post_init__(self) -> None:
        check_ranges("channel_slam", self)

    @property
    def odds(self) -> Odds:
        """Configured odds of Channel-SLAM that a tracked range belongs to its virtual transmitter, by
        `outlier_probability`, over a metre."""
        return Odds(0.5, self.outlier_probability / (1.0 - self.outlier_probability), 1.0)
