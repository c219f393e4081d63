"""Settings of BP-SLAM."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError


@dataclass(frozen=True, slots=True)
class BpSlamConfig:
    """Model and effort. SI units. Defaults follow the synthetic experiment of Leitinger et al. (2019)."""

    num_particles: int = 1024
    """Published form: of the agent, and of every feature; a power of two lets the kernels follow thin clouds best."""
    num_pairings: int = 10
    """Feature particles that every agent particle meets in a message, and the other way round."""
    sigma_a: float = 0.0033
    """Standard deviation of the white acceleration [m/s^2]."""
    range_std: float = 0.1
    """Standard deviation of a range [m], where the measurement brings none of its own."""
    detection_probability: float = 0.95
    """Published form: that a feature in reach is measured."""
    survival_probability: float = 0.999
    """That a feature is still there after one step."""
    clutter_mean: float = 1.0
    """Published form: false ranges a scan, Poisson. The moving form takes what the agent is told of its receiver."""
    max_range: float = 30.0
    """Published form: false ranges are uniform on (0, max_range]; features that would be farther are not born [m]."""
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
    height: str = "known"
    """Moving form: `known` keeps the height and the vertical velocity of the start, `estimated` filters them."""
    specular_ratio: float | None = 0.35
    """Moving form: amplitude over that of free space of the same length, above which a component is a wall return;
    None: there are none."""
    planes: bool = True
    """Moving form: whether wall returns are features (walls), or set aside."""
    smallest_std: float = 0.003
    """Moving form: smallest standard deviation of a range that is believed [m]."""
    moving_detection: float = 0.7
    """Moving form: detection probability; the panel's paths fade with its codes."""
    wanderers: float = 0.5
    """Moving form: probability that a new weak feature is not a point that stays."""
    moving_features: int = 60
    """Moving form: potential features that are kept, the most probable ones."""
    course_stride: int = 40
    """Moving form: cycles from one past state of the agent that is kept to the next."""
    drift_length_std: float = 0.003
    """Moving form: random walk of a wandering feature's distance in one step [m]."""
    drift_angle_std: float = 0.01
    """Moving form: random walk of the cosine of its angle off the walk in one step."""
    birth_turns: int = 6
    """Moving form: Gaussians of a new feature over the turn about the walk, from horizontal to horizontal."""
    share_threshold: float = 1e-3
    """Moving form: share below which a Gaussian of a feature is dropped."""
    birth_threshold: float = 1e-3
    """Moving form: probability above which a range starts a feature."""
    num_samples: int = 32
    """Moving form: positions handed to the phase design."""
    iterations: int = 100
    """Largest number of rounds of loopy data association."""
    tolerance: float = 1e-6
    """Relative change of the messages at which the rounds end."""

    def __post_init__(self) -> None:
        for name in (
            "num_particles",
            "num_pairings",
            "max_features",
            "moving_features",
            "num_samples",
            "iterations",
            "course_stride",
            "birth_turns",
        ):
            if getattr(self, name) < 1:
                raise ConfigError(f"bp_slam.{name}: {getattr(self, name)} received; give at least 1")
        for name in (
            "sigma_a",
            "range_std",
            "clutter_mean",
            "max_range",
            "initial_features",
            "birth_mean",
            "smallest_std",
        ):
            _check(name, getattr(self, name), 0.0, np.inf, "a positive number")
        for name in (
            "survival_probability",
            "detection_threshold",
            "pruning_threshold",
            "share_threshold",
            "birth_threshold",
        ):
            _check(name, getattr(self, name), 0.0, 1.0 + 1e-12, "a number in (0, 1]")
        for name in ("detection_probability", "moving_detection"):
            _check(name, getattr(self, name), 0.0, 1.0, "a number in (0, 1)")
        if self.height not in ("known", "estimated"):
            raise ConfigError(f"bp_slam.height: '{self.height}' received; give 'known' or 'estimated'")
        if self.specular_ratio is not None:
            _check("specular_ratio", self.specular_ratio, 0.0, np.inf, "a positive number, or none")
        for name in ("feature_std", "drift_length_std", "drift_angle_std"):
            if not getattr(self, name) >= 0.0:
                raise ConfigError(f"bp_slam.{name}: {getattr(self, name)} received; give a number that is not negative")
        if not 0.0 <= self.wanderers < 1.0:
            raise ConfigError(f"bp_slam.wanderers: {self.wanderers} received; give a share below 1")
        if self.num_pairings > self.num_particles:
            raise ConfigError(
                f"bp_slam.num_pairings: {self.num_pairings} received; give at most num_particles, {self.num_particles}"
            )

    @property
    def axes(self) -> Floats:
        """(3,) ones for the axes that the moving form filters."""
        return np.array([1.0, 1.0, 1.0 if self.height == "estimated" else 0.0])

    @property
    def weak_kinds(self) -> Floats:
        """(3,) probabilities of point, wall and wanderer for a new feature of a weak path."""
        return np.array([1.0 - self.wanderers, 0.0, self.wanderers])

    @property
    def strong_kinds(self) -> Floats:
        """(3,) the same for a path as strong as a wall return; a corner of two walls returns like a point."""
        return np.array([0.2, 0.5, 0.3])

    @property
    def clutter_density(self) -> float:
        """Expected false ranges per metre."""
        return self.clutter_mean / self.max_range


def _check(name: str, value: float, above: float, below: float, wanted: str) -> None:
    if not (np.isfinite(value) and above < value < below):
        raise ConfigError(f"bp_slam.{name}: {value} received; give {wanted}")
