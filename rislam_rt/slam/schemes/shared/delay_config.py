"""Configuration that all filters by delay alone share."""

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Lt

from rislam_rt.arrays import Floats
from rislam_rt.ranges import Chance, Count, NotNegative, Positive


@dataclass(frozen=True, slots=True)
class DelayConfig:
    """Settings of the agent, the features and their ranges in the rival filters by delay alone. SI units."""

    sigma_a: Positive = 0.01
    """Standard deviation of the white acceleration [m/s^2]."""
    height: Literal["known", "estimated"] = "known"
    """`known` keeps the height and the vertical velocity of the start, `estimated` filters them."""
    specular_ratio: Positive | None = 0.35
    """Amplitude over that of free space of the same length, above which a component is a wall return; None: there are
    none."""
    planes: bool = True
    """Whether wall returns are features (images of the Tx, that move with it), or set aside."""
    smallest_std: Positive = 0.003
    """Smallest standard deviation of a range that is believed [m]."""
    birth_turns: Count = 6
    """Number of Gaussians of a new feature over its angle about the direction of motion, from horizon to horizon."""
    wanderers: Annotated[float, Ge(0.0), Lt(1.0)] = 0.5
    """Probability that a new weak feature is no static point but one that wanders."""
    drift_length_std: NotNegative = 0.003
    """Random walk [m] of a wandering feature's distance in one step."""
    drift_angle_std: NotNegative = 0.01
    """Random walk, in one step, of the cosine of a wandering feature's angle off the direction of motion."""
    share_threshold: Chance = 1e-3
    """Share below which a Gaussian of a feature is dropped."""
    course_stride: Count = 40
    """Number of cycles from one past state of the agent that is kept to the next."""
    num_samples: Count = 32
    """Number of equally likely positions handed to the phase design."""

    @property
    def axes(self) -> Floats:
        """Ones (3,) for the position's axes that a filter by delay alone is configured to estimate, zero for a known
        height."""
        return np.array([1.0, 1.0, 1.0 if self.height == "estimated" else 0.0])

    @property
    def wander(self) -> Floats:
        """Configured deviations (3,) by which a wandering feature's distance, cosine and turn walk in one step, by
        delay alone."""
        return np.array([self.drift_length_std, self.drift_angle_std, 0.0])
