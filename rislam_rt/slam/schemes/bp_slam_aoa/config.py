"""Configuration of BP-SLAM by delays, angles and amplitudes."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.errors import ConfigError
from rislam_rt.slam.input_checks import check_counts, check_inside, check_not_negative


@dataclass(frozen=True, slots=True)
class BpSlamAoaConfig:
    """Settings of BP-SLAM by delays, angles and amplitudes: model and effort. SI units; probabilities are a cycle's."""

    sigma_a: float = 0.01
    """Standard deviation [m/s^2] of the white acceleration of a calm step."""
    lively_std: float = 0.5
    """Standard deviation [m/s^2] of the white acceleration of a lively step: a turn or a stop within a second."""
    calm_again: float = 0.1
    """Probability that a lively step is followed by a calm one; a tenth of it the other way round."""
    use_vt: bool = True
    """Whether wall returns are features (walls), or set aside; unless given, as for the default filter."""
    specular_ratio: float = 0.35
    """Amplitude over free space's at the same length above which a component is a wall return, where these are set
    aside."""
    visible: float = 0.9
    """Probability that a path which its amplitude makes detectable is reported: obstacles hide it."""
    survival_probability: float = 0.999
    """Probability that a feature is still there after one step."""
    walls: float = 7.0
    """Expected number of walls in the region before the first scan, Poisson."""
    points: float = 3.0
    """Expected number of point scatterers in the region before the first scan, Poisson."""
    wanderers: float = 5.0
    """Expected number of paths of no kind (over several walls, walls and points) before the first scan, Poisson."""
    birth_mean: float = 0.03
    """Share of the features expected at first that appears anew in a step."""
    birth_threshold: float = 0.01
    """Existence probability above which a component starts a feature."""
    region: float = 15.0
    """Radius [m] of the region in which features are looked for."""
    wall_ratio: float = -0.6
    """Mean log amplitude reflection of a wall: concrete to plasterboard at 10 GHz, ITU-R P.2040."""
    wall_ratio_std: float = 0.5
    """Standard deviation of a wall's log amplitude reflection over building materials."""
    strength: float = 0.15
    """Median root [m] of a point's cross-section: a sphere of 0.08 m radius."""
    strength_std: float = 1.2
    """Standard deviation of the logarithm of the root of a point's cross-section."""
    fading: float = 0.3
    """Standard deviation of one log amplitude about its law: angle of incidence, neighbours."""
    lean: float = 0.01
    """Standard deviation [rad] of an upright wall's lean: building tolerance."""
    drift_std: float = 0.01
    """Random walk [m] of a wandering feature in one step."""
    crowd: float = 9.0
    """Mean square of a residual in reported deviations, before any is seen: 1 + SNR of what a cell holds besides."""
    detection_threshold: float = 0.5
    """Existence probability above which a potential feature counts as detected."""
    pruning_threshold: float = 1e-4
    """Existence probability below which a potential feature is dropped."""
    share_threshold: float = 1e-3
    """Share below which a Gaussian of a feature is dropped."""
    max_features: int = 80
    """Largest number of potential features, of which the most probable ones are kept."""
    course_stride: int = 20
    """Number of cycles from one past state of the agent that is kept to the next."""
    num_samples: int = 32
    """Number of equally likely positions handed to the phase design."""

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
