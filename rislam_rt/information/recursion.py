"""The posterior bound: recursive information of a whole trajectory with unknown landmarks and a prior on the start."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats, freeze
from rislam_rt.errors import ConfigError
from rislam_rt.information.landmarks import Rows


@dataclass(frozen=True, slots=True)
class MotionPrior:
    """White-noise acceleration, and what is known of the start. Per axis, one standard deviation."""

    acceleration: float = 0.01
    """sigma_a [m/s^2]."""
    start_position: float = 0.01
    """[m]."""
    start_velocity: float = 0.01
    """[m/s]."""
    axes: int = 2
    """2: height known, the agent moves in a horizontal plane; 3: all of it unknown."""

    def __post_init__(self) -> None:
        for name in ("acceleration", "start_position", "start_velocity"):
            if not getattr(self, name) >= 0.0:
                raise ConfigError(f"motion.{name}: {getattr(self, name)} received; give a standard deviation")
        if self.axes not in (2, 3):
            raise ConfigError(f"motion.axes: {self.axes} received; give 2 or 3")


@dataclass(frozen=True, slots=True, eq=False)
class PosteriorBound:
    """Bound after each of K cycles; no unbiased filter with these measurements does better on average."""

    agent: Floats
    """(K, 2 D, 2 D) covariance of position and velocity [m, m/s], D axes."""
    unknown: Floats
    """(K, U) variances of landmarks and walls."""
    last: Floats
    """(U, U) covariance of landmarks and walls after the last cycle."""

    def __post_init__(self) -> None:
        freeze(self, "agent", np.float64, (None, None, None))
        freeze(self, "unknown", np.float64, (len(self.agent), None))
        freeze(self, "last", np.float64, (self.unknown.shape[1],) * 2)

    @property
    def rms(self) -> Floats:
        """(K,) horizontal position error [m]."""
        return np.sqrt(self.agent[:, 0, 0] + self.agent[:, 1, 1])


def posterior_bound(
    rows: Iterable[Rows], time: Floats, motion: MotionPrior, unknown_std: Floats
) -> PosteriorBound:  # fmt: skip
    """Run the recursion along a trajectory, linearised at the truth.

    Parameters
    ----------
    rows
        Measurements of each cycle, e.g. `LandmarkModel.rows`.
    time
        (K,) [s].
    unknown_std
        (U,) standard deviation of each unknown beforehand; large where nothing is known.

    `J_k+1 = (Q + F J_k^-1 F^T)^-1 + H^T R^-1 H` (Tichavsky et al. 1998), in covariance form.
    """
    axes, unknowns = motion.axes, len(unknown_std)
    size = 2 * axes + unknowns
    start = np.repeat([motion.start_position, motion.start_velocity], axes)
    covariance = np.diag(np.concatenate([start, unknown_std]) ** 2)
    agent = np.empty((len(time), 2 * axes, 2 * axes))
    unknown = np.empty((len(time), unknowns))
    for cycle, measured in enumerate(rows):
        if cycle:
            covariance = _advance(covariance, time[cycle] - time[cycle - 1], motion)
        root = np.sqrt(measured.information)[:, None]
        slope = np.zeros((len(root), size))
        slope[:, :axes] = root * measured.agent[:, :axes]
        slope[:, 2 * axes :] = root * measured.unknown
        covariance = _update(covariance, slope)
        agent[cycle] = covariance[: 2 * axes, : 2 * axes]
        unknown[cycle] = np.diagonal(covariance)[2 * axes :]
    return PosteriorBound(agent, unknown, covariance[2 * axes :, 2 * axes :])


def _advance(covariance: Floats, dt: float, motion: MotionPrior) -> Floats:
    """Covariance after one time step: `F = [I dt; 0 I]`, discrete white-noise acceleration."""
    axes = motion.axes
    moved = covariance.copy()
    moved[:axes] += dt * moved[axes : 2 * axes]
    moved[:, :axes] += dt * moved[:, axes : 2 * axes]
    for axis in range(axes):
        step = np.array([0.5 * dt**2, dt]) * motion.acceleration
        moved[np.ix_([axis, axis + axes], [axis, axis + axes])] += np.outer(step, step)
    return moved


def _update(covariance: Floats, slope: Floats) -> Floats:
    """Covariance after measurements with derivatives (M, N) of unit variance."""
    if not len(slope):
        return covariance
    seen = slope @ covariance
    factor = np.linalg.cholesky(np.eye(len(slope)) + seen @ slope.T)
    removed = np.linalg.solve(factor, seen)
    updated = covariance - removed.T @ removed
    return 0.5 * (updated + updated.T)
