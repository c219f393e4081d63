"""Agent particles: motion, log weights, moments, resampling."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers


class Particles(NamedTuple):
    """N agent particles, each with its own map of F features.

    The covariance of the map given a trajectory depends on where measurements were taken, not on what they were, and
    hardly differs between particles a few centimetres apart: one matrix serves all of them.
    """

    position: Floats
    """(N, 3) [m]."""
    velocity: Floats
    """(N, 3) [m/s]."""
    log_weight: Floats
    """(N,), normalised."""
    features: Floats
    """(N, F, 3) [m] mean of the map, given the particle's trajectory."""
    covariance: Floats
    """(3F, 3F) [m^2] of the map, given a trajectory."""
    trail: Floats
    """(W, N, 3) [m] positions of the last W cycles, each cycle at row `cycle % W`."""

    @property
    def weight(self) -> Floats:
        """(N,), summing to one."""
        return np.exp(self.log_weight)


def normalised(log_weight: Floats) -> tuple[Floats, float]:
    """Log weights that sum to one, and the logarithm of what they summed to; hopeless weights become equal ones."""
    top = float(np.max(log_weight))
    if not np.isfinite(top):
        return np.full(len(log_weight), -np.log(len(log_weight))), -np.inf
    total = top + float(np.log(np.sum(np.exp(log_weight - top))))
    return log_weight - total, total


def effective_size(log_weight: Floats) -> float:
    """Effective sample size `1 / sum w^2` of normalised log weights."""
    return float(1.0 / np.sum(np.exp(2.0 * log_weight)))


def systematic_ancestors(log_weight: Floats, count: int, *, rng: np.random.Generator) -> Integers:
    """Ancestors (count,) by systematic resampling: particle i is drawn `count w_i` times on average, unbiased."""
    edges = np.cumsum(np.exp(log_weight))
    comb = (np.arange(count) + rng.random()) / count * edges[-1]
    return np.minimum(np.searchsorted(edges, comb, side="right"), len(log_weight) - 1)


def propagate(particles: Particles, dt: float, accelerate: Floats, *, rng: np.random.Generator) -> Particles:
    """Discrete white-noise acceleration: constant over the cycle, standard deviations `accelerate` (3,) [m/s^2]."""
    acceleration = rng.standard_normal(particles.position.shape) * accelerate
    position = particles.position + dt * particles.velocity + 0.5 * dt**2 * acceleration
    return particles._replace(position=position, velocity=particles.velocity + dt * acceleration)


def moments(log_weight: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Weighted mean (D,) and covariance (D, D) of values (N, D)."""
    weight = np.exp(log_weight)
    mean = weight @ values
    centred = values - mean
    return mean, (centred * weight[:, None]).T @ centred


def mean_features(particles: Particles) -> Floats:
    """(F, 3) [m] mean map."""
    return np.einsum("n,nfi->fi", particles.weight, particles.features)


def joint_covariance(particles: Particles) -> Floats:
    """(3 + 3F, 3 + 3F) of position and map together: the cloud's, and the map's own given a trajectory."""
    count = len(particles.log_weight)
    joint = np.concatenate([particles.position, particles.features.reshape(count, -1)], axis=1)
    covariance = moments(particles.log_weight, joint)[1]
    covariance[3:, 3:] += particles.covariance
    return covariance


def resample(particles: Particles, spans: Floats, *, rng: np.random.Generator) -> Particles:
    """Systematic resampling, then a smooth kernel about every survivor that keeps mean and covariance (Liu and West).

    Without the kernel all particles soon share one ancestor, and their maps agree for that reason alone. The kernel
    acts on pose and map together, so that what they have in common stays in common; the trail moves along.

    Parameters
    ----------
    spans
        (W,) time [s] from each row of the trail to now.
    """
    count = len(particles.log_weight)
    pose = np.concatenate([particles.position, particles.velocity], axis=1)
    joint = np.concatenate([pose, particles.features.reshape(count, -1)], axis=1)
    mean, covariance = moments(particles.log_weight, joint)
    ancestors = systematic_ancestors(particles.log_weight, count, rng=rng)
    chosen = joint[ancestors]
    spread = square_root(covariance)
    bandwidth = _bandwidth(count, spread.shape[1])
    shrink = np.sqrt(1.0 - bandwidth**2)
    moved = mean + shrink * (chosen - mean) + bandwidth * rng.standard_normal((count, spread.shape[1])) @ spread.T
    position, velocity = moved[:, :3], moved[:, 3:6]
    shift, slew = position - particles.position[ancestors], velocity - particles.velocity[ancestors]
    return Particles(
        position,
        velocity,
        np.full(count, -np.log(count)),
        moved[:, 6:].reshape(count, -1, 3),
        particles.covariance,
        particles.trail[:, ancestors] + shift - spans[:, None, None] * slew,
    )


def square_root(covariance: Floats) -> Floats:
    """A factor (D, K) with `factor @ factor.T = covariance`, null directions left out."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-30))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    keep = values > 1e-12
    return scale[:, None] * vectors[:, keep] * np.sqrt(values[keep])


def _bandwidth(count: int, dims: int) -> float:
    """Silverman's kernel width for `count` Gaussian samples in `dims` dimensions, in standard deviations."""
    dims = min(max(dims, 1), 4)
    return float(min((4.0 / (dims + 2.0)) ** (1.0 / (dims + 4.0)) * count ** (-1.0 / (dims + 4.0)), 0.9))
