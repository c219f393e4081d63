"""The whole filter: Kalman's answer where that is exact, the paper's weights, seeds, hard cases, consistency."""

import numpy as np
import pytest
from known_walk import BODY, CYCLE, HEADING, STD, room, walk

from rislam_rt.arrays import Floats
from rislam_rt.slam import NestedConfig, SlamConfig, StartPrior
from rislam_rt.slam.nested.particles import agents, belief, operations
from rislam_rt.slam.nested.particles.backend import pick_engine
from rislam_rt.slam.nested.particles.belief import Nested
from rislam_rt.slam.nested.particles.cloud import CloudEngine
from rislam_rt.slam.nested.particles.sightline import Sighting, linear_sightline
from rislam_rt.slam.nested.particles.update import Seen, update
from rislam_rt.slam.returns import Returns

LANDMARKS = np.array([[2.0, 1.0, 1.0], [3.0, 3.0, 3.0]])
PRIOR, NOISE, WANDER, SPEED_STD, START_STD = 0.05, 0.05, 0.1, 0.05, 0.02
COUNT, SIZE, WALKS = 2000, 2048, 8


def fixed(agents: int, points: int, engine: str = "auto", heading: str = "known") -> SlamConfig:
    """So many particles, no more and no fewer."""
    own = NestedConfig(num_agents=agents, num_points=points, adaptive=False, engine=engine)
    return SlamConfig(filter="nested", heading=heading, nested=own)


def linear(state: Nested, owner: int, seen: Floats, covariance: Floats) -> list[Sighting]:
    """The offset from agent to landmark."""
    return [Sighting((linear_sightline(state.centre[:, owner], state.position),), seen, covariance)]


def against_kalman(seed: int) -> tuple[Floats, Floats, Floats, int]:
    """One walk: the filter's mean less Kalman's over its deviation (12,), variance over Kalman's (12,), difference of
    the correlations (12, 12), and how often agent particles were resampled."""
    config, engine = NestedConfig(num_agents=COUNT, num_points=SIZE, adaptive=False), pick_engine("drjit")
    rng = np.random.default_rng(seed)
    std = np.repeat([START_STD, SPEED_STD, 0.0], [3, 3, 1])
    normal = agents.standardise(np.full(COUNT, 1.0 / COUNT), rng.standard_normal((COUNT, 7)))
    state = belief.start(std * normal, np.zeros((3, 3)), 4)
    mean = np.concatenate([np.zeros(6), LANDMARKS.ravel()])
    covariance = np.diag(np.repeat([START_STD, SPEED_STD, PRIOR, PRIOR], 3)) ** 2
    truth = mean + np.sqrt(np.diag(covariance)) * rng.standard_normal(12)
    for owner, place in enumerate(LANDMARKS):
        state = belief.initialise_landmark(
            state, np.tile(place, (COUNT, 1)), PRIOR**2 * np.eye(3), config, engine, rng=rng
        )
        known = Sighting(
            (linear_sightline(state.centre[:, owner] - place, np.zeros(3)),), np.zeros(3), PRIOR**2 * np.eye(3)
        )
        state, _ = belief.absorb(state, owner, [known], engine)
    move = np.eye(12)
    move[:3, 3:6] = CYCLE * np.eye(3)
    shake = np.concatenate([0.5 * CYCLE**2 * np.eye(3), CYCLE * np.eye(3), np.zeros((6, 3))])
    look = np.concatenate([np.tile(-np.eye(3), (2, 1)), np.zeros((6, 3)), np.eye(6)], axis=1)
    renewals = 0
    for _ in range(30):
        truth = move @ truth + shake @ (WANDER * rng.standard_normal(3))
        seen = look @ truth + NOISE * rng.standard_normal(6)
        mean, covariance = move @ mean, move @ covariance @ move.T + WANDER**2 * shake @ shake.T
        gain = covariance @ look.T @ np.linalg.inv(look @ covariance @ look.T + NOISE**2 * np.eye(6))
        mean, covariance = mean + gain @ (seen - look @ mean), covariance - gain @ look @ covariance
        state = belief.propagate(state, CYCLE, np.full(3, WANDER), 0.0, rng=rng)
        for owner in range(2):
            part = linear(state, owner, seen[3 * owner : 3 * owner + 3], NOISE**2 * np.eye(3))
            state, _ = belief.absorb(state, owner, part, engine)
        state, done = belief.renew(state, np.zeros(4), config, engine, rng=rng)
        renewals += done
    found = belief.gaussian(state)
    rows = np.delete(np.arange(13), 6)
    std = np.sqrt(np.diag(covariance))
    apart = (found.covariance[np.ix_(rows, rows)] - covariance) / np.outer(std, std)
    return (found.mean[rows] - mean) / std, 1.0 + np.diag(apart), apart, renewals


