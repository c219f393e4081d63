"""Configuration of BP-SLAM by delays, both ends moving."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.slam.schemes.shared.checks import check_counts, check_height, check_inside, check_not_negative
from rislam_rt.slam.schemes.shared.sums import axes_filtered


@dataclass(frozen=True, slots=True)
class BpSlamConfig:
    """Model and effort. SI units."""

    sigma_a: float = 0.0033
    """Standard deviation of the white acceleration [m/s^2]."""
    height: str = "known"
    """`known` keeps the height and the vertical velocity of the start, `estimated` filters them."""
    detection_probability: float = 0.7
    """That a feature is measured; the panel's paths fade with its codes."""
    survival_probability: float = 0.999
    """That a feature is still there after one step."""
    initial_features: float = 6.0
    """Features expected in the region before the first scan, Poisson."""
    birth_mean: float = 0.01
    """Features that appear in the region in one step, Poisson."""
    birth_threshold: float = 1e-3
    """Probability above which a range starts a feature."""
    birth_turns: int = 6
    """Gaussians of a new feature over the turn about the walk, from horizontal to horizontal."""
    specular_ratio: float | None = 0.35
    """Amplitude over that of free space of the same length, above which a component is a wall return; None: there are
    none."""
    planes: bool = True
    """Whether wall returns are features (walls), or set aside."""
    wanderers: float = 0.5
    """Probability that a new weak feature is not a point that stays."""
    drift_length_std: float = 0.003
    """Random walk of a wandering feature's distance in one step [m]."""
    drift_angle_std: float = 0.01
    """Random walk of the cosine of its angle off the walk in one step."""
    smallest_std: float = 0.003
    """Smallest standard deviation of a range that is believed [m]."""
    detection_threshold: float = 0.5
    """Existence probability above which a potential feature counts as detected."""
    pruning_threshold: float = 1e-4
    """Existence probability below which a potential feature is dropped."""
    share_threshold: float = 1e-3
    """Share below which a Gaussian of a feature is dropped."""
    max_features: int = 60
    """Potential features that are kept, the most probable ones."""
    course_stride: int = 40
    """Cycles from one past state of the agent that is kept to the next."""
    num_samples: int = 32
    """Positions handed to the phase design."""

    def __post_init__(self) -> None:
        name, share = "bp_slam", "a number in (0, 1]"
        check_counts(name, self, ("max_features", "num_samples", "course_stride", "birth_turns"))
        positive = ("sigma_a", "initial_features", "birth_mean", "smallest_std")
        check_inside(name, self, positive, np.inf, "a positive number")
        shares = (
            "survival_probability", "detection_threshold", "pruning_threshold", "share_threshold", "birth_threshold",
        )  # fmt: skip
        check_inside(name, self, shares, 1.0 + 1e-12, share)
        check_inside(name, self, ("detection_probability",), 1.0, "a number in (0, 1)")
        check_height(name, self.height)
        check_inside(name, self, ("specular_ratio",), np.inf, "a positive number, or none")
        check_not_negative(name, self, ("drift_length_std", "drift_angle_std"))
        if not 0.0 <= self.wanderers < 1.0:
            raise ConfigError(f"{name}.wanderers: {self.wanderers} received; give a share below 1")

    @property
    def axes(self) -> Floats:
        """(3,) ones for the axes that BP-SLAM filters."""
        return axes_filtered(self.height)
