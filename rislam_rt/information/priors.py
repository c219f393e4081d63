"""Prior information of bounds and designs: from a covariance, of the agent's motion, and on floor and walls."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Ge, Le

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError
from rislam_rt.geometry.planes import plane_tangents
from rislam_rt.information.landmark_model import LandmarkModel
from rislam_rt.ranges import NotNegative, check_ranges

FLOOR_TILT, UPRIGHT_TILT = 0.05, 0.01
"""Standard deviations [rad] of tilts that the filter assumes: of the floor from level, and, with wall returns in the
map, of upright walls from upright."""
LEVEL, UPRIGHT = 0.99, 0.03
"""Vertical component of a wall's normal above which the wall counts as level, and below which as upright."""
LEAST_VARIANCE = 1e-8
"""Smallest variance [m^2] of a position's prior, (0.1 mm)^2; a collapsed belief is not inverted beyond it."""
MOST_VARIANCE = 1e6
"""Largest variance [m^2] of a position's prior, (1 km)^2; what is not finite counts as this."""


def prior_from_covariance(covariance: Floats) -> Floats:
    """Prior information (..., D, D) [1/m^2] from covariances (..., D, D) [m^2], clipped to (0.1 mm)^2 .. (1 km)^2."""
    covariance = np.clip(np.nan_to_num(covariance, nan=MOST_VARIANCE), -MOST_VARIANCE, MOST_VARIANCE)
    value, vector = np.linalg.eigh(0.5 * (covariance + np.swapaxes(covariance, -1, -2)))
    return (vector / np.maximum(value, LEAST_VARIANCE)[..., None, :]) @ np.swapaxes(vector, -1, -2)


def assumed_std(model: LandmarkModel, height: float, *, upright: bool) -> Floats:
    """Prior standard deviations (U,) of map unknowns as the filter assumes them: the floor nearly level and, if
    `upright`, upright walls nearly upright.

    A level wall is the floor if it lies below the agent's `height` [m].
    """
    std = model.prior_std()
    for wall in np.flatnonzero(model.wall_column >= 0):
        normal, tilts = model.wall_normal[wall], model.wall_column[wall] + np.arange(2)
        if abs(normal[2]) > LEVEL and model.wall_offset[wall] / normal[2] < height:
            std[tilts] = FLOOR_TILT
        elif upright and abs(normal[2]) < UPRIGHT:
            lean = int(np.argmax(np.abs([tangent[2] for tangent in plane_tangents(normal)])))
            std[tilts[lean]] = UPRIGHT_TILT
    return std


@dataclass(frozen=True, slots=True)
class MotionPrior:
    """Prior of a bound on the agent's motion: standard deviations per axis of acceleration noise and of the start."""

    acceleration: NotNegative = 0.01
    """Standard deviation sigma_a [m/s^2] of the white-noise acceleration."""
    start_position: NotNegative = 0.01
    """Standard deviation [m] of the start position."""
    start_velocity: NotNegative = 0.01
    """Standard deviation [m/s] of the start velocity."""
    axes: Annotated[int, Ge(2), Le(3)] = 2
    """Number of unknown axes: 2, height known, the agent moves in a horizontal plane; 3, height unknown too."""
    climb: NotNegative | None = None
    """Vertical sigma_a [m/s^2] of an agent whose height and climb are known at the start alone (3 axes); None: as in
    the other directions."""

    def __post_init__(self) -> None:
        check_ranges("motion", self)
        if self.climb is not None and self.axes != 3:
            raise ConfigError(f"motion.climb: {self.climb} received; give it with 3 axes")

    @property
    def accelerations(self) -> Floats:
        """Standard deviations (axes,) [m/s^2] of each axis's white-noise acceleration in a bound's prior of the
        motion."""
        sigma = np.full(self.axes, self.acceleration)
        if self.climb is not None:
            sigma[2] = self.climb
        return sigma

    @property
    def start(self) -> Floats:
        """Standard deviations (2 axes,) of position and velocity at the start [m, m/s] in a bound's prior of the
        motion."""
        std = np.repeat([self.start_position, self.start_velocity], self.axes)
        if self.climb is not None:
            std[[2, 5]] = 0.0
        return std
