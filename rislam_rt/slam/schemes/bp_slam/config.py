"""Configuration of BP-SLAM by delays alone, for an agent that carries both ends."""

from dataclasses import dataclass

from rislam_rt.ranges import Chance, Count, Positive, Share, check_ranges
from rislam_rt.slam.schemes.shared.delay_config import DelayConfig


@dataclass(frozen=True, slots=True)
class BpSlamConfig(DelayConfig):
    """Settings of BP-SLAM by delays alone: model and effort. SI units."""

    sigma_a: Positive = 0.0033
    """Standard deviation of the white acceleration [m/s^2]."""
    detection_probability: Chance = 0.7
    """Probability that a feature is measured in a cycle; the panel's paths fade with its codes."""
    survival_probability: Share = 0.999
    """Probability that a feature is still there after one step."""
    initial_features: Positive = 6.0
    """Expected number of features in the region before the first scan, Poisson."""
    birth_mean: Positive = 0.01
    """Expected number of features that appear in the region in one step, Poisson."""
    birth_threshold: Share = 1e-3
    """Existence probability above which a range starts a feature."""
    detection_threshold: Share = 0.5
    """Existence probability above which a potential feature counts as detected."""
    pruning_threshold: Share = 1e-4
    """Existence probability below which a potential feature is dropped."""
    max_features: Count = 60
    """Largest number of potential features, of which the most probable ones are kept."""

    def __post_init__(self) -> None:
        check_ranges("bp_slam", self)
