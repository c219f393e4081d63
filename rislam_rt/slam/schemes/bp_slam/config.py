"""Configuration of BP-SLAM by delays alone, for an agent that carries both ends."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.slam.input_checks import check_counts, check_inside
from rislam_rt.slam.schemes.shared.delay_config import DelayConfig


@dataclass(frozen=True, slots=True)
class BpSlamConfig(DelayConfig):
    """Settings of BP-SLAM by delays alone: model and effort. SI units."""

    sigma_a: float = 0.0033
    """Standard deviation of the white acceleration [m/s^2]."""
    detection_probability: float = 0.7
    """Probability that a feature is measured in a cycle; the panel's paths fade with its codes."""
    survival_probability: float = 0.999
    """Probability that a feature is still there after one step."""
    initial_features: float = 6.0
    """Expected number of features in the region before the first scan, Poisson."""
    birth_mean: float = 0.01
    """Expected number of features that appear in the region in one step, Poisson."""
    birth_threshold: float = 1e-3
    """Existence probability above which a range starts a feature."""
    detection_threshold: float = 0.5
    """Existence probability above which a potential feature counts as detected."""
    pruning_threshold: float = 1e-4
    """Existence probability below which a potential feature is dropped."""
    max_features: int = 60
    """Largest number of potential features, of which the most probable ones are kept."""

    def __post_init__(self) -> None:
        name = "bp_slam"
        self.check(name)
        check_counts(name, self, ("max_features",))
        check_inside(name, self, ("initial_features", "birth_mean"), np.inf, "a positive number")
        shares = ("survival_probability", "detection_threshold", "pruning_threshold", "birth_threshold")
        check_inside(name, self, shares, 1.0 + 1e-12, "a number in (0, 1]")
        check_inside(name, self, ("detection_probability",), 1.0, "a number in (0, 1)")
