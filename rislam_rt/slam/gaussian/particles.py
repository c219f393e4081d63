"""Particles with a Gaussian each over pose, recent trail and map.

Particles that are points in pose lose, at every resampling, a share of their spread in the directions that nothing
measures: the error of the start, which SLAM carries to the end. Here a particle is a region of the start prior, small
enough to be linear in, and everything within it is a Gaussian: no sampling error where the belief is Gaussian, and
particles only where it is not. Past poses stay in the Gaussian as long as a track may still become a landmark (clones,
as in Roumeliotis and Burdick 2002), so that its whole history enters with the right correlations.

Nothing that is measured tells where the start was: agent, trail and map may be shifted together. In a covariance that
holds this shift, derivatives taken at one normal of a wall, then at a better one, seem to tell of it (the inconsistency
of the EKF in SLAM, Huang, Mourikis and Roumeliotis 2010): the position becomes surer than its start, and wrong. So the
Gaussians are relative to the start, and its error stands beside them, untouched.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.config import SlamConfig, StartPrior
from rislam_rt.slam.moments import POSE, Moments, normalised, systematic_ancestors
from rislam_rt.slam.returns import AXES

SLOT = 4
"""Numbers of a past pose: position and heading."""
CLONED = np.array([0, 1, 2, 6])
"""The columns of the pose that a slot keeps."""
ROUNDING = 1e-9
"""Spread [m, m/s] of particle means that counts as none: along axes that are known exactly only rounding is left."""


class Particles(NamedTuple):
    """N Gaussians over D = 7 + 4 W + 3 F numbers: pose, the poses of the last W cycles, and F features."""

    log_weight: Floats
    """(N,), normalised."""
    mean: Floats
    """(N, D)."""
    covariance: Floats
    """(N, D, D), without the shift of everything together."""
    window: int
    """W; the pose of cycle k is in slot k % W."""
    shift: Floats
    """(3,) variance [m^2] of that shift along each axis: of the start's position, which no measurement tells."""
    anchor: Floats
    """(F, 3) [m] fixed points of the walls, NaN for points."""

    @property
    def first_feature(self) -> int:
        """Column of the first feature."""
        return POSE + SLOT * self.window

    @property
    def features(self) -> Floats:
        """(N, F, 3) [m]."""
        return self.mean[:, self.first_feature :].reshape(len(self.mean), -1, 3)

    @property
    def shown(self) -> Integers:
        """Columns of pose and features, without the trail."""
        return np.concatenate([np.arange(POSE), np.arange(self.first_feature, self.mean.shape[1])])


def begin(start: StartPrior, config: SlamConfig, *, rng: np.random.Generator) -> Particles:
    """The start prior as a mixture with its mean and covariance, of `num_particles` narrower Gaussians."""
    axes = config.axes
    std = np.concatenate([start.position_std * axes, start.velocity_std * axes, [start.heading_std]])
    if config.heading != "estimated":
        std[6] = 0.0
    count, window = config.num_particles, config.window
    centre = np.concatenate([start.position, start.velocity, [start.heading]])
    share = 0.0 if count == 1 else config.particle_share
    pose = centre + np.sqrt(share) * std * _standard_draws(count, POSE, rng=rng)
    mean = np.concatenate([pose, np.tile(pose[:, CLONED], (1, window))], axis=1)
    rows = np.concatenate([np.arange(POSE), np.tile(CLONED, window)])
    variance = (1.0 - share) * std**2
    within = np.diag(np.where(np.arange(POSE) < 3, 0.0, variance))[np.ix_(rows, rows)]
    log_weight, covariance = np.full(count, -np.log(count)), np.tile(within, (count, 1, 1))
    return Particles(log_weight, mean, covariance, window, variance[:3], np.zeros((0, 3)))


