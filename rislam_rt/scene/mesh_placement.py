"""Placement of a mesh file in the room: its unit of length, which axis points up, which point is the room's zero."""

import numpy as np

from rislam_rt.arrays import Floats

UNITS = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
"""Length [m] of each unit that a mesh file may be in."""


def place_points(points: Floats, up: str, unit: float, origin: Floats) -> Floats:
    """Turn, scale and move points (..., 3) of a mesh file into the room's frame: its axis `up` becomes z, and `origin`
    zero.

    Parameters
    ----------
    up
        `y` or `z`.
    unit
        [m] One unit of the file.
    origin
        (3,) [m] in the turned frame.
    """
    if up == "y":
        x, y, z = np.moveaxis(points, -1, 0)
        points = np.stack([x, -z, y], axis=-1)
    if unit != 1.0:
        points = points * unit
    return points - origin if origin.any() else points
