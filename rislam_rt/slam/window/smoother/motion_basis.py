"""Motion basis: the window's poses as a linear function of the first one, its velocity and the steps' accelerations.

Over each step the velocity is turned by a given angle, as that of a body which goes where it faces, and an acceleration
is added to it: v' = R v + a T. The place moves by the mean of both velocities, p' = p + (v + v') T / 2 (a coordinated
turn of known rate; Bar-Shalom, Li and Kirubarajan 2001, section 11.7).
"""

from functools import lru_cache

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats

HEAD = 7
"""Number of the window's unknowns before the features: first position, its velocity, compass offset."""
TURN = 3
"""Index of the rate of turn among the axes, after the three of the room."""
POSE = 4
"""Number of a pose's unknowns that measurements depend on: position, compass offset."""


@lru_cache(maxsize=4)
def pose_matrix(steps: bytes, velocity_turn: bytes, turns: bool) -> Floats:
    """Matrix (K, A, 7 + (K - 1) A) that gives K poses along A axes from the head's numbers before the features and then
    the accelerations of all steps, for times [s] of the steps and turns [rad] of the velocity over them, as bytes."""
    step, free = np.frombuffer(steps), 3 + turns
    count, (_, reach) = len(step) + 1, horizontal(steps, velocity_turn)
    found = np.zeros((count, free, HEAD + len(step) * free))
    speed, accel = found[:, :, 3:6], found[:, :, HEAD:].reshape(count, free, len(step), free)
    straight = horizontal(steps, np.zeros(len(step)).tobytes())[1].real
    for axis, to, way in (
        (0, 0, reach.real),
        (0, 1, -reach.imag),
        (1, 0, reach.imag),
        (1, 1, reach.real),
        (2, 2, straight),
    ):
        speed[:, axis, to], accel[:, axis, :, to] = way[:, 0], way[:, 1:]
    for axis in range(3):
        found[:, axis, axis] = 1.0
    if turns:
        found[:, TURN, 6], accel[:, TURN, :, TURN] = 1.0, np.where(_after(count), step, 0.0)
    found.flags.writeable = False
    return found


def _after(count: int) -> Booleans:
    """Which of K poses lie after each of K - 1 steps, (K, K - 1)."""
    return np.asarray(np.arange(count)[:, None] > np.arange(count - 1))


@lru_cache(maxsize=8)
def horizontal(steps: bytes, velocity_turn: bytes) -> tuple[Complexes, Complexes]:
    """Horizontal velocities and displacements (K, K), as complex factors of the first velocity and of the accelerations
    of steps with times and turns (K - 1,) [s, rad], as bytes."""
    step = np.frombuffer(steps)
    count = len(step) + 1
    heading = np.concatenate([[0.0], np.cumsum(np.frombuffer(velocity_turn))])
    speed = np.zeros((count, count), dtype=np.complex128)
    speed[:, 0] = np.exp(1j * heading)
    speed[:, 1:] = np.where(_after(count), step * np.exp(1j * (heading[:, None] - heading[1:])), 0.0)
    reach = np.zeros((count, count), dtype=np.complex128)
    reach[1:] = np.cumsum(0.5 * step[:, None] * (speed[1:] + speed[:-1]), axis=0)
    return speed, reach


def rotation(angle: float) -> Floats:
    """Rotation (3, 3) of a velocity by a turn [rad]."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def step_transition(dt: float, angle: float, free: int) -> Floats:
    """Transition matrix (7, 7 + A) of the motion basis, from pose, velocity and compass offset, and a step's
    accelerations, to those `dt` [s] later, the velocity turning by a turn [rad]."""
    found = np.eye(HEAD, HEAD + free)
    axes, turn = np.arange(3), rotation(angle)
    found[:3, 3:6], found[3:6, 3:6] = 0.5 * dt * (np.eye(3) + turn), turn
    found[axes, HEAD + axes], found[3 + axes, HEAD + axes] = 0.5 * dt**2, dt
    if free > TURN:
        found[6, HEAD + TURN] = dt
    return found


def step_back(found: Floats) -> Floats:
    """Inverse of `step_transition` in the motion basis: matrix (7, 7 + A) from pose, velocity and compass offset after
    a step, and its accelerations, to those before it."""
    back = found[3:6, 3:6].T
    before, push = found.copy(), found[3:6, HEAD:]
    before[3:6, 3:6], before[3:6, HEAD:] = back, -back @ push
    mean = found[:3, 3:6]
    before[:3, 3:6], before[:3, HEAD:] = -mean @ back, mean @ back @ push - found[:3, HEAD:]
    before[6, HEAD:] = -found[6, HEAD:]
    return before


@lru_cache(maxsize=4)
def last_pose_matrix(steps: bytes, velocity_turn: bytes, turns: bool) -> Floats:
    """Matrix (7, 7 + (K - 1) A) that gives the last pose, velocity and compass offset from the first ones and all
    accelerations."""
    step, free = np.frombuffer(steps), 3 + turns
    design = np.eye(HEAD, HEAD + len(step) * free)
    design[[0, 1, 2, 6][:free]] = pose_matrix(steps, velocity_turn, turns)[-1]
    speed = horizontal(steps, velocity_turn)[0][-1]
    whole = np.stack([[speed.real, -speed.imag], [speed.imag, speed.real]])
    design[3:5, 3:5] = whole[:, :, 0]
    for axis in range(2):
        design[3:5, HEAD + axis :: free] = whole[:, axis, 1:]
    design[5, HEAD + 2 :: free] = step
    design.flags.writeable = False
    return design
