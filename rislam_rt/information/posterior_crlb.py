"""Posterior CRLB of a whole trajectory, cycle by cycle, with unknown landmarks and walls and a prior on the start."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats, freeze
from rislam_rt.information.landmark_model import LinearMeasurements
from rislam_rt.information.priors import MotionPrior


@dataclass(frozen=True, slots=True, eq=False)
class PosteriorBound:
    """Posterior CRLB of agent and map after each of K cycles: no unbiased filter does better on average."""

    agent: Floats
    """(K, 2 D, 2 D) covariance of position and velocity [m, m/s], D axes."""
    unknown: Floats
    """(K, U) variances of landmarks and walls."""
    last: Floats
    """(U, U) covariance of landmarks and walls after the last cycle."""

    def __post_init__(self) -> None:
        freeze(self, np.float64, agent=(None, None, None))
        freeze(self, np.float64, unknown=(len(self.agent), None))
        freeze(self, np.float64, last=(self.unknown.shape[1],) * 2)

    @property
    def rms(self) -> Floats:
        """Posterior position error bound (K,) [m] over the unknown axes."""
        axes = self.agent.shape[1] // 2
        return np.asarray(np.sqrt(np.einsum("kii->k", self.agent[:, :axes, :axes])))


def posterior_bound(
    rows: Iterable[LinearMeasurements], time: Floats, motion: MotionPrior, unknown_std: Floats
) -> PosteriorBound:  # fmt: skip
    """Posterior CRLB of agent and map along a trajectory by its recursion, linearised at the truth.

    Parameters
    ----------
    rows
        Measurements of each cycle, e.g. `LandmarkModel.rows`.
    time
        (K,) [s].
    unknown_std
        (U,) prior standard deviation of each unknown; large where nothing is known.

    `J_k+1 = (Q + F J_k^-1 F^T)^-1 + H^T R^-1 H` (Tichavsky et al. 1998), with a square root of the covariance: nothing
    is subtracted, so that no SNR and no gap in time makes it indefinite (Kaminski, Bryson and Schmidt 1971).
    """
    axes, unknowns = motion.axes, len(unknown_std)
    size = 2 * axes + unknowns
    spread = np.diag(np.concatenate([motion.start, unknown_std]))
    agent = np.empty((len(time), 2 * axes, 2 * axes))
    unknown = np.empty((len(time), unknowns))
    for cycle, measured in enumerate(rows):
        if cycle:
            spread = _advance(spread, time[cycle] - time[cycle - 1], motion)
        root = np.sqrt(measured.information)[:, None]
        slope = np.zeros((len(root), size))
        slope[:, :axes] = root * measured.agent[:, :axes]
        slope[:, 2 * axes :] = root * measured.unknown
        spread = _update(spread, slope)
        agent[cycle] = spread[: 2 * axes] @ spread[: 2 * axes].T
        unknown[cycle] = np.einsum("ij,ij->i", spread[2 * axes :], spread[2 * axes :])
    return PosteriorBound(agent, unknown, spread[2 * axes :] @ spread[2 * axes :].T)


def _advance(spread: Floats, dt: float, motion: MotionPrior) -> Floats:
    """Square root (N, N + D) of the posterior CRLB's covariance one time step on, from its root (N, N)."""
    axes = motion.axes
    moved = spread.copy()
    moved[:axes] += dt * spread[axes : 2 * axes]
    push = np.zeros((len(spread), axes))
    push[:axes], push[axes : 2 * axes] = (np.diag(motion.accelerations) * step for step in (0.5 * dt**2, dt))
    return np.concatenate([moved, push], axis=1)


def _update(spread: Floats, slope: Floats) -> Floats:
    """Square root (N, N) of the posterior CRLB's covariance after measurements (M, N) of unit variance, from its root
    before."""
    count, size = slope.shape
    stacked = np.zeros((count + size, count + spread.shape[1]))
    stacked[:count, :count] = np.eye(count)
    stacked[:count, count:] = slope @ spread
    stacked[count:, count:] = spread
    return np.asarray(np.linalg.qr(stacked.T, mode="r")).T[count:, count:]
