"""Belief of the nested filter: agent particles, each with landmarks' clouds (eqs. `landmarkRenew`, `agentRenew`)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.nested.particles import agents
from rislam_rt.slam.nested.particles.kld_sampling import num_agents, num_points
from rislam_rt.slam.nested.particles.landmark_cloud import HOPELESS, LEAST_STD, Cloud, CloudEngine, Kernel, kernel_width
from rislam_rt.slam.nested.particles.sightline import Sighting, pack
from rislam_rt.slam.nested_config import NestedConfig
from rislam_rt.slam.window.smoother.motion_basis import HEAD

PRIMES = (7919, 5003, 3001, 1009, 409, 211, 101, 53, 29, 13, 7, 5, 3)
"""Strides of the permutation of resampled particles; the first that does not divide M is taken."""
SPARSE = 0.5
"""Share of the blocks in use below which a cloud is written anew without the others."""
PROPOSAL = 1.5
"""Standard deviations of a new landmark's cloud over those of the Gaussian that it is drawn from."""


class Nested(NamedTuple):
    """Belief of the nested filter: N agent particles, each with a cloud of particles of F landmarks."""

    position: Floats
    """Positions (N, 3) [m] of the agent particles."""
    velocity: Floats
    """Velocities (N, 3) [m/s] of the agent particles."""
    heading: Floats
    """Headings (N,) [rad] of the agent particles."""
    log_weight: Floats
    """Log weights (N,) of the agent particles, normalised."""
    trail: Floats
    """Positions [m] and headings [rad] (K, N, 4) of the agent particles in the last K cycles, the present one last."""
    clouds: tuple[Cloud, ...]
    """Landmark particles, a cloud for each of F landmarks."""
    centre: Floats
    """Centres (N, F, 3) [m] from which the clouds' offsets count."""
    mean: Floats
    """Means (N, F, 3) [m] of the clouds."""
    covariance: Floats
    """Covariances (N, F, 3, 3) [m^2] of the clouds, given the agent particle."""
    ess: Floats
    """Effective share (F,) of landmark particles, averaged over the agent particles."""
    updates: Integers
    """Number (F,) of measurements that each landmark has had."""

    @property
    def weight(self) -> Floats:
        """Weights (N,) of the agent particles, summing to one."""
        return np.exp(self.log_weight)


def begin(pose: Floats) -> Nested:
    """Belief of agent particles (N, 7) of equal weight (position, velocity, heading), and an empty map."""
    count = len(pose)
    weight, trail = np.full(count, -np.log(count)), pose[None, :, [0, 1, 2, 6]]
    empty, none, spread = np.zeros((count, 0, 3)), np.zeros(0, dtype=np.int64), np.zeros((count, 0, 3, 3))
    return Nested(pose[:, :3], pose[:, 3:6], pose[:, 6], weight, trail, (), empty, empty, spread, np.zeros(0), none)


def draw(mean: Floats, std: Floats, count: int, *, rng: np.random.Generator) -> Nested:
    """Belief of agent particles from a Gaussian over position, velocity and heading (7,), with its exact moments."""
    return begin(mean + std * agents.standardise(np.full(count, 1.0 / count), rng.standard_normal((count, 7))))


def propagate(belief: Nested, dt: float, accelerate: Floats, turn: float, *, rng: np.random.Generator) -> Nested:
    """Predict the agent particles over `dt` [s] by constant random accelerations, deviations `accelerate` (3,) [m/s^2].

    `turn` [rad] is the standard deviation of a random step of the heading.
    """
    noise = agents.exact_noise(joint(belief), 4, rng=rng)
    acceleration = noise[:, :3] * accelerate
    position = belief.position + dt * belief.velocity + 0.5 * dt**2 * acceleration
    velocity, heading = belief.velocity + dt * acceleration, belief.heading + turn * noise[:, 3]
    return belief._replace(position=position, velocity=velocity, heading=heading)


def remember(belief: Nested, most: int) -> Nested:
    """Append the agent particles' present poses to their trail, which holds `most` poses at most."""
    here = np.column_stack([belief.position, belief.heading])
    return belief._replace(trail=np.concatenate([belief.trail, here[None]])[-most:])


