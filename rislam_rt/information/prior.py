"""Prior information: what a covariance tells beforehand, and what a filter takes for granted of a room."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.planes import plane_tangents
from rislam_rt.information.landmark_model import LandmarkModel

FLOOR_TILT, UPRIGHT_TILT = 0.05, 0.01
"""Standard deviations [rad] that the project's filter takes for granted: of the floor from level, and, with wall
returns in the map, of upright walls from upright."""
LEVEL, UPRIGHT = 0.99, 0.03
"""Vertical part of a wall's normal above which it counts as level, and below which as upright."""
LEAST_VARIANCE = 1e-8
"""(0.1 mm)^2: no belief about a position is taken for better than this, nor inverted when it has collapsed."""
MOST_VARIANCE = 1e6
"""(1 km)^2: what is less certain than this, or not finite, counts as known to this."""


def prior_from_covariance(covariance: Floats) -> Floats:
    """Information (..., D, D) [1/m^2] of covariances (..., D, D) [m^2], held between (0.1 mm)^2 and (1 km)^2."""
    covariance = np.clip(np.nan_to_num(covariance, nan=MOST_VARIANCE), -MOST_VARIANCE, MOST_VARIANCE)
    value, vector = np.linalg.eigh(0.5 * (covariance + np.swapaxes(covariance, -1, -2)))
    return (vector / np.maximum(value, LEAST_VARIANCE)[..., None, :]) @ np.swapaxes(vector, -1, -2)


def assumed_std(model: LandmarkModel, height: float, *, upright: bool) -> Floats:
    """(U,) standard deviations beforehand: the floor is nearly level and, if `upright`, walls that are upright so.

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