@pytest.mark.slow
def test_equals_a_kalman_filter_where_that_is_exact() -> None:
    """Linear and Gaussian: offsets from agent to two landmarks, all axes alike; several walks and draws.

    The mean of weighted particles of effective size E errs by sqrt(P / E), and their variance by sqrt(2) of that
    relatively. Agent particles: E >= N / 2 at each of R resamplings, whose errors add up: 2 (R + 1) / N. Landmark
    particles: all agent particles share the first cloud, and the first measurements leave a part of it, (PROPOSAL
    sqrt(1 + PRIOR^2 / NOISE^2))^-3 = 1 / 9.5, before it is first resampled: 9.5 / M, once for each landmark. No walk
    may be off by more than four standard deviations of the sum; their mean by no more than four of its own, from how
    much the walks scatter: less than a tenth of Kalman's standard deviation.
    """
    means, variances, apart, renewals = zip(*map(against_kalman, range(WALKS)), strict=True)
    assert min(renewals) > 2
    error = np.sqrt(2.0 * (max(renewals) + 1) / COUNT + 2 * 9.5 / SIZE)
    triangle = np.triu_indices(12, 1)
    for off, larger in (
        (np.array(means), 1.0),
        (np.array(variances) - 1.0, np.sqrt(2.0)),
        (np.array(apart)[:, *triangle], np.sqrt(2.0)),
    ):
        np.testing.assert_allclose(off, 0.0, atol=4.0 * larger * error)
        allowed = 4.0 * np.sqrt(np.mean(off**2) / WALKS)
        np.testing.assert_allclose(off.mean(axis=0), 0.0, atol=allowed)
        assert allowed < 0.1, "the tolerance must mean something"


def seen_once(weighting: str, noise: Floats) -> tuple[Nested, float]:
    """One update of a small belief with two landmarks."""
    rng = np.random.default_rng(5)
    config = NestedConfig(num_agents=50, num_points=64, adaptive=False, weighting=weighting)
    engine = pick_engine("numpy")
    pose = np.array([0.5, 0.7, 0.5, 0.0, 0.0, 0.0, HEADING]) + 0.02 * rng.standard_normal((50, 7))
    state = belief.start(pose, np.zeros((3, 3)), 4)
    for place in LANDMARKS:
        state = belief.initialise_landmark(state, np.tile(place, (50, 1)), 0.01 * np.eye(3), config, engine, rng=rng)
    truth = room(1, 0, rng=rng)
    returns = truth.returns
    seen = np.array([[3.5, 0.7, 0.3], [8.5, 0.6, 0.4]])
    return update(state, Seen(returns, returns, np.zeros((2, 3)), BODY, seen, noise), config, engine)


def test_the_papers_factor_cancels() -> None:
    """Amplitudes 1 : 30 or alike: the same weights of agent and landmark particles, to single precision."""
    alike, unlike = np.full((2, 3), 1e-3), np.array([[1e-4] * 3, [1e-1] * 3])
    (one, evidence), (other, shifted) = seen_once("paper", alike), seen_once("paper", unlike)
    np.testing.assert_allclose(other.log_weight, one.log_weight, atol=1e-5)
    np.testing.assert_allclose(other.mean, one.mean, atol=1e-6)
    strength = 1.0 / np.sqrt(unlike[:, 0])
    assert shifted - evidence == pytest.approx(np.sum(np.log(strength / strength.mean())), abs=1e-4)
    for weighting in ("power", "crlb"):
        (one, _), (other, _) = seen_once(weighting, alike), seen_once(weighting, unlike)
        assert np.abs(other.log_weight - one.log_weight).max() > 0.1


@pytest.mark.parametrize("machine", ["numpy", "drjit"])
def test_the_same_seed_gives_the_same_bits(machine: str) -> None:
    config = fixed(100, 64, machine)
    one, other = (walk(config, 20, walls=1, rng=np.random.default_rng(4)) for _ in range(2))
    assert one.resampled > 0
    for a, b in zip(one.moments, other.moments, strict=True):
        np.testing.assert_array_equal(a.mean, b.mean)
        np.testing.assert_array_equal(a.covariance, b.covariance)


