"""A walk through a small room whose associations are known, and the exact answer by batch least squares."""

from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from rislam_rt.arrays import Floats
from rislam_rt.model import Body
from rislam_rt.slam import SlamConfig, StartPrior, gaussian
from rislam_rt.slam.birth import Birth, Verdict
from rislam_rt.slam.gaussian.particles import Particles
from rislam_rt.slam.gaussian.update import FLOOR
from rislam_rt.slam.hypotheses import IMAGE, POINT, History, first_guess, fit_feature
from rislam_rt.slam.moments import Moments, poses_of
from rislam_rt.slam.returns import NONE, TX, Returns, observe

BODY = Body()
CYCLE, SIGMA_A, HEADING = 0.1, 0.01, 0.3
START, VELOCITY = np.array([0.5, 0.7, 0.5]), np.array([0.3, 0.2, 0.0])
ROOF = np.array([0.5, 0.0, np.sqrt(0.75)])
FEATURES = np.array([[2.0, 1.0, 1.0], [1.5, 3.0, 2.0], START + 5.0 * ROOF])
"""Two points, and a slanted roof 2.5 m away as the image of the start: all high enough for cosines to tell of them."""
ANCHOR = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], START])
LEGS = np.array([[0, NONE, NONE], [1, NONE, NONE], [0, 2, NONE], [TX, NONE, NONE], [TX, 2, NONE]])
RETURNS = Returns(LEGS, np.array([0, 1, 0, 2, 3]), np.array([0, 1, 2, 0, 4]))
"""Either point directly; the first over the wall, on either leg; the Tx itself over the wall."""
STD = np.array([0.01, 0.01, 0.01])
START_STD, FEATURE_STD = 0.01, 0.05
PLANE = np.array([1.0, 1.0, 0.0])
"""The height is known."""


class Walk(NamedTuple):
    """What happened, the start first."""

    position: Floats
    """(K + 1, 3)."""
    velocity: Floats
    """(K + 1, 3)."""
    features: Floats
    """(F, 3)."""
    start: StartPrior
    guess: Floats
    """(F, 3) where the features were believed to be."""
    seen: Floats
    """(K, A, 3)."""


def draw_walk(cycles: int, share: float = 1.0, *, rng: np.random.Generator, features: Floats = FEATURES) -> Walk:
    """A walk drawn from the filter's own model; `share` scales every error against what the filter is told.

    Well below one no innovation is ever so large that the filter, robust as it is, would take it for an outlier.
    """
    push = SIGMA_A * share * rng.standard_normal((cycles, 3)) * PLANE
    velocity = np.concatenate([VELOCITY[None], VELOCITY + CYCLE * np.cumsum(push, axis=0)])
    steps = CYCLE * velocity[:-1] + 0.5 * CYCLE**2 * push
    position = np.concatenate([START[None], START + np.cumsum(steps, axis=0)])
    wrong = share * START_STD * rng.standard_normal((2, 3)) * PLANE
    start = StartPrior(START + wrong[0], VELOCITY + wrong[1], HEADING, START_STD, START_STD)
    guess = features + share * FEATURE_STD * rng.standard_normal(features.shape)
    seen = look(position[1:], features)
    return Walk(position, velocity, features, start, guess, seen + share * told_std() * rng.standard_normal(seen.shape))


def told_std() -> Floats:
    """(3,) what the filter takes the errors for: as it is told, and the floor that it adds."""
    return np.hypot(STD, FLOOR)


def look(position: Floats, features: Floats, heading: Floats | float = HEADING) -> Floats:
    """(K, A, 3) without noise, from positions (K, 3)."""
    poses = poses_of(position, np.broadcast_to(heading, len(position)), BODY)
    return observe(RETURNS, np.broadcast_to(features, (len(position), *features.shape)), ANCHOR, poses).seen


def with_features(particles: Particles, guess: Floats, std: float = FEATURE_STD) -> Particles:
    """Particles that know of features, each by itself."""
    return gaussian.furnish(particles, guess, std**2 * np.eye(guess.size))


