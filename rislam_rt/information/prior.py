"""Prior information of bounds and designs: from a covariance, and from the filter's assumptions on floor and walls."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.planes import plane_tangents
from rislam_rt.information.landmark_model import LandmarkModel

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
