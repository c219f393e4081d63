"""Gauge freedom of ranges: what delays cannot tell of the agent, and the belief that is reported over all of it.

Ranges to places that nobody knows are the same for every trajectory and map that are moved, turned about the vertical
or mirrored in a vertical plane together. (With both ends at one point they are exactly so; a baseline b adds b^2 / 4r.)
So they tell the *shape* of the trajectory, its length and speed, while place, direction and the side to which it bends
keep the distribution that start and motion gave them. As that is symmetric about the direction told, so is the
posterior: its mean lies on the line told, whatever the ranges were, and its spread across is that of dead reckoning.

A filter with one Gaussian cannot hold a distribution that is the same on a whole arc. It works at one of the equivalent
trajectories, as good as any other (the gauge), and this module turns what it knows there into mean and covariance over
all.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory

LEAST_WAY = 1e-6
"""Displacement [m] or speed [m/s] below which there is no direction of motion."""


def over_all_turns(course: AgentTrajectory) -> tuple[Floats, Floats]:
    """Mean (2A,) and covariance (2A, 2A) of the agent's present position [m] and velocity [m/s] over the gauge of
    ranges: turns and mirrors about the start.

    The displacement is `L (cos t, sin t)` off the direction told, `L` as filtered, `t` normal with zero mean and the
    standard deviation that dead reckoning gives: `E cos t = exp(-v / 2)`, `var cos t = (1 - exp(-v))^2 / 2`. The
    velocity likewise. Dead reckoning tells the component along instead of `L`; between the two goes the share of its
    variance that ranges took away.
    """
    axes, width = course.axes, course.width
    present, told = course.mean[:width], course.nominal
    moved, way = present[:2] - course.mean[-width:][:2], told[:2] - told[-width:][:2]
    velocity = present[axes : axes + 2]
    if min(np.linalg.norm(each) for each in (moved, way, velocity)) < LEAST_WAY:
        return present, course.covariance[:width, :width]
    size = np.array([np.linalg.norm(moved), np.linalg.norm(velocity)])
    turned = _frame(way / np.linalg.norm(way), axes)
    known = _of_shape(course, moved / size[0], velocity / size[1])
    reckoned = turned @ course.blind @ turned.T
    along, across = np.array([0, axes]), np.array([1, axes + 1])
    place = np.array([course.start_variance, 0.0])
    angle = np.maximum(np.diag(reckoned)[across] - place, 0.0) / size**2
    before = np.maximum(np.diag(reckoned)[along] - place, 1e-18)
    learnt = np.clip(1.0 - np.diag(known)[along] / before, 0.0, 1.0)
    mean = turned @ present
    origin = turned[:2, :2] @ told[-width:][:2]
    mean[along] = size * (1.0 - learnt * (1.0 - np.exp(-0.5 * angle))) + np.array([origin[0], 0.0])
    mean[across] = origin[1], 0.0
    known[along, along] += place + 0.5 * learnt * (size * (1.0 - np.exp(-angle))) ** 2
    known[np.ix_(across, across)] = reckoned[np.ix_(across, across)]
    return turned.T @ mean, turned.T @ known @ turned


def _frame(ahead: Floats, axes: int) -> Floats:
    """Rotation (2A, 2A) from room axes to those of the gauge, along and across the direction `ahead` (and up), of
    position and velocity."""
    turn = np.eye(axes)
    turn[:2, :2] = [[ahead[0], ahead[1]], [-ahead[1], ahead[0]]]
    return np.asarray(np.kron(np.eye(2), turn), dtype=np.float64)


def _of_shape(course: AgentTrajectory, along: Floats, ahead: Floats) -> Floats:
    """Covariance (2A, 2A) of what ranges tell, free of gauge: distance and speed in the places of "along", heights;
    zeros across."""
    axes, width = course.axes, course.width
    rows = np.zeros((width, len(course.mean)))
    rows[0, :2] = along
    rows[0, -width : 2 - width or None] -= along
    rows[axes, axes : axes + 2] = ahead
    if axes == 3:
        rows[2, 2] = rows[5, 5] = 1.0
    return np.asarray(rows @ course.covariance @ rows.T)
