"""Configuration of BP-SLAM by delays, angles and amplitudes."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.errors import ConfigError
from rislam_rt.slam.setting_checks import check_counts, check_inside, check_not_negative


@dataclass(frozen=True, slots=True)
class BpSlamAoaConfig:
    """Model and effort. SI units; probabilities are a cycle's."""

    sigma_a: float = 0.01
    """Standard deviation of the white acceleration of a calm step [m/s^2]."""
    lively_std: float = 0.5
    """The same of a lively one [m/s^2]: a turn or a stop within a second."""
    calm_again: float = 0.1
    """Probability that a lively step is followed by a calm one; a tenth of it the other way round."""
    use_vt: bool = True
    """Whether wall returns are features (walls), or set aside; as for the default filter, unless said otherwise."""
    specular_ratio: float = 0.35
    """Amplitude over that of free space of the same length, above which a component that is set aside is one."""
    visible: float = 0.9
    """Probability that a path which its amplitude makes audible is reported: things that stand in the way hide it."""
    survival_probability: float = 0.999
    """That a feature is still there after one step."""
    walls: float = 7.0
    """Walls expected in the region before the first scan, Poisson."""
    points: float = 3.0
    """Points that scatter, likewise."""
    wanderers: float = 5.0
    """Paths of no kind (over several walls, over walls and points), likewise."""
    birth_mean: float = 0.03
    """Share of these that appears anew in a step."""
    birth_threshold: float = 0.01
    """Probability above which a component starts a feature."""
    region: float = 15.0
    """Radius in which features are looked for [m]."""
    wall_ratio: float = -0.6
    """Mean log amplitude reflection of a wall: concrete to plasterboard at 10 GHz, ITU-R P.2040..."""
    wall_ratio_std: float = 0.5
    """...and its spread over building materials."""
    strength: float = 0.15
    """Median root of a point's cross-section [m]: a sphere of 0.08 m radius."""
    strength_std: float = 1.2
    """Spread of its logarithm."""
    fading: float = 0.3
    """Spread of one log amplitude about its law: angle of incidence, neighbours."""
    lean: float = 0.01
    """Standard deviation of an upright wall's lean [rad]: building tolerance."""
    drift_std: float = 0.01
    """Random walk of a wanderer in one step [m]."""
    crowd: float = 9.0
    """Mean square of a residual in reported deviations, before any is seen: 1 + SNR of what a cell holds besides."""
    detection_threshold: float = 0.5
    """Existence probability above which a potential feature counts as detected."""
    pruning_threshold: float = 1e-4
    """Existence probability below which a potential feature is dropped."""
    share_threshold: float = 1e-3
    """Share below which a Gaussian of a feature is dropped."""
    max_features: int = 80
    """Potential features that are kept, the most probable ones."""
    course_stride: int = 20
    """Cycles from one past state of the agent that is kept to the next."""
    num_samples: int = 32
    """Positions handed to the phase design."""

    def __post_init__(self) -> None:
        name = "bp_slam_aoa"
        check_counts(name, self, ("max_features", "num_samples", "course_stride"))
        positive = (
            "sigma_a", "lively_std", "specular_ratio", "walls", "points", "wanderers", "birth_mean", "region",
            "wall_ratio_std", "strength", "strength_std", "fading", "lean",
        )  # fmt: skip
        check_inside(name, self, positive, np.inf, "a positive number")
        check_inside(name, self, ("visible", "calm_again"), 1.0, "a number in (0, 1)")
        shares = (
            "survival_probability", "birth_threshold", "detection_threshold", "pruning_threshold", "share_threshold",
        )  # fmt: skip
        check_inside(name, self, shares, 1.0 + 1e-12, "a number in (0, 1]")
        check_not_negative(name, self, ("drift_std",))
        if not self.crowd >= 1.0:
            raise ConfigError(f"{name}.crowd: {self.crowd} received; give at least 1")
        if not np.isfinite(self.wall_ratio):
            raise ConfigError(f"{name}.wall_ratio: {self.wall_ratio} received; give a finite number")