AGENTS = 100


def started(heading: str = "known") -> tuple[operations.PointParticles, SlamConfig]:
    config = fixed(AGENTS, 32, "numpy", heading)
    start = StartPrior(np.array([0.5, 0.7, 0.5]), np.array([0.07, 0.07, 0.0]), HEADING)
    return operations.begin(start, config, rng=np.random.default_rng(1)), config


def finite(particles: operations.PointParticles) -> bool:
    """Whether all that the filter knows is a number, and weights sum to one."""
    state = particles.belief
    found = belief.gaussian(state)
    parts = [state.position, state.velocity, state.trail, state.mean, state.covariance, found.mean, found.covariance]
    return all(np.isfinite(part).all() for part in parts) and bool(np.isclose(state.weight.sum(), 1.0))


def test_no_measurements_change_nothing() -> None:
    particles, config = started()
    none = Returns(np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    empty = np.zeros((0, 3))
    told = operations.update(particles, none, none, empty, BODY, empty, empty, rng=np.random.default_rng(0))
    assert told.particles is particles
    assert (told.log_evidence, told.nis) == (0.0, 0.0)
    for slot in range(5):
        particles = operations.propagate(
            particles, CYCLE, 0.01 * config.axes, HEADING, slot, config, rng=np.random.default_rng(0)
        )
        particles, _ = operations.resample(particles, config, rng=np.random.default_rng(0))
    assert finite(particles)


@pytest.mark.parametrize("offset", [1e3, 1e12, 1e30])
def test_impossible_measurements_leave_a_belief(offset: float, engine: CloudEngine) -> None:
    particles, _ = started()
    state, config, rng = particles.belief, particles.config, np.random.default_rng(2)
    state = belief.initialise_landmark(
        state, np.tile(LANDMARKS[0], (AGENTS, 1)), 0.01 * np.eye(3), config, engine, rng=rng
    )
    for _ in range(3):
        far = linear(state, 0, np.full(3, offset), 1e-8 * np.eye(3))
        state, _ = belief.absorb(state, 0, far, engine)
        state, _ = belief.renew(state, particles.spans, config, engine, rng=rng)
    assert finite(particles._replace(belief=state))


def test_coincident_landmarks_are_told_as_two() -> None:
    particles, config = started()
    state, rng, engine = particles.belief, np.random.default_rng(3), pick_engine("numpy")
    for _ in range(2):
        place = np.tile(LANDMARKS[0], (AGENTS, 1))
        state = belief.initialise_landmark(state, place, 1e-12 * np.eye(3), particles.config, engine, rng=rng)
    particles = particles._replace(belief=state)
    truth = room(3, 0, rng=rng)
    for cycle in range(1, 4):
        seen = np.tile([3.4, 0.8, 0.2], (2, 1))
        std = np.tile(STD, (2, 1))
        told = operations.update(particles, truth.returns, truth.returns, truth.anchor, BODY, seen, std, rng=rng)
        particles, _ = operations.resample(told.particles, config, rng=rng)
        assert finite(particles), cycle
    assert operations.moments(operations.drop(particles, np.array([True, False]))).mean.shape == (10,)


def test_a_known_map_enters_with_its_covariance() -> None:
    """Clouds of 32 particles each agent particle keep their own moments to 1 / sqrt(32), a small part of the whole."""
    particles, _ = started()
    root = 0.05 * np.random.default_rng(8).standard_normal((6, 6))
    covariance = root @ root.T
    found = operations.moments(operations.set_prior_map(particles, LANDMARKS, covariance))
    std = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose((found.features - LANDMARKS).ravel() / std, 0.0, atol=0.2)
    scaled = found.covariance[7:, 7:] / np.outer(std, std)
    np.testing.assert_allclose(scaled, covariance / np.outer(std, std), atol=0.2)
    assert found.covariance[0, 0] == pytest.approx(0.01**2, rel=0.3)


def test_estimated_heading_is_filtered() -> None:
    particles, config = started(heading="estimated")
    for slot in range(10):
        particles = operations.propagate(
            particles, CYCLE, 0.01 * config.axes, 9.9, slot, config, rng=np.random.default_rng(slot)
        )
    found = operations.moments(particles)
    assert found.heading == pytest.approx(HEADING, abs=1e-9)
    assert found.covariance[6, 6] == pytest.approx(10 * CYCLE * config.turn_std**2, rel=1e-3)
