"""The Gaussian engine against exact answers: Kalman's, batch least squares, invariances, and what a mixture keeps."""

import numpy as np
import pytest
from engine_walk import (
    ANCHOR,
    BODY,
    CYCLE,
    FEATURES,
    HEADING,
    PLANE,
    RETURNS,
    SIGMA_A,
    START,
    START_STD,
    STD,
    Walk,
    batch,
    draw_walk,
    lead,
    with_features,
)

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import unit
from rislam_rt.slam import SlamConfig, StartPrior, gaussian
from rislam_rt.slam.birth import Birth, Verdict
from rislam_rt.slam.gaussian.update import FLOOR, correct
from rislam_rt.slam.hypotheses import IMAGE, POINT, RECIPROCAL, Fit
from rislam_rt.slam.moments import Moments, poses_of
from rislam_rt.slam.returns import NONE, Returns, observe

CONFIG = SlamConfig()
FLAT = np.array([0, 1, 3, 4])
"""Columns of the pose that move."""


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240617)


def same_belief(moments: Moments, exact: Moments, columns: Floats, mean_share: float, spread_share: float) -> None:
    """Means within a share of a standard deviation, covariances within a share of the standard deviations' product."""
    index = np.ix_(columns, columns)
    std = np.sqrt(np.diag(exact.covariance))[columns]
    np.testing.assert_array_less(np.abs(moments.mean - exact.mean)[columns] / std, mean_share)
    gap = (moments.covariance - exact.covariance)[index]
    np.testing.assert_array_less(np.abs(gap) / np.outer(std, std), spread_share)


@pytest.mark.parametrize("seed", range(2))
def test_equals_batch_least_squares(seed: int) -> None:
    """Start, map and twenty cycles at once, by scipy.

    Linearisation: features err by s = 0.05 m at r = 1.6 to 6 m, so that a curvature of s^2 / 2 r = 0.8 mm stands
    against errors of 10 mm in each measurement: 8 % at first, less as the map gets known. Errors are drawn at 0.3 of
    what is told, so that none counts as an outlier, and means are then nearer still.
    """
    rng = np.random.default_rng(seed)
    walk = draw_walk(20, share=0.3, rng=rng)
    exact = batch(walk, walk.seen, np.arange(5), walk.guess, 0.05)
    moments = gaussian.moments(lead(walk, CONFIG, rng=rng)[-1])
    same_belief(moments, exact, np.concatenate([FLAT, np.arange(7, 16)]), 0.08, 0.08)


