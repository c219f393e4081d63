"""Poses as a linear function of the first one and the steps' accelerations: the window's motion without its noise."""

from functools import lru_cache

import numpy as np

from rislam_rt.arrays import Floats, Integers

HEAD = 7
"""Numbers of the head before the features: position, velocity, offset of the compass."""
TURN = 3
"""Axis of the rate of turn, after those of the room."""
POSE = 4
"""Numbers of a pose that measurements depend on: position, offset of the compass."""


@lru_cache(maxsize=4)
def basis(steps: bytes, turns: bool) -> Floats:
    """(A, K, K + 1): each axis of the poses by its first place, its first rate, and its accelerations."""
    step = np.frombuffer(steps)
    count = len(step) + 1
    time = np.concatenate([[0.0], np.cumsum(step)])
    after = np.arange(count)[:, None] > np.arange(len(step))
    reach = np.where(after, 0.5 * step**2 + step * (time[:, None] - time[1:]), 0.0)
    moved = np.concatenate([np.ones((count, 1)), time[:, None], reach], axis=1)
    turned = np.concatenate([np.ones((count, 1)), np.zeros((count, 1)), np.where(after, step, 0.0)], axis=1)
    found = np.stack([moved] * 3 + [turned] * turns)
    found.flags.writeable = False
    return found


ONE, TWO = np.tril_indices(POSE)
"""Every pair of axes once, those of the room first."""
FIRST = np.array([0, 1, 2, 6, 3, 4, 5])
"""The head's numbers in the order of a basis: first places, then first rates."""


def starts(free: int) -> Integers:
    """The head's numbers that a basis of so many axes spans, rate by rate after place by place."""
    return FIRST if free > TURN else np.arange(6)


def carry_on(dt: float, free: int) -> Floats:
    """(7, 7 + A): the next pose, velocity and offset from the last ones and the step's accelerations."""
    found = np.eye(HEAD, HEAD + free)
    axes = np.arange(3)
    found[axes, 3 + axes] = found[3 + axes, HEAD + axes] = dt
    found[axes, HEAD + axes] = 0.5 * dt**2
    if free > TURN:
        found[6, HEAD + TURN] = dt
    return found


@lru_cache(maxsize=4)
def latest(steps: bytes, turns: bool) -> Floats:
    """(7, 7 + (K - 1) A): the last pose, velocity and offset from the head and all accelerations."""
    last, step, free = basis(steps, turns)[:, -1], np.frombuffer(steps), 3 + turns
    design = np.eye(HEAD, HEAD + len(step) * free)
    for axis in range(3):
        design[axis, 3 + axis] = last[axis, 1]
        design[axis, HEAD + axis :: free], design[3 + axis, HEAD + axis :: free] = last[axis, 2:], step
    if turns:
        design[6, HEAD + TURN :: free] = last[TURN, 2:]
    design.flags.writeable = False
    return design
