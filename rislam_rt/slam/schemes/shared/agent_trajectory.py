"""The agent's trajectory: present position and velocity and, every few cycles, past ones, as one Gaussian.

Given the trajectory, what different features tell is independent; given the present state alone it is not, and a filter
that takes it so makes up knowledge of directions that nothing measures (start; turn of map and trajectory about it).
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats

RIDGE = 1e-10
"""Added to correlations of past states, which are much alike."""


class AgentTrajectory(NamedTuple):
    """Gaussian over W states of the agent, position [m] and velocity [m/s] along A axes each; the present one first."""

    mean: Floats
    """Mean (2A W,) of the states."""
    covariance: Floats
    """Covariance (2A W, 2A W) of the states."""
    nominal: Floats
    """Mean (2A W,) of the states as it would be had nothing been measured."""
    axes: int
    """Number A of axes, 2 or 3."""
    blind: Floats
    """Covariance (2A, 2A) of the present state as it would be had nothing been measured."""
    start_variance: float
    """Variance [m^2] per axis of the position that was told at the start."""

    def turn(self) -> Floats:
        """Unit vector (2A W,) along which the agent's trajectory changes as all of it turns about the start, before any
        range.

        Ranges to unknown places tell nothing of such a turn. Linearised now here and now there, they seem to (Huang,
        Mourikis and Roumeliotis, 2010): whatever a range seems to tell of this one direction is taken off it.
        """
        blocks = self.nominal.reshape(-1, 2, self.axes).copy()
        blocks[:, 0] -= blocks[-1, 0]
        turned = np.zeros_like(blocks)
        turned[..., 0], turned[..., 1] = -blocks[..., 1], blocks[..., 0]
        size = float(np.linalg.norm(turned))
        return turned.ravel() / size if size > 0.0 else turned.ravel()

    @property
    def width(self) -> int:
        """Number 2A of coordinates of one state of the agent's trajectory."""
        return 2 * self.axes


class Step(NamedTuple):
    """Regression of the agent's former trajectory on the one after a time step, with its error."""

    transfer: Floats
    """Regression matrix (n, n'): deviations of the former trajectory per deviation of the new one."""
    residual: Floats
    """Covariance (2A, 2A) of what the regression misses of the former present state."""


def begin(position: Floats, velocity: Floats, position_std: float, velocity_std: float) -> AgentTrajectory:
    """Gaussian trajectory of the agent at its start, from the prior of position (A,) [m] and velocity (A,) [m/s]."""
    std = np.concatenate([np.full(len(position), position_std), np.full(len(velocity), velocity_std)])
    mean = np.concatenate([position, velocity])
    return AgentTrajectory(mean, np.diag(std**2), mean, len(position), np.diag(std**2), position_std**2)


def advance(course: AgentTrajectory, dt: float, accelerate: Floats, keep: bool) -> tuple[AgentTrajectory, Step]:
    """The agent's trajectory after `dt` [s] of white acceleration of standard deviations `accelerate` (A,) [m/s^2].

    With `keep` the former present state stays as a past one, and nothing is missed. Without, it is left out: what
    hangs on it is handed to the states around it (Rauch, Tung and Striebel's gain) with a small error.
    """
    width, size = course.width, len(course.mean)
    eye, zero = np.eye(course.axes), np.zeros((course.axes, course.axes))
    move = np.block([[eye, dt * eye], [zero, eye]])
    shake = np.concatenate([np.diag(0.5 * dt**2 * accelerate), np.diag(dt * accelerate)])
    noise = shake @ shake.T
    full = np.concatenate([np.pad(move, ((0, 0), (0, size - width))), np.eye(size)])
    mean, nominal = full @ course.mean, full @ course.nominal
    covariance = full @ course.covariance @ full.T
    covariance[:width, :width] += noise
    moved = course._replace(
        mean=mean, covariance=covariance, nominal=nominal, blind=move @ course.blind @ move.T + noise
    )
    if keep:
        return moved, Step(np.eye(size + width)[width:], np.zeros((width, width)))
    kept = np.r_[0:width, 2 * width : size + width]
    step = _regress(course, move, noise)
    return moved._replace(mean=mean[kept], covariance=covariance[np.ix_(kept, kept)], nominal=nominal[kept]), step


def _regress(course: AgentTrajectory, move: Floats, noise: Floats) -> Step:
    """Regression of the agent's former trajectory on the new one, where the former present state is left out."""
    width, size = course.width, len(course.mean)
    scale = np.sqrt(np.maximum(np.diag(course.covariance), 1e-18))
    scaled = course.covariance / np.outer(scale, scale)
    past = scaled[width:, width:] + RIDGE * np.eye(size - width)
    by_past = np.linalg.solve(past, scaled[width:, :width]).T * scale[:width, None] / scale[width:]
    given = course.covariance[:width, :width] - by_past @ course.covariance[width:, :width]
    ahead = move @ given @ move.T + noise
    gain = given @ move.T @ _inverse(ahead)
    transfer = np.eye(size)
    transfer[:width, :width] = gain
    transfer[:width, width:] = by_past - gain @ move @ by_past
    residual = given - gain @ move @ given
    return Step(transfer, 0.5 * (residual + residual.T))


def _inverse(matrix: Floats) -> Floats:
    """Pseudo-inverse of a positive semidefinite matrix (D, D) for the agent's trajectory, directions of mere rounding
    left out."""
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-24))
    unit = np.outer(scale, scale)
    return np.asarray(np.linalg.pinv(matrix / unit, rcond=1e-9, hermitian=True)) / unit