def test_linear_measurements_give_kalmans_answer(rng: np.random.Generator) -> None:
    """Forty cycles of white acceleration and linear measurements of everything: to rounding, as a textbook filter.

    Condition numbers reach 1e6 (variances from 1e-8 to 1e-2): 1e-9 of a standard deviation is 1e6 roundings.
    """
    particles = with_features(gaussian.begin(StartPrior(np.ones(3), np.ones(3), 0.2), CONFIG, rng=rng), FEATURES)
    shown, dims = particles.shown, 16
    mean, covariance = particles.mean[0, shown], particles.covariance[0][np.ix_(shown, shown)]
    move, push = np.eye(dims), np.zeros((dims, 3))
    move[:3, 3:6] = CYCLE * np.eye(3)
    push[:3], push[3:6] = 0.5 * CYCLE**2 * np.eye(3), CYCLE * np.eye(3)
    for cycle in range(1, 41):
        model, seen = rng.standard_normal((4, dims)), rng.standard_normal(4)
        particles = gaussian.propagate(particles, CYCLE, SIGMA_A * PLANE, 0.2, cycle % 40, CONFIG, rng=rng)
        cross = particles.covariance[:, :, shown] @ model.T
        spread = model @ cross[:, shown] + 0.01 * np.eye(4)
        particles, log_density = correct(particles, cross, spread, seen - particles.mean[:, shown] @ model.T)
        mean = move @ mean
        covariance = move @ covariance @ move.T + SIGMA_A**2 * push @ np.diag(PLANE) @ push.T
        inner = model @ covariance @ model.T + 0.01 * np.eye(4)
        gain, gap = np.linalg.solve(inner, model @ covariance).T, seen - model @ mean
        density = -0.5 * (gap @ np.linalg.solve(inner, gap) + np.linalg.slogdet(2.0 * np.pi * inner)[1])
        mean, covariance = mean + gain @ gap, covariance - gain @ inner @ gain.T
        np.testing.assert_allclose(log_density[0], density, rtol=1e-9)
    np.testing.assert_allclose(particles.mean[0, shown], mean, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(particles.covariance[0][np.ix_(shown, shown)], covariance, rtol=0.0, atol=1e-9 * 0.01)


def test_past_poses_are_those_that_were(rng: np.random.Generator) -> None:
    """Prediction alone: a clone k steps back has the covariances of k steps fewer, and F^k P with the present."""
    config = SlamConfig(window=12)
    start = StartPrior(np.ones(3), np.ones(3), 0.2, 0.3, 0.1)
    particles = gaussian.begin(start, config, rng=rng)
    before = []
    for cycle in range(1, 13):
        particles = gaussian.propagate(particles, CYCLE, PLANE, 0.2, cycle % 12, config, rng=rng)
        before.append((particles.mean[0, :6], particles.covariance[0, :6, :6]))
    for back in range(12):
        place = 7 + 4 * ((12 - back) % 12)
        mean, covariance = before[11 - back]
        move = np.eye(6)
        move[:3, 3:] = back * CYCLE * np.eye(3)
        # sums of a dozen terms of order one: rounding stays below 1e-14
        np.testing.assert_allclose(particles.mean[0, place : place + 3], mean[:3], atol=1e-13)
        np.testing.assert_allclose(particles.covariance[0, place : place + 3, place : place + 3], covariance[:3, :3])
        np.testing.assert_allclose(
            particles.covariance[0, :6, place : place + 3], move @ covariance[:, :3], rtol=1e-12, atol=1e-15
        )


@pytest.mark.parametrize("kind", ["point", "image"])
def test_birth_from_a_history_equals_batch_least_squares(kind: str, rng: np.random.Generator) -> None:
    """Twelve measurements of one landmark enter after the event, and move the trail as they should.

    The fit is iterated, so that linearisation costs less than above: the landmark's own posterior spread s is 0.02 m
    to 0.1 m at 2 to 10 m, s^2 / 2 r is 0.5 mm at most against measurements of 10 mm.
    """
    walk = draw_walk(12, share=0.3, rng=rng)
    held = walk.guess[[0]] if kind == "image" else np.zeros((0, 3))
    particles = gaussian.begin(walk.start, CONFIG, rng=rng)
    particles = with_features(particles, held)
    for cycle in range(1, 13):
        particles = gaussian.propagate(particles, CYCLE, SIGMA_A * PLANE, HEADING, cycle, CONFIG, rng=rng)
    feature, row = (2, 2) if kind == "image" else (0, 0)
    guess = FEATURES[feature] + 0.05 * rng.standard_normal(3)
    fit = Fit(guess, np.eye(3), np.zeros(()))
    verdict = Verdict(IMAGE, 0, fit) if kind == "image" else Verdict(POINT, -1, fit)
    seen, std = walk.seen[:, row], np.tile(STD, (12, 1))
    birth = Birth(verdict, ANCHOR[feature], np.arange(1, 13), seen, std)
    moments = gaussian.moments(gaussian.settle(particles, birth, BODY, rng=rng))
    # the batch knows all features; those that nothing speaks of keep their priors and are left out of the comparison
    known, known_std = FEATURES.copy(), np.full(FEATURES.shape, 1.0)
    known[0], known_std[0] = (walk.guess[0], 0.05) if kind == "image" else (guess, 10.0)
    known[feature], known_std[feature] = guess, 10.0
    exact = batch(walk, walk.seen[:, [row]], np.array([row]), known, known_std.ravel())
    wanted = [0, 2] if kind == "image" else [0]
    columns = np.concatenate([np.arange(7), *(7 + 3 * w + np.arange(3) for w in wanted)])
    exact = Moments(exact.mean[columns], exact.covariance[np.ix_(columns, columns)])
    same_belief(moments, exact, np.concatenate([FLAT, np.arange(7, len(columns))]), 0.1, 0.1)


def test_a_shifted_world_gives_a_shifted_belief(rng: np.random.Generator) -> None:
    """Absolute position shows nowhere: not in the means, not in the covariances.

    Rounding: positions of 10 m instead of 1 m cost one digit of sixteen, fifteen updates amplify it little.
    """
    walk, shift = draw_walk(15, rng=rng), np.array([7.0, -4.0, 2.0])
    start = StartPrior(walk.start.position + shift, walk.start.velocity, HEADING, START_STD, START_STD)
    there = walk._replace(start=start, guess=walk.guess + shift)
    here = gaussian.moments(lead(walk, CONFIG, rng=rng)[-1])
    moved = gaussian.moments(lead(there, CONFIG, anchor=ANCHOR + shift, rng=rng)[-1])
    np.testing.assert_allclose(moved.position, here.position + shift, atol=1e-9)
    np.testing.assert_allclose(moved.velocity, here.velocity, atol=1e-9)
    np.testing.assert_allclose(moved.features, here.features + shift, atol=1e-9)
    np.testing.assert_allclose(moved.covariance, here.covariance, atol=1e-11)


def test_nothing_is_learnt_about_where_the_whole_is(rng: np.random.Generator) -> None:
    """Shifting agent and map together changes no measurement: that direction keeps the information of the prior.

    Without process noise `u^T P^-1 u` of the shift u is the prior's at every cycle. The wall is the image of a fixed
    anchor, which the shift moves by `2 n n^T u`: the normal n is an estimate, so that linearising at changing ones
    tells a little of what nobody can know. An error of 0.01 rad in n turns 2 u by 0.02; at a wall known to 0.02 m
    that is 1 / m^2 a cycle against 11 000 / m^2: forty cycles stay below one per cent.
    """
    walk = draw_walk(40, rng=rng)
    columns = np.concatenate([FLAT, np.arange(7, 16)])
    for particles in lead(walk, CONFIG, accelerate=0.0, rng=rng)[::8]:
        moments = gaussian.moments(particles)
        normal = unit(moments.features[2] - ANCHOR[2])
        for axis in (0, 1):
            shift = np.zeros(16)
            shift[[axis, 7 + axis, 10 + axis]] = 1.0
            shift[13:] = 2.0 * normal * normal[axis]
            information = shift[columns] @ np.linalg.solve(moments.covariance[np.ix_(columns, columns)], shift[columns])
            prior = 1.0 / 0.01**2 + (2.0 + shift[13:] @ shift[13:]) / 0.05**2
            np.testing.assert_allclose(information, prior, rtol=0.01)
    # while what can be learnt is: the distance from the agent to a point
    assert particles_std(lead(walk, CONFIG, rng=rng)[-1], 7) < 0.5 * particles_std(with_start(walk, rng), 7)


def test_no_position_is_surer_than_the_start(rng: np.random.Generator) -> None:
    """A floor whose lean no length to one point tells shows it in those to another one, at errors of 1 mm.

    Derivatives at the first normal, 0.03 rad off along either axis, then at the right one must not pass for knowledge
    of where the start was: the position keeps the start's deviation, and its error but for a fifth of that deviation.
    """
    walk = draw_walk(60, share=0.1, rng=rng)
    floor = np.array([START[0], START[1], -START[2]])
    truth, anchor = np.vstack([FEATURES[:2], floor]), np.stack([START, START, START])
    legs = np.array([[0, NONE, NONE], [1, NONE, NONE], [0, 2, NONE], [1, 2, NONE]])
    returns = Returns(legs, np.array([0, 1, 2, 3]), np.array([0, 1, 0, 1]))
    poses = poses_of(walk.position[1:], np.full(60, HEADING), BODY)
    std = np.tile(0.1 * STD, (60, 4, 1))
    seen = observe(returns, np.tile(truth, (60, 1, 1)), anchor, poses).seen
    seen += 0.3 * np.hypot(std, FLOOR) * rng.standard_normal(seen.shape)
    lean = np.array([0.03, 0.03, 0.0])
    born = {12: (0, POINT, -1), 13: (1, POINT, -1), 14: (2, RECIPROCAL, 0)}
    particles = gaussian.begin(walk.start, CONFIG, rng=rng)
    for cycle in range(1, 61):
        particles = gaussian.propagate(particles, CYCLE, SIGMA_A * PLANE, HEADING, cycle % 40, CONFIG, rng=rng)
        if cycle in born:
            row, kind, parent = born[cycle]
            guess = truth[row] + lean * (kind is RECIPROCAL)
            verdict = Verdict(kind, parent, Fit(guess, 0.05**2 * np.eye(3), np.zeros(())))
            birth = Birth(verdict, START, np.arange(1, 13), seen[:12, row], std[:12, row])
            particles = gaussian.settle(particles, birth, BODY, rng=rng)
        if cycle > 14:
            rows = np.arange(4 if cycle > 40 else 3)
            some, now = Returns(legs, returns.tx[rows], returns.rx[rows]), (cycle - 1, rows)
            particles = gaussian.update(particles, some, some, anchor, BODY, seen[now], std[now], rng=rng).particles
    moments = gaussian.moments(particles)
    off = particles.mean[0, :2] - walk.position[60, :2] - (walk.start.position - walk.position[0])[:2]
    assert np.sqrt(np.diag(moments.covariance)[:2]).min() >= START_STD
    assert np.abs(off).max() < 0.2 * START_STD


def with_start(walk: Walk, rng: np.random.Generator) -> gaussian.Particles:
    return with_features(gaussian.begin(walk.start, CONFIG, rng=rng), walk.guess)


def particles_std(particles: gaussian.Particles, column: int) -> float:
    """Standard deviation of a feature's coordinate relative to the agent's."""
    covariance = gaussian.moments(particles).covariance
    axis = (column - 7) % 3
    return float(np.sqrt(covariance[column, column] + covariance[axis, axis] - 2.0 * covariance[column, axis]))


def test_covariance_stays_one_over_six_hundred_cycles(rng: np.random.Generator) -> None:
    """Symmetric and positive semidefinite but for rounding: 600 updates of variances below 0.01 m^2, 1e-16 each."""
    walk = draw_walk(600, rng=rng, features=FEATURES)
    for particles in lead(walk, SlamConfig(window=12), rng=rng)[::50]:
        covariance = particles.covariance[0]
        np.testing.assert_allclose(covariance, covariance.T, rtol=0.0, atol=1e-13)
        assert np.linalg.eigvalsh(covariance)[0] > -1e-13
        assert np.isfinite(particles.mean).all()


def test_many_particles_begin_as_the_prior(rng: np.random.Generator) -> None:
    """The draws are scaled to mean and variance along every axis; between axes 200 draws leave 1 / sqrt(200)."""
    config = SlamConfig(num_particles=200, height="estimated", heading="estimated", particle_share=0.9)
    start = StartPrior(np.array([1.0, 2.0, 3.0]), np.ones(3), 0.2, 0.3, 0.1, 0.05)
    moments = gaussian.moments(gaussian.begin(start, config, rng=rng))
    std = np.repeat([0.3, 0.1, 0.05], [3, 3, 1])
    np.testing.assert_allclose(moments.mean, [1.0, 2.0, 3.0, 1.0, 1.0, 1.0, 0.2], atol=1e-12)
    np.testing.assert_allclose(np.sqrt(np.diag(moments.covariance)), std, rtol=1e-12)
    apart = moments.covariance / np.outer(std, std) - np.eye(7)
    assert np.abs(apart).max() < 4.0 * 0.9 / np.sqrt(200)


def test_thinning_keeps_mean_and_covariance(rng: np.random.Generator) -> None:
    """Particles that agree become one Gaussian with the mixture's moments."""
    config = SlamConfig(num_particles=20, particle_share=0.1)
    walk = draw_walk(6, rng=rng)
    particles = with_features(gaussian.begin(walk.start, config, rng=rng), walk.guess)
    one, changed = gaussian.thin(particles, config, rng=rng)
    assert changed
    assert len(one.log_weight) == 1
    before, after = gaussian.moments(particles), gaussian.moments(one)
    np.testing.assert_allclose(after.mean, before.mean, atol=1e-12)
    np.testing.assert_allclose(after.covariance, before.covariance, atol=1e-14)


def test_resampling_is_unbiased(rng: np.random.Generator) -> None:
    """Over 300 repeats the mean weight of each particle is its weight before: 1 / 20 in steps of 1 / 20 at most.

    A step's standard deviation is at most half of it, 0.025, that of the mean 0.0015: four of those.
    """
    config = SlamConfig(num_particles=20, particle_share=0.9)
    particles = gaussian.begin(StartPrior(np.zeros(3), np.zeros(3), 0.0, 1.0, 1.0), config, rng=rng)
    weight = rng.exponential(size=20) ** 3
    weight /= weight.sum()
    particles = particles._replace(log_weight=np.log(weight))
    mean = np.zeros(20)
    for _ in range(300):
        drawn, changed = gaussian.thin(particles, config, rng=rng)
        assert changed
        np.testing.assert_allclose(np.exp(drawn.log_weight).sum(), 1.0)
        places = [int(np.flatnonzero((particles.mean == row).all(axis=1))[0]) for row in drawn.mean]
        mean[places] += np.exp(drawn.log_weight) / 300
    np.testing.assert_allclose(mean, weight, atol=0.006)


def test_weights_follow_the_likelihood(rng: np.random.Generator) -> None:
    """Log weights after an update are Gaussian log densities of the innovations, by scipy; the evidence their sum."""
    from scipy.stats import multivariate_normal

    config = SlamConfig(num_particles=3, particle_share=0.5)
    walk = draw_walk(1, share=0.1, rng=rng)
    particles = with_features(gaussian.begin(walk.start, config, rng=rng), walk.guess)
    told = gaussian.update(particles, RETURNS, RETURNS, ANCHOR, BODY, walk.seen[0], np.tile(STD, (5, 1)), rng=rng)
    wide = 1e-6
    density = []
    for mean, covariance in zip(particles.mean[:, particles.shown], particles.covariance, strict=True):
        # derivatives by differences: an error of 1e-9 relative
        gaps = [predicted(mean + wide * e) - predicted(mean - wide * e) for e in np.eye(16)]
        model = np.stack(gaps, axis=1) / (2.0 * wide)
        inner = model @ covariance[np.ix_(particles.shown, particles.shown)] @ model.T
        noise = np.tile(STD**2, 5) + np.tile([5e-4, 2e-4, 2e-4], 5) ** 2
        density.append(multivariate_normal.logpdf(walk.seen[0].ravel(), predicted(mean), inner + np.diag(noise)))
    # the curvature of the prediction may widen the innovations a little: one per cent of fifteen terms
    np.testing.assert_allclose(told.log_evidence, np.log(np.mean(np.exp(density))), atol=0.2)
    np.testing.assert_allclose(told.particles.log_weight, density - np.logaddexp.reduce(density), atol=0.05)


def predicted(mean: Floats) -> Floats:
    """(15,) what is to be seen from pose and features (16,)."""
    from rislam_rt.slam.moments import poses_of
    from rislam_rt.slam.returns import observe

    return observe(RETURNS, mean[7:].reshape(3, 3), ANCHOR, poses_of(mean[:3], mean[6], BODY)).seen.ravel()


def test_heading_follows_the_compass_when_known(rng: np.random.Generator) -> None:
    particles = gaussian.begin(StartPrior(np.zeros(3), np.ones(3), 0.0), CONFIG, rng=rng)
    particles = gaussian.propagate(particles, CYCLE, PLANE, 0.7, 1, CONFIG, rng=rng)
    assert particles.mean[0, 6] == 0.7
    assert not particles.covariance[0, 6].any()


def test_heading_along_the_velocity_errs_with_it(rng: np.random.Generator) -> None:
    """Its covariance with everything is the derivative of the course by the velocity, by differences, times theirs."""
    config = SlamConfig(filter="rao_blackwellised", heading="velocity")
    velocity = np.array([0.3, -0.2, 0.0])
    particles = gaussian.begin(StartPrior(np.zeros(3), velocity, 0.0), config, rng=rng)
    particles = gaussian.propagate(particles, CYCLE, PLANE * SIGMA_A, 0.7, 1, config, rng=rng)
    course = lambda v: np.arctan2(v[1], v[0])  # noqa: E731
    assert particles.mean[0, 6] == pytest.approx(course(velocity))
    steps = 1e-6 * np.eye(3)[:2]
    slope = np.array([(course(velocity + s) - course(velocity - s)) / 2e-6 for s in steps])
    want = slope @ particles.covariance[0, 3:5]
    # second derivatives times the step squared, over a slope of order one: 1e-9
    np.testing.assert_allclose(particles.covariance[0, 6, :6], want[:6], rtol=1e-8, atol=1e-15)
    np.testing.assert_allclose(particles.covariance[0, 6, 6], want[3:5] @ slope, rtol=1e-8)


def test_estimated_heading_walks_at_random(rng: np.random.Generator) -> None:
    config = SlamConfig(heading="estimated", turn_std=0.05)
    particles = gaussian.begin(StartPrior(np.zeros(3), np.ones(3), 0.4, heading_std=0.1), config, rng=rng)
    for cycle in range(1, 6):
        particles = gaussian.propagate(particles, CYCLE, PLANE, 0.7, cycle, config, rng=rng)
    assert particles.mean[0, 6] == 0.4
    assert particles.covariance[0, 6, 6] == pytest.approx(0.1**2 + 5 * 0.05**2 * CYCLE)