def furnish(particles: Particles, features: Floats, covariance: Floats) -> Particles:
    """Particles that know F features (F, 3) beforehand, with a covariance (3F, 3F): these tell where the start was."""
    if not len(features):
        return particles
    count, size, more = *particles.mean.shape, len(covariance)
    mean = np.concatenate([particles.mean, np.tile(features.ravel(), (count, 1))], axis=1)
    wide = np.zeros((count, size + more, size + more))
    moved, past = _moved(particles), np.tile(np.eye(SLOT, 3), (count, particles.window, 1))
    moved = np.concatenate([moved[:, :POSE], past, moved[:, POSE:]], axis=1)
    wide[:, :size, :size] = particles.covariance + (moved * particles.shift) @ np.swapaxes(moved, 1, 2)
    wide[:, size:, size:] = covariance
    anchor = np.concatenate([particles.anchor, np.full(features.shape, np.nan)])
    return particles._replace(mean=mean, covariance=wide, shift=np.zeros(3), anchor=anchor)


def propagate(
    particles: Particles,
    dt: float,
    accelerate: Floats,
    heading: float,
    slot: int,
    config: SlamConfig,
    *,
    rng: np.random.Generator,
) -> Particles:
    """Discrete white-noise acceleration over `dt` [s]; the new pose is cloned into `slot`.

    `accelerate` (3,) are the standard deviations [m/s^2]; `heading` [rad] is the compass, unless it is estimated.
    """
    mean, covariance = particles.mean.copy(), particles.covariance.copy()
    mean[:, :3] += dt * mean[:, 3:6]
    covariance[:, :3, :] += dt * covariance[:, 3:6, :]
    covariance[:, :, :3] += dt * covariance[:, :, 3:6]
    shake = np.concatenate([np.diag(0.5 * dt**2 * accelerate), np.diag(dt * accelerate)])
    covariance[:, :6, :6] += shake @ shake.T
    _turn(mean, covariance, dt, heading, config)
    place = slice(POSE + SLOT * slot, POSE + SLOT * (slot + 1))
    mean[:, place] = mean[:, CLONED]
    covariance[:, place, :] = covariance[:, CLONED, :]
    covariance[:, :, place] = covariance[:, :, CLONED]
    return particles._replace(mean=mean, covariance=covariance)


def _turn(mean: Floats, covariance: Floats, dt: float, heading: float, config: SlamConfig) -> None:
    """The heading after a cycle, in place: by the compass, along the velocity, or a random walk."""
    if config.heading == "estimated":
        covariance[:, 6, 6] += config.turn_std**2 * dt
        return
    if config.heading == "known":
        mean[:, 6], by_velocity = heading, np.zeros((len(mean), 2))
    else:
        speed = np.maximum(np.hypot(mean[:, 3], mean[:, 4]), 1e-3)
        mean[:, 6] = np.arctan2(mean[:, 4], mean[:, 3])
        by_velocity = np.stack([-mean[:, 4], mean[:, 3]], axis=1) / speed[:, None] ** 2
    covariance[:, 6, :] = (by_velocity[:, None, :] @ covariance[:, 3:5, :])[:, 0]
    covariance[:, :, 6] = (covariance[:, :, 3:5] @ by_velocity[:, :, None])[..., 0]


def moments(particles: Particles) -> Moments:
    """Mean and covariance of the mixture over pose and features."""
    columns = particles.shown
    weight, mean = np.exp(particles.log_weight), particles.mean[:, columns]
    inner = particles.covariance[:, columns[:, None], columns]
    if particles.shift.any():
        moved = _moved(particles)
        inner += (moved * particles.shift) @ np.swapaxes(moved, 1, 2)
    return Moments(*mixture(weight, mean, inner))


