"""The agent's path through a room: a smooth curve over waypoints at constant speed."""

from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.scene.motion.suggested_motion import BASELINE
from rislam_rt.scene.room_files import CYCLES
from rislam_rt.scene.write import TRAJECTORY_FILE, tum_bytes

SPEED = 0.1
"""[m/s], that of the paper."""


def curved_agent(waypoints: list[list[float]], speed: float = SPEED) -> tuple[dict[str, Any], dict[str, bytes]]:
    """The agent table and the TUM file of a walk along waypoints, cut to the usual number of cycles."""
    time = np.arange(CYCLES["cycles"]) * CYCLES["cycle_s"]
    position, heading = smooth_path(np.array(waypoints), speed * time)
    return {"trajectory": TRAJECTORY_FILE} | BASELINE, {TRAJECTORY_FILE: tum_bytes(time, position, heading)}


def smooth_path(waypoints: Floats, travelled: Floats) -> tuple[Floats, Floats]:
    """Positions (K, 3) and headings (K,) on a natural cubic spline, at arc lengths (K,) [m] from its start.

    Raises
    ------
    ValueError
        The curve is shorter than the longest arc length.
    """
    from scipy.interpolate import CubicSpline

    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1))])
    spline = CubicSpline(chord, waypoints, bc_type="natural")
    fine = np.linspace(0.0, chord[-1], 20_001)
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(spline(fine), axis=0), axis=1))])
    if travelled[-1] > arc[-1]:
        raise ValueError(f"the curve is {arc[-1]:.2f} m long, {travelled[-1]:.2f} m are travelled")
    parameter = np.interp(travelled, arc, fine)
    tangent = spline(parameter, 1)
    return spline(parameter), np.arctan2(tangent[:, 1], tangent[:, 0])