def absorb(belief: Nested, owner: int, sightings: Sequence[Sighting], engine: CloudEngine) -> tuple[Nested, float]:
    """Reweight agent and landmark particles by returns over landmark `owner`, and return the log evidence of these too.

    The previous weight enters once, however many returns there are. If no particle can explain them, the belief stays
    as it was and the evidence is minus infinity.
    """
    cloud, count = belief.clouds[owner], len(belief.log_weight)
    cloud, sums = engine.weigh(cloud, tuple(sighting.line.kind for sighting in sightings), pack(sightings, count))
    possible = np.where(sums.log_total > 0.1 * HOPELESS, sums.log_total, -np.inf)
    likely = belief.log_weight + possible
    top = float(likely.max())
    log_weight, evidence = _normalised(likely - top if np.isfinite(top) else likely)
    if not np.isfinite(evidence):
        return belief, -np.inf
    mean, covariance = belief.mean.copy(), belief.covariance.copy()
    ess, updates = belief.ess.copy(), belief.updates.copy()
    mean[:, owner] = belief.centre[:, owner] + sums.mean
    covariance[:, owner] = sums.covariance
    ess[owner] = np.exp(log_weight) @ sums.ess / cloud.size
    updates[owner] += len(sightings)
    clouds = (*belief.clouds[:owner], cloud, *belief.clouds[owner + 1 :])
    moved = belief._replace(mean=mean, covariance=covariance, ess=ess, updates=updates)
    return moved._replace(log_weight=log_weight, clouds=clouds), evidence + top


def renew(
    belief: Nested, spans: Floats, config: NestedConfig, engine: CloudEngine, *, rng: np.random.Generator
) -> tuple[Nested, bool]:
    """Resample degenerate landmark clouds, then the agent particles if they are degenerate; returns whether these were.

    Parameters
    ----------
    spans
        (K,) time [s] from each row of the trail to now.
    """
    for owner in np.flatnonzero(belief.ess < config.resample_below):
        belief = _renew_cloud(belief, int(owner), config, engine, rng=rng)
    if effective_size(belief) >= config.resample_below * len(belief.log_weight):
        return belief, False
    return _renew_agents(belief, spans, config, engine, rng=rng), True


def place_landmark(
    belief: Nested, mean: Floats, covariance: Floats, config: NestedConfig, engine: CloudEngine,
    *, rng: np.random.Generator,
) -> Nested:  # fmt: skip
    """Add a new landmark of flat prior to the particles: a cloud drawn about a Gaussian and weighed against it.

    They are drawn `PROPOSAL` times as wide as the Gaussian that the landmark's measurements will give, so that these
    find enough of them. All agent particles share one block of offsets, and differ in their centres.

    Parameters
    ----------
    mean
        (N, 3) [m], one for each agent particle.
    covariance
        (3, 3) [m^2] of the landmark given an agent particle's trajectory.
    """
    count, features = len(belief.log_weight), len(belief.clouds)
    size = num_points(covariance, count, features + 1, config)
    normal = agents.standardise(np.full(size, 1.0 / size), rng.standard_normal((size, 3)))
    zero = np.zeros(count, dtype=np.int64)
    cloud = engine.build(
        PROPOSAL * normal[None] @ _root(covariance).T, 0.5 * np.sum(normal**2, axis=1)[None], zero, zero
    )
    cloud, sums = engine.weigh(cloud, (), np.zeros((0, count)))
    return belief._replace(
        clouds=(*belief.clouds, cloud),
        centre=np.concatenate([belief.centre, mean[:, None]], axis=1),
        mean=np.concatenate([belief.mean, (mean + sums.mean)[:, None]], axis=1),
        covariance=np.concatenate([belief.covariance, sums.covariance[:, None]], axis=1),
        ess=np.append(belief.ess, 1.0),
        updates=np.append(belief.updates, 0),
    )


def drop(belief: Nested, keep: Booleans) -> Nested:
    """Belief of particles with only some of the landmarks, those of `keep` (F,)."""
    rows = np.flatnonzero(keep)
    return belief._replace(
        clouds=tuple(belief.clouds[row] for row in rows), centre=belief.centre[:, rows], mean=belief.mean[:, rows],
        covariance=belief.covariance[:, rows], ess=belief.ess[rows], updates=belief.updates[rows],
    )  # fmt: skip


def gaussian(belief: Nested) -> tuple[Floats, Floats]:
    """Mean and covariance of pose and landmarks (7 + 3F,): the agent particles' own, and their clouds' on average.

    No cloud, single precision as it is, counts as known to better than `LEAST_STD`.
    """
    mean, covariance = agents.moments(belief.weight, joint(belief))
    for feature, block in enumerate(mean_covariances(belief)):
        own = slice(HEAD + 3 * feature, HEAD + 3 * feature + 3)
        covariance[own, own] += block + LEAST_STD**2 * np.eye(3)
    return mean, covariance


