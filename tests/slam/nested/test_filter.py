"""The whole filter: Kalman's answer where that is exact, the paper's weights, seeds, hard cases, consistency."""

import numpy as np
import pytest
from known_walk import BODY, CYCLE, HEADING, STD, room, walk

from rislam_rt.arrays import Floats
from rislam_rt.slam import NestedConfig, SlamConfig
from rislam_rt.slam.nested.gaussian_view import gaussian_view
from rislam_rt.slam.nested.particles import agents, particle_belief
from rislam_rt.slam.nested.particles.engine_choice import pick_engine
from rislam_rt.slam.nested.particles.landmark_cloud import CloudEngine
from rislam_rt.slam.nested.particles.particle_belief import Nested
from rislam_rt.slam.nested.particles.prior_map import set_prior_map
from rislam_rt.slam.nested.particles.sightline import Sighting, linear_sightline
from rislam_rt.slam.nested.particles.weights import Seen, update
from rislam_rt.slam.predicted_returns import Returns, observe, poses_of
from rislam_rt.slam.window.smoother import window_gaussian

LANDMARKS = np.array([[2.0, 1.0, 1.0], [3.0, 3.0, 3.0]])
PRIOR, NOISE, WANDER, SPEED_STD, START_STD = 0.05, 0.05, 0.1, 0.05, 0.02
COUNT, SIZE, WALKS = 2000, 2048, 8


def fixed(agents: int, points: int, engine: str = "auto", heading: str = "known") -> SlamConfig:
    """So many particles, no more and no fewer."""
    own = NestedConfig(num_agents=agents, num_points=points, adaptive=False, engine=engine)
    return SlamConfig(filter="nested", heading=heading, nested=own)


def linear(state: Nested, owner: int, seen: Floats, covariance: Floats) -> list[Sighting]:
    """The offset from agent to landmark."""
    return [Sighting(linear_sightline(state.centre[:, owner], state.position), seen, covariance)]


def against_kalman(seed: int) -> tuple[Floats, Floats, Floats, int]:
    """One walk: the filter's mean less Kalman's over its deviation (12,), variance over Kalman's (12,), difference of
    the correlations (12, 12), and how often agent particles were resampled."""
    config, engine = NestedConfig(num_agents=COUNT, num_points=SIZE, adaptive=False), pick_engine("drjit")
    rng = np.random.default_rng(seed)
    std = np.repeat([START_STD, SPEED_STD, 0.0], [3, 3, 1])
    normal = agents.standardise(np.full(COUNT, 1.0 / COUNT), rng.standard_normal((COUNT, 7)))
    state = particle_belief.begin(std * normal)
    mean = np.concatenate([np.zeros(6), LANDMARKS.ravel()])
    covariance = np.diag(np.repeat([START_STD, SPEED_STD, PRIOR, PRIOR], 3)) ** 2
    truth = mean + np.sqrt(np.diag(covariance)) * rng.standard_normal(12)
    for owner, place in enumerate(LANDMARKS):
        state = particle_belief.place_landmark(
            state, np.tile(place, (COUNT, 1)), PRIOR**2 * np.eye(3), config, engine, rng=rng
        )
        known = Sighting(
            linear_sightline(state.centre[:, owner] - place, np.zeros(3)), np.zeros(3), PRIOR**2 * np.eye(3)
        )
        state, _ = particle_belief.absorb(state, owner, [known], engine)
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
        state = particle_belief.propagate(state, CYCLE, np.full(3, WANDER), 0.0, rng=rng)
        for owner in range(2):
            part = linear(state, owner, seen[3 * owner : 3 * owner + 3], NOISE**2 * np.eye(3))
            state, _ = particle_belief.absorb(state, owner, part, engine)
        state, done = particle_belief.renew(state, np.zeros(1), config, engine, rng=rng)
        renewals += done
    found, spread = particle_belief.gaussian(state)
    rows = np.delete(np.arange(13), 6)
    std = np.sqrt(np.diag(covariance))
    apart = (spread[np.ix_(rows, rows)] - covariance) / np.outer(std, std)
    return (found[rows] - mean) / std, 1.0 + np.diag(apart), apart, renewals


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
    state = particle_belief.begin(pose)
    for place in LANDMARKS:
        state = particle_belief.place_landmark(
            state, np.tile(place, (50, 1)), 0.01 * np.eye(3), config, engine, rng=rng
        )
    returns = room(1, 0, rng=rng).returns
    mean = particle_belief.gaussian(state)[0]  # expected there, so that none of the two counts for less
    seen = observe(returns, mean[7:].reshape(-1, 3), np.zeros((2, 3)), poses_of(mean[:3], mean[6], BODY)).seen
    return update(state, Seen(returns, np.zeros((2, 3)), BODY, seen, noise), config, engine)[:2]


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
        np.testing.assert_array_equal(a[0], b[0])
        np.testing.assert_array_equal(a[1], b[1])


def test_a_walk_among_points_and_walls_errs_as_it_says() -> None:
    """NEES of 4 degrees of freedom, mean of the last 10 of 40 cycles: below the 0.999 quantile of one draw of it."""
    run = walk(fixed(400, 256, "numpy"), 40, walls=2, rng=np.random.default_rng(6))
    assert run.nees[-10:].mean() < 18.5
    mean, covariance = run.moments[-1]
    std = np.sqrt(np.diag(covariance))
    assert (std[:2] < 0.02).all()  # dead reckoning: 0.01 m and 4 s of 0.01 m/s
    error = mean[7:].reshape(-1, 3) - room(40, 2, rng=np.random.default_rng(6).spawn(2)[0]).features
    assert (np.abs(error.ravel()) < 5.0 * std[7:]).all()


