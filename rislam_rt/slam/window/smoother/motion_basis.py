"""Motion basis: the window's poses as a linear function of the first one, its velocity and the steps' accelerations."""

from functools import lru_cache

import numpy as np

from rislam_rt.arrays import Floats, Integers

HEAD = 7
"""Number of the window's unknowns before the features: first position, its velocity, compass offset."""
TURN = 3
"""Index of the rate of turn among the axes, after the three of the room."""
POSE = 4
"""Number of a pose's unknowns that measurements depend on: position, compass offset."""


@lru_cache(maxsize=4)
def basis(steps: bytes, turns: bool) -> Floats:
    """Matrices (A, K, K + 1) that give K poses along each axis from the first place, the first rate and the
    accelerations of the steps (a time [s] each, as bytes)."""
    step = np.frombuffer(steps)
    count = len(step) + 1
    time = np.concatenate([[0.0], np.cumsum(step)])
    after = np.arange(count)[:, None] > np.arange(len(step))
    reach = np.where(after, 0.5 * step**2 + step * (time[:, None] - time[1:]), 0.0)
    moved = np.concatenate([np.ones((count, 1)), time[:, None], reach], axis=1)
    found = np.stack([moved] * (3 + turns))
    if turns:
        found[TURN, :, 1], found[TURN, :, 2:] = 0.0, np.where(after, step, 0.0)
    found.flags.writeable = False
    return found


ONE, TWO = np.tril_indices(POSE)
"""Every pair of axes once, those of the room first."""
FIRST = np.array([0, 1, 2, 6, 3, 4, 5])
"""Indices of the head's numbers in the order of a basis: first places, then first rates."""


def head_order(free: int) -> Integers:
    """Indices of the window's unknowns that a motion basis of so many axes multiplies: first places, then first
    rates."""
    return FIRST if free > TURN else np.arange(6)


def step_transition(dt: float, free: int) -> Floats:
    """Transition matrix (7, 7 + A) from pose, velocity and compass offset, and a step's accelerations, to those `dt`
    [s] later."""
    found = np.eye(HEAD, HEAD + free)
    axes = np.arange(3)
    found[axes, 3 + axes] = found[3 + axes, HEAD + axes] = dt
    found[axes, HEAD + axes] = 0.5 * dt**2
    if free > TURN:
        found[6, HEAD + TURN] = dt
    return found


@lru_cache(maxsize=4)
def last_pose_matrix(steps: bytes, turns: bool) -> Floats:
    """Matrix (7, 7 + (K - 1) A) that gives the last pose, velocity and compass offset from the first ones and all
    accelerations."""
    last, step, free = basis(steps, turns)[:, -1], np.frombuffer(steps), 3 + turns
    design = np.eye(HEAD, HEAD + len(step) * free)
    for axis in range(3):
        design[axis, 3 + axis] = last[axis, 1]
        design[axis, HEAD + axis :: free], design[3 + axis, HEAD + axis :: free] = last[axis, 2:], step
    if turns:
        design[6, HEAD + TURN :: free] = last[TURN, 2:]
    design.flags.writeable = False
    return design