def mean_covariances(belief: Nested) -> Floats:
    """Covariances (F, 3, 3) [m^2] of the landmarks given the agent's trajectory, averaged over the agent particles."""
    return np.einsum("n,nfij->fij", belief.weight, belief.covariance)


def effective_size(belief: Nested) -> float:
    """Effective number of agent particles, `1 / sum w^2`."""
    return float(1.0 / np.sum(np.exp(2.0 * belief.log_weight)))


def joint(belief: Nested) -> Floats:
    """Coordinates (N, 7 + 3F) of the agent particles with their clouds: position, velocity, heading, clouds' means."""
    count = len(belief.log_weight)
    pose = [belief.position, belief.velocity, belief.heading[:, None]]
    return np.concatenate([*pose, belief.mean.reshape(count, -1)], axis=1)


def _renew_cloud(
    belief: Nested, owner: int, config: NestedConfig, engine: CloudEngine, *, rng: np.random.Generator
) -> Nested:
    """Resample the particles of one landmark within every agent particle."""
    count, cloud = len(belief.log_weight), belief.clouds[owner]
    size = num_points(mean_covariances(belief)[owner], count, len(belief.clouds), config)
    stride = next((p for p in PRIMES if np.gcd(p, size) == 1), 1)
    offset = 4 * int(rng.integers(size // 16, size // 4 + 1)) % size
    kernel = Kernel(rng.random(count), stride % size, offset, kernel_width(size, 3))
    cloud = engine.resample(cloud, belief.covariance[:, owner], size, kernel)
    centre, ess = belief.centre.copy(), belief.ess.copy()
    centre[:, owner], ess[owner] = belief.mean[:, owner], 1.0
    clouds = (*belief.clouds[:owner], cloud, *belief.clouds[owner + 1 :])
    return belief._replace(clouds=clouds, centre=centre, ess=ess)


def _renew_agents(
    belief: Nested, spans: Floats, config: NestedConfig, engine: CloudEngine, *, rng: np.random.Generator
) -> Nested:
    """Resample the agent particles; clouds follow by index and move as a whole with the kernel, as the trail does."""
    count = num_agents(agents.moments(belief.weight, belief.position)[1], config)
    ancestors, moved = agents.resample(belief.log_weight, joint(belief), count, rng=rng)
    position, velocity, heading = moved[:, :3], moved[:, 3:6], moved[:, 6]
    mean = moved[:, HEAD:].reshape(count, -1, 3)
    trail = belief.trail[:, ancestors]
    slew = velocity - belief.velocity[ancestors]
    trail[..., :3] += position - belief.position[ancestors] - spans[:, None, None] * slew
    trail[..., 3] += heading - belief.heading[ancestors]
    return Nested(
        position,
        velocity,
        heading,
        np.full(count, -np.log(count)),
        trail,
        tuple(_inherit(cloud, ancestors, engine) for cloud in belief.clouds),
        belief.centre[ancestors] + mean - belief.mean[ancestors],
        mean,
        belief.covariance[ancestors],
        belief.ess,
        belief.updates,
    )


def _inherit(cloud: Cloud, ancestors: Integers, engine: CloudEngine) -> Cloud:
    """Particle belief after resampling: cloud of a landmark for the children of agent particles, written anew only if
    most of it is unused."""
    block, row = cloud.block[ancestors], cloud.row[ancestors]
    cloud = cloud._replace(block=block, row=row, log_total=cloud.log_total[ancestors])
    written = int(cloud.block.max(initial=0)) + 1
    return engine.compact(cloud) if len(np.unique(block)) < SPARSE * written else cloud


def _normalised(log_weight: Floats) -> tuple[Floats, float]:
    """Normalised log weights of the belief's agent particles, and their former log sum; hopeless ones become equal."""
    top = float(np.max(log_weight))
    if not np.isfinite(top):
        return np.full(len(log_weight), -np.log(len(log_weight))), -np.inf
    total = top + float(np.log(np.sum(np.exp(log_weight - top))))
    return log_weight - total, total


def _root(covariance: Floats) -> Floats:
    """Lower Cholesky factor of a new landmark's covariance (3, 3) in the particles' belief, even a singular one."""
    return np.linalg.cholesky(covariance + 1e-12 * (np.trace(covariance) + 1e-12) * np.eye(3))