AGENTS = 100


def started() -> tuple[Nested, NestedConfig, CloudEngine]:
    config = fixed(AGENTS, 32, "numpy").nested
    start, std = np.array([0.5, 0.7, 0.5, 0.07, 0.07, 0.0, HEADING]), 0.01 * np.array([1, 1, 0, 1, 1, 0, 0])
    return particle_belief.draw(start, std, AGENTS, rng=np.random.default_rng(1)), config, pick_engine(config.engine)


def finite(state: Nested) -> bool:
    """Whether all that the particles know is a number, and weights sum to one."""
    parts = [
        state.position,
        state.velocity,
        state.trail,
        state.mean,
        state.covariance,
        *particle_belief.gaussian(state),
    ]
    return all(np.isfinite(part).all() for part in parts) and bool(np.isclose(state.weight.sum(), 1.0))


def test_no_measurements_change_nothing() -> None:
    state, config, engine = started()
    none = Returns(np.zeros((0, 3), dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    empty = np.zeros((0, 3))
    belief, *evidence = update(state, Seen(none, empty, BODY, empty, empty), config, engine)
    assert belief is state
    assert evidence == [0.0, 0.0]


@pytest.mark.parametrize("offset", [1e3, 1e12, 1e30])
def test_impossible_measurements_leave_a_belief(offset: float, engine: CloudEngine) -> None:
    state, config, _ = started()
    rng = np.random.default_rng(2)
    state = particle_belief.place_landmark(
        state, np.tile(LANDMARKS[0], (AGENTS, 1)), 0.01 * np.eye(3), config, engine, rng=rng
    )
    for _ in range(3):
        far = linear(state, 0, np.full(3, offset), 1e-8 * np.eye(3))
        state, _ = particle_belief.absorb(state, 0, far, engine)
        state, _ = particle_belief.renew(state, np.zeros(1), config, engine, rng=rng)
    assert finite(state)


def test_coincident_landmarks_are_told_as_two() -> None:
    (state, config, engine), rng = started(), np.random.default_rng(3)
    for _ in range(2):
        place = np.tile(LANDMARKS[0], (AGENTS, 1))
        state = particle_belief.place_landmark(state, place, 1e-12 * np.eye(3), config, engine, rng=rng)
    truth = room(3, 0, rng=rng)
    for cycle in range(1, 4):
        seen = np.tile([3.4, 0.8, 0.2], (2, 1))
        belief, _, _ = update(
            state, Seen(truth.returns, truth.anchor, BODY, seen, np.tile(STD**2, (2, 1))), config, engine
        )
        state, _ = particle_belief.renew(belief, np.zeros(1), config, engine, rng=rng)
        assert finite(state), cycle
    assert particle_belief.gaussian(particle_belief.drop(state, np.array([True, False])))[0].shape == (10,)


def test_a_known_map_enters_with_its_covariance() -> None:
    """Clouds of 32 particles each agent particle keep their own moments to 1 / sqrt(32), a small part of the whole."""
    state, config, engine = started()
    root = 0.05 * np.random.default_rng(8).standard_normal((6, 6))
    covariance = root @ root.T
    known = set_prior_map(state, LANDMARKS, covariance, config, engine, rng=np.random.default_rng(7))
    mean, spread = particle_belief.gaussian(known)
    std = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose((mean[7:] - LANDMARKS.ravel()) / std, 0.0, atol=0.2)
    np.testing.assert_allclose(spread[7:, 7:] / np.outer(std, std), covariance / np.outer(std, std), atol=0.2)
    assert spread[0, 0] == pytest.approx(0.01**2, rel=0.3)


def test_a_turn_of_the_heading_adds_up() -> None:
    state, *_ = started()
    for slot in range(10):
        state = particle_belief.propagate(state, CYCLE, np.full(3, 0.01), 0.003, rng=np.random.default_rng(slot))
    mean, covariance = particle_belief.gaussian(state)
    assert mean[6] == pytest.approx(HEADING, abs=1e-9)
    assert covariance[6, 6] == pytest.approx(10 * 0.003**2, rel=1e-3)


@pytest.mark.parametrize("heading", ["known", "estimated"])
def test_the_front_end_sees_the_particles_as_they_are(heading: str) -> None:
    """The view's present has their mean and covariance; its poses run along their trail, to a tenth of a millimetre."""
    config, rng = fixed(AGENTS, 32, "numpy", heading), np.random.default_rng(4)
    (state, nested, engine), compass, step = started(), [HEADING], []
    for cycle in range(20):
        place = np.tile(LANDMARKS[0], (AGENTS, 1))
        if cycle == 5:
            state = particle_belief.place_landmark(state, place, 0.01 * np.eye(3), nested, engine, rng=rng)
        turn = 0.01 if heading == "estimated" else 0.0
        state = particle_belief.remember(
            particle_belief.propagate(state, CYCLE, np.array([0.01, 0.01, 0.0]), turn, rng=rng), 40
        )
        step.append(CYCLE)
        compass.append(HEADING)
    view = gaussian_view(state, np.array(step), np.array(compass), config)
    (mean, covariance), (wanted, spread) = window_gaussian.now(view), particle_belief.gaussian(state)
    wanted[6] -= HEADING
    np.testing.assert_allclose(mean, wanted, atol=1e-7)
    np.testing.assert_allclose(covariance, spread, atol=1e-11)
    trail = np.einsum("n,knj->kj", state.weight, state.trail) - [0.0, 0.0, 0.0, HEADING]
    np.testing.assert_allclose(window_gaussian.poses(view), trail, atol=1e-4)
