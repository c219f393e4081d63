"""Operations of the cycle on the belief: begin, move, update, one more landmark, fewer, resample. Pure functions."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.model import Body
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.nested.belief_moments import Moments
from rislam_rt.slam.nested.birth import Birth
from rislam_rt.slam.nested.particles import belief
from rislam_rt.slam.nested.particles import initialise_landmark as history
from rislam_rt.slam.nested.particles.backend import pick_engine
from rislam_rt.slam.nested.particles.belief import Nested
from rislam_rt.slam.nested.particles.cloud import CloudEngine
from rislam_rt.slam.nested.particles.prior_map import set_prior_map as place_known
from rislam_rt.slam.nested.particles.update import FLOOR, Seen, look, trusted, whitened
from rislam_rt.slam.nested.particles.update import update as absorb_all
from rislam_rt.slam.nested_config import NestedConfig
from rislam_rt.slam.returns import Returns
from rislam_rt.slam.start_prior import StartPrior


class PointParticles(NamedTuple):
    """The belief, and what goes with it."""

    belief: Nested
    time: Floats
    """(W,) [s] of the trail's rows."""
    now: float
    """[s]."""
    config: NestedConfig

    @property
    def engine(self) -> CloudEngine:
        """The backend on which the cycle's heavy operations run."""
        return pick_engine(self.config.engine)

    @property
    def spans(self) -> Floats:
        """(W,) [s] from each row of the trail to now."""
        return self.now - self.time


class ParticleUpdate(NamedTuple):
    """Particles after a cycle's measurements."""

    particles: PointParticles
    log_evidence: float
    """Log density of the measurements given all before."""
    white: Floats
    """(A, 3) innovation of each return by itself at the mean belief, whitened: standard normal when all is well."""
    nis: float
    """Squared innovation of the mean belief, normalised; chi^2 with 3 A degrees of freedom."""


def begin(start: StartPrior, config: SlamConfig, *, rng: np.random.Generator) -> PointParticles:
    """Agent particles from the start prior, with its mean and covariance exactly."""
    nested = config.nested
    std = np.concatenate([start.position_std * config.axes, start.velocity_std * config.axes, [start.heading_std]])
    if config.heading != "estimated":
        std[6] = 0.0
    centre = np.concatenate([start.position, start.velocity, [start.heading]])
    state = belief.draw_start(centre, std, nested.num_agents, config.nested.window, rng=rng)
    return PointParticles(state, np.zeros(config.nested.window), 0.0, nested)


def set_prior_map(particles: PointParticles, features: Floats, covariance: Floats) -> PointParticles:
    """Operation of the cycle: set a prior map, F landmarks (F, 3) known beforehand, with a covariance (3F, 3F)."""
    known = place_known(particles.belief, features, covariance, particles.config, particles.engine)
    return particles._replace(belief=known)


def propagate(
    particles: PointParticles,
    dt: float,
    accelerate: Floats,
    heading: float,
    slot: int,
    config: SlamConfig,
    *,
    rng: np.random.Generator,
) -> PointParticles:
    """The cycle moves the particles over `dt` [s] by white acceleration; the new pose is kept in trail row `slot`."""
    turn = config.turn_std * np.sqrt(dt) if config.heading == "estimated" else 0.0
    moved = belief.propagate(particles.belief, dt, accelerate, turn, rng=rng)
    if config.heading == "known":
        moved = moved._replace(heading=np.full_like(moved.heading, heading))
    elif config.heading == "velocity":
        moved = moved._replace(heading=np.arctan2(moved.velocity[:, 1], moved.velocity[:, 0]))
    past = moved.trail.copy()
    past[slot] = np.column_stack([moved.position, moved.heading])
    now, time = particles.now + dt, particles.time.copy()
    time[slot] = now
    return particles._replace(belief=moved._replace(trail=past), time=time, now=now)


def moments(particles: PointParticles) -> Moments:
    """The cycle asks for mean and covariance over pose and features."""
    return belief.gaussian(particles.belief)


def trail(particles: PointParticles, slots: Integers) -> tuple[Floats, Floats]:
    """The cycle asks for mean positions (K, 3) and headings (K,) of past poses."""
    past = np.einsum("n,knj->kj", particles.belief.weight, particles.belief.trail[slots])
    return past[:, :3], past[:, 3]


def update(
    particles: PointParticles,
    returns: Returns,
    twin: Returns,
    anchor: Floats,
    body: Body,
    seen: Floats,
    std: Floats,
    *,
    rng: np.random.Generator,
) -> ParticleUpdate:
    """The cycle updates by A associated returns: lengths [m] and cosines `seen` (A, 3) with deviations `std`."""
    if not len(seen):
        return ParticleUpdate(particles, 0.0, np.zeros((0, 3)), 0.0)
    visibility = Seen(returns, twin, anchor, body, seen, std**2 + FLOOR**2)
    mean = moments(particles)
    predicted = look(mean, visibility)
    white, _ = whitened(mean, predicted, visibility.noise)
    visibility = visibility._replace(noise=trusted(visibility.noise, white))
    nis = whitened(mean, predicted, visibility.noise)[1]
    moved, evidence = absorb_all(particles.belief, visibility, particles.config, particles.engine)
    return ParticleUpdate(particles._replace(belief=moved), evidence, white, nis)


def initialise_landmark(
    particles: PointParticles, new: Birth, body: Body, *, rng: np.random.Generator
) -> PointParticles:
    """The cycle adds one landmark to the particles, from the history of a track."""
    moved = history.initialise_landmark(
        particles.belief, new, body, particles.spans, particles.config, particles.engine, rng=rng
    )
    return particles._replace(belief=moved)


def drop(particles: PointParticles, keep: Booleans) -> PointParticles:
    """The cycle keeps only the landmarks (F,) that are marked."""
    return particles._replace(belief=belief.drop(particles.belief, keep))


def resample(particles: PointParticles, config: SlamConfig, *, rng: np.random.Generator) -> tuple[PointParticles, bool]:
    """Clouds and agent particles resampled where that is due, and whether the latter were."""
    moved, done = belief.renew(particles.belief, particles.spans, particles.config, particles.engine, rng=rng)
    return particles._replace(belief=moved), done


def effective_size(particles: PointParticles) -> float:
    """Effective number of agent particles."""
    return belief.effective_size(particles.belief)