def lead(
    walk: Walk, config: SlamConfig, accelerate: float = SIGMA_A, anchor: Floats = ANCHOR, *, rng: np.random.Generator
) -> list[Particles]:
    """The engine's belief after every cycle, the start first."""
    particles = with_features(gaussian.begin(walk.start, config, rng=rng), walk.guess)
    beliefs = [particles]
    for cycle, seen in enumerate(walk.seen, start=1):
        push, slot = accelerate * config.axes, cycle % config.window
        particles = gaussian.propagate(particles, CYCLE, push, HEADING, slot, config, rng=rng)
        std = np.tile(STD, (len(seen), 1))
        particles = gaussian.update(particles, RETURNS, RETURNS, anchor, BODY, seen, std, rng=rng).particles
        beliefs.append(particles)
    return beliefs


def batch(walk: Walk, seen: Floats, rows: np.ndarray, known: Floats, known_std: Floats | float) -> Moments:
    """Weighted least squares over start, all accelerations and the features: the posterior's mode and information.

    `seen` (K, R, 3) are those of the returns `rows` (R,); `known` (F, 3) the features' prior means. Returned are the
    moments over the last pose and the features, the height as given.
    """
    cycles, count = len(seen), known.size
    begin = np.concatenate([walk.start.position[:2], walk.start.velocity[:2]])

    def unfold(x: Floats) -> tuple[Floats, Floats]:
        push = x[4 : 4 + 2 * cycles].reshape(cycles, 2)
        velocity = np.concatenate([x[None, 2:4], x[2:4] + CYCLE * np.cumsum(push, axis=0)])
        flat = x[:2] + np.cumsum(CYCLE * velocity[:-1] + 0.5 * CYCLE**2 * push, axis=0)
        return np.column_stack([flat, np.full(cycles, walk.start.position[2])]), velocity[1:]

    def residual(x: Floats) -> Floats:
        features = x[4 + 2 * cycles :].reshape(known.shape)
        gap = (seen - look(unfold(x)[0], features)[:, rows]) / told_std()
        held = [(x[:4] - begin) / START_STD, x[4 : 4 + 2 * cycles] / SIGMA_A]
        return np.concatenate([gap.ravel(), *held, (x[4 + 2 * cycles :] - known.ravel()) / known_std])

    first = np.concatenate([begin, np.zeros(2 * cycles), known.ravel()])
    found = least_squares(residual, first, jac="3-point", x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    spread = np.linalg.inv(found.jac.T @ found.jac)
    place, velocity = unfold(found.x)
    mean = np.concatenate([place[-1], velocity[-1], walk.start.velocity[2:], [HEADING], found.x[4 + 2 * cycles :]])

    def last(x: Floats) -> Floats:
        return np.concatenate([unfold(x)[0][-1, :2], unfold(x)[1][-1]])

    # the last pose is linear in what was fitted
    pose = np.stack([last(column) - last(0.0 * column) for column in np.eye(len(found.x))], axis=1)
    wide = np.zeros((7 + count, len(found.x)))
    wide[[0, 1, 3, 4]] = pose
    wide[7:, 4 + 2 * cycles :] = np.eye(count)
    return Moments(mean, wide @ spread @ wide.T)


def born(particles: Particles, walk: Walk, cycles: int, *, rng: np.random.Generator) -> Particles:
    """The features from their first cycles, as the front end hands them over."""
    slots = np.arange(1, cycles + 1)
    for row, kind in ((0, POINT), (1, POINT), (2, IMAGE)):
        position, heading = gaussian.trail(particles, slots)
        parent = gaussian.moments(particles).features[0] if kind is IMAGE else None
        seen, std = walk.seen[:cycles, row], np.tile(STD, (cycles, 1))
        poses = poses_of(position, heading, BODY)
        history = History(seen, std, poses, np.zeros(cycles), 0.0, np.zeros((6, 0)))
        first = first_guess(kind, parent, ANCHOR[row], history)
        assert first is not None
        fit = fit_feature(kind, first, parent, ANCHOR[row], history, 10)
        verdict = Verdict(kind, 0 if kind is IMAGE else -1, fit)
        particles = gaussian.settle(particles, Birth(verdict, ANCHOR[row], slots, seen, std), BODY, rng=rng)
    return particles
