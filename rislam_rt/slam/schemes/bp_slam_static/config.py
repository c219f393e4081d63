"""Configuration of BP-SLAM as published: anchors in known places."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.errors import ConfigError
from rislam_rt.slam.schemes.shared.checks import check_counts, check_inside, check_not_negative
from rislam_rt.slam.schemes.shared.scan import Odds


@dataclass(frozen=True, slots=True)
class BpSlamStaticConfig:
    """Model and effort. SI units. Defaults follow the synthetic experiment of Leitinger et al. (2019)."""

    num_particles: int = 1024
    """Of the agent, and of every feature; a power of two lets the kernels follow thin clouds best."""
    num_pairings: int = 10
    """Feature particles that every agent particle meets in a message, and the other way round."""
    sigma_a: float = 0.0033
    """Standard deviation of the white acceleration [m/s^2]."""
    range_std: float = 0.1
    """Standard deviation of a range [m]."""
    detection_probability: float = 0.95
    """That a feature in reach is measured."""
    survival_probability: float = 0.999
    """That a feature is still there after one step."""
    clutter_mean: float = 1.0
    """False ranges a scan, Poisson."""
    max_range: float = 30.0
    """False ranges are uniform on (0, max_range]; features that would be farther are not born [m]."""
    initial_features: float = 6.0
    """Features expected in the region before the first scan, Poisson."""
    birth_mean: float = 0.01
    """Features that appear in the region in one step, Poisson."""
    coupled: bool = True
    """Whether beliefs of agent and feature keep what they have in common, or are independent as published."""
    feature_std: float = 0.001
    """Random walk of a feature in one step [m]: keeps old features from becoming blind to new evidence."""
    detection_threshold: float = 0.5
    """Existence probability above which a potential feature counts as detected."""
    pruning_threshold: float = 1e-4
    """Existence probability below which a potential feature is dropped."""
    max_features: int = 60
    """Potential features that are kept per anchor, the most probable ones."""
    iterations: int = 100
    """Largest number of rounds of loopy data association."""
    tolerance: float = 1e-6
    """Relative change of the messages at which the rounds end."""

    def __post_init__(self) -> None:
        name, share = "bp_slam_static", "a number in (0, 1]"
        check_counts(name, self, ("num_particles", "num_pairings", "max_features", "iterations"))
        positive = ("sigma_a", "range_std", "clutter_mean", "max_range", "initial_features", "birth_mean")
        check_inside(name, self, positive, np.inf, "a positive number")
        shares = ("survival_probability", "detection_threshold", "pruning_threshold")
        check_inside(name, self, shares, 1.0 + 1e-12, share)
        check_inside(name, self, ("detection_probability",), 1.0, "a number in (0, 1)")
        check_not_negative(name, self, ("feature_std",))
        if self.num_pairings > self.num_particles:
            raise ConfigError(
                f"{name}.num_pairings: {self.num_pairings} received; give at most num_particles, {self.num_particles}"
            )

    @property
    def odds(self) -> Odds:
        """What static BP-SLAM weighs a range against."""
        return Odds(self.detection_probability, self.clutter_mean, self.max_range)

    @property
    def clutter_density(self) -> float:
        """Expected false ranges per metre in static BP-SLAM."""
        return self.odds.clutter_density
