"""Settings of BP-SLAM."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError


@dataclass(frozen=True, slots=True)
class BpSlamConfig:
    """Model and effort. SI units. Defaults follow the synthetic experiment of Leitinger et al. (2019)."""

    num_particles: int = 1024
    """Of the agent, and of every potential feature; a power of two lets the kernels follow thin clouds best."""
    num_pairings: int = 10
    """Feature particles that every agent particle meets in a message, and the other way round."""
    sigma_a: float = 0.0033
    """Standard deviation of the white acceleration [m/s^2]."""
    range_std: float = 0.1
    """Standard deviation of a range [m], where the measurement brings none of its own."""
    detection_probability: float = 0.95
    survival_probability: float = 0.999
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
    height: str = "known"
    """Moving form: `known` keeps the height and the vertical velocity of the start, `estimated` filters them."""
    specular_ratio: float | None = 0.35
    """Moving form: amplitude over that of free space of the same length, above which a component is a wall return and
    is set aside; None keeps all."""
    smallest_std: float = 0.005
    """Moving form: smallest standard deviation of a range that is believed [m]."""
    num_samples: int = 32
    """Moving form: positions handed to the phase design."""
    iterations: int = 100
    """Largest number of rounds of loopy data association."""
    tolerance: float = 1e-6
    """Relative change of the messages at which the rounds end."""

    def __post_init__(self) -> None:
        for name in ("num_particles", "num_pairings", "max_features", "num_samples", "iterations"):
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
        for name in ("survival_probability", "detection_threshold", "pruning_threshold"):
            _check(name, getattr(self, name), 0.0, 1.0 + 1e-12, "a number in (0, 1]")
        _check("detection_probability", self.detection_probability, 0.0, 1.0, "a number in (0, 1)")
        if self.height not in ("known", "estimated"):
            raise ConfigError(f"bp_slam.height: '{self.height}' received; give 'known' or 'estimated'")
        if self.specular_ratio is not None:
            _check("specular_ratio", self.specular_ratio, 0.0, np.inf, "a positive number, or none")
        if not self.feature_std >= 0.0:
            raise ConfigError(f"bp_slam.feature_std: {self.feature_std} received; give a number that is not negative")
        if self.num_pairings > self.num_particles:
            raise ConfigError(
                f"bp_slam.num_pairings: {self.num_pairings} received; give at most num_particles, {self.num_particles}"
            )

    @property
    def axes(self) -> Floats:
        """(3,) ones for the axes that the moving form filters."""
        return np.array([1.0, 1.0, 1.0 if self.height == "estimated" else 0.0])

    @property
    def clutter_density(self) -> float:
        """Expected false ranges per metre."""
        return self.clutter_mean / self.max_range


def _check(name: str, value: float, above: float, below: float, wanted: str) -> None:
    if not (np.isfinite(value) and above < value < below):
        raise ConfigError(f"bp_slam.{name}: {value} received; give {wanted}")
