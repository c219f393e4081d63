"""Doppler shifts of paths, from the velocities of Tx and Rx on the moving and turning agent."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Paths, Trajectory


def doppler_shift(paths: Paths, trajectory: Trajectory, wavelength: float) -> Floats:
    """Doppler shift (K, P) [Hz] of every path, 0 where a path is not valid.

    `-(v . g) / lambda`, g the gradient of the path's length: each end contributes its velocity along the ray that
    leaves or reaches it, and walls and landmarks stand still. Both ends ride on one body, so a line of sight has no
    shift unless the agent turns, and a return from ahead has the shift of both ends.
    """
    tx, rx = end_velocities(trajectory)
    along = np.einsum("kpi,ki->kp", paths.departure, tx) + np.einsum("kpi,ki->kp", paths.arrival, rx)
    return along / wavelength


def end_velocities(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Velocities (K, 3) [m/s] of Tx and Rx: the agent's velocity plus what its turning adds at their offsets."""
    quarter = rotation_z(trajectory.heading + np.pi / 2.0)
    horizontal = np.array([1.0, 1.0, 0.0])
    turn = turn_rate(trajectory)[:, None]
    body = trajectory.body
    return (
        trajectory.velocity + turn * (quarter @ (horizontal * body.tx_offset)),
        trajectory.velocity + turn * (quarter @ (horizontal * body.rx_offset)),
    )


def turn_rate(trajectory: Trajectory) -> Floats:
    """Turn rate (K,) [rad/s] of the agent for Doppler shifts, from differences of its heading; 0 for a single cycle."""
    if len(trajectory) < 2:
        return np.zeros(len(trajectory))
    return np.gradient(np.unwrap(trajectory.heading), trajectory.time)