def _moved(particles: Particles) -> Floats:
    """(N, 7 + 3F, 3) how pose and features go along with a shift of everything: walls only along their normals."""
    count, anchor = len(particles.mean), particles.anchor
    moved = np.zeros((count, POSE + anchor.size, 3))
    moved[:, :3] = AXES
    features = moved[:, POSE:].reshape(count, -1, 3, 3)
    span = particles.features - anchor
    walls = np.isfinite(span[0, :, 0])
    features[:] = AXES
    span = span[:, walls]
    along = span / np.sqrt(0.5 * np.vecdot(span, span))[..., None]
    features[:, walls] = along[..., :, None] * along[..., None, :]
    return moved


def mixture(weight: Floats, mean: Floats, covariance: Floats) -> tuple[Floats, Floats]:
    """Mean (D,) and covariance (D, D) of Gaussians with weights (N,), means (N, D) and covariances (N, D, D)."""
    if len(weight) == 1:
        return mean[0], covariance[0]
    centre = weight @ mean
    apart = mean - centre
    return centre, np.einsum("n,nij->ij", weight, covariance) + (apart * weight[:, None]).T @ apart


def trail(particles: Particles, slots: Integers) -> tuple[Floats, Floats]:
    """Mean positions (K, 3) and headings (K,) of past poses."""
    weight = np.exp(particles.log_weight)
    past = np.einsum("n,nks->ks", weight, particles.mean[:, slot_columns(slots)].reshape(len(weight), -1, SLOT))
    return past[:, :3], past[:, 3]


def slot_columns(slots: Integers) -> Integers:
    """Columns (4K,) of the poses in some slots."""
    return np.asarray((POSE + SLOT * slots[:, None] + np.arange(SLOT)).ravel())


def drop(particles: Particles, keep: Booleans) -> Particles:
    """Particles with only some of the features."""
    wide = np.concatenate([np.ones(particles.first_feature, dtype=np.bool_), np.repeat(keep, 3)])
    mean, covariance = particles.mean[:, wide], particles.covariance[:, wide][:, :, wide]
    return particles._replace(mean=mean, covariance=covariance, anchor=particles.anchor[keep])


def thin(particles: Particles, config: SlamConfig, *, rng: np.random.Generator) -> tuple[Particles, bool]:
    """Fewer particles once they agree, and systematic resampling when few of them carry the weight.

    Particles whose means lie closer together than half a standard deviation of either are one Gaussian: the mixture's.
    """
    count = len(particles.log_weight)
    if count == 1:
        return particles, False
    weight = np.exp(particles.log_weight)
    centre, total = mixture(weight, particles.mean[:, :6], particles.covariance[:, :6, :6])
    apart = np.sqrt(weight @ (particles.mean[:, :6] - centre) ** 2)
    spread = np.sqrt(np.diag(total) + np.append(particles.shift, np.zeros(3)))
    if np.all(apart <= 0.5 * spread + ROUNDING):
        mean, covariance = mixture(weight, particles.mean, particles.covariance)
        return particles._replace(log_weight=np.zeros(1), mean=mean[None], covariance=covariance[None]), True
    if effective_size(particles) >= config.resample_below * count:
        return particles, False
    # copies of one Gaussian would stay copies: those that are drawn again only add their weight
    ancestors, drawn = np.unique(systematic_ancestors(particles.log_weight, count, rng=rng), return_counts=True)
    log_weight, _ = normalised(np.log(drawn))
    return particles._replace(
        log_weight=log_weight, mean=particles.mean[ancestors], covariance=particles.covariance[ancestors]
    ), True


def effective_size(particles: Particles) -> float:
    """Effective number of particles."""
    return float(1.0 / np.sum(np.exp(2.0 * particles.log_weight)))


def _standard_draws(count: int, dims: int, *, rng: np.random.Generator) -> Floats:
    """(count, dims) draws with mean zero and unit variance along every axis, exactly."""
    if count == 1:
        return np.zeros((1, dims))
    draws = rng.standard_normal((count, dims))
    draws -= draws.mean(axis=0)
    return np.asarray(draws / np.sqrt(np.mean(draws**2, axis=0)))
