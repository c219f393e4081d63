"""Configuration of BP-SLAM by delays, angles and amplitudes."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Ge

from rislam_rt.errors import ConfigError
from rislam_rt.ranges import Chance, Count, NotNegative, Positive, Share, check_ranges


@dataclass(frozen=True, slots=True)
class BpSlamAoaConfig:
    """Settings of BP-SLAM by delays, angles and amplitudes: model and effort. SI units; probabilities are a cycle's."""

    sigma_a: Positive = 0.01
    """Standard deviation [m/s^2] of the white acceleration of a calm step."""
    lively_std: Positive = 0.5
    """Standard deviation [m/s^2] of the white acceleration of a lively step: a turn or a stop within a second."""
    calm_again: Chance = 0.1
    """Probability that a lively step is followed by a calm one; a tenth of it the other way round."""
    use_vt: bool = True
    """Whether wall returns are features (walls), or set aside; unless given, as for the default filter."""
    specular_ratio: Positive = 0.35
    """Amplitude over free space's at the same length above which a component is a wall return, where these are set
    aside."""
    visible: Chance = 0.9
    """Probability that a path which its amplitude makes detectable is reported: obstacles hide it."""
    survival_probability: Share = 0.999
    """Probability that a feature is still there after one step."""
    walls: Positive = 7.0
    """Expected number of walls in the region before the first scan, Poisson."""
    points: Positive = 3.0
    """Expected number of point scatterers in the region before the first scan, Poisson."""
    wanderers: Positive = 5.0
    """Expected number of paths of no kind (over several walls, walls and points) before the first scan, Poisson."""
    birth_mean: Positive = 0.03
    """Share of the features expected at first that appears anew in a step."""
    birth_threshold: Share = 0.01
    """Existence probability above which a component starts a feature."""
    region: Positive = 15.0
    """Radius [m] of the region in which features are looked for."""
    wall_ratio: float = -0.6
    """Mean log amplitude reflection of a wall: concrete to plasterboard at 10 GHz, ITU-R P.2040."""
    wall_ratio_std: Positive = 0.5
    """Standard deviation of a wall's log amplitude reflection over building materials."""
    strength: Positive = 0.15
    """Median root [m] of a point's cross-section: a sphere of 0.08 m radius."""
    strength_std: Positive = 1.2
    """Standard deviation of the logarithm of the root of a point's cross-section."""
    fading: Positive = 0.3
    """Standard deviation of one log amplitude about its law: angle of incidence, neighbours."""
    lean: Positive = 0.01
    """Standard deviation [rad] of an upright wall's lean: building tolerance."""
    drift_std: NotNegative = 0.01
    """Random walk [m] of a wandering feature in one step."""
    crowd: Annotated[float, Ge(1.0)] = 9.0
    """Mean square of a residual in reported deviations, before any is seen: 1 + SNR of what a cell holds besides."""
    detection_threshold: Share = 0.5
    """Existence probability above which a potential feature counts as detected."""
    pruning_threshold: Share = 1e-4
    """Existence probability below which a potential feature is dropped."""
    share_threshold: Share = 1e-3
    """Share below which a Gaussian of a feature is dropped."""
    max_features: Count = 80
    """Largest number of potential features, of which the most probable ones are kept."""
    course_stride: Count = 20
    """Number of cycles from one past state of the agent that is kept to the next."""
    num_samples: Count = 32
    """Number of equally likely positions handed to the phase design."""

    def __post_init__(self) -> None:
        check_ranges("bp_slam_aoa", self)
        if not np.isfinite(self.wall_ratio):
            raise ConfigError(f"bp_slam_aoa.wall_ratio: {self.wall_ratio} received; give a finite number")
