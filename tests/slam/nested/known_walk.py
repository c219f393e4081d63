"""A walk whose associations are known: direct returns of a few points, and of their images in walls."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import Body
from rislam_rt.slam import SlamConfig, StartPrior
from rislam_rt.slam.moments import poses_of
from rislam_rt.slam.nested.belief_moments import Moments
from rislam_rt.slam.nested.birth import Birth, BirthDecision
from rislam_rt.slam.nested.hypotheses import IMAGE, POINT, History, fit_feature, initial_value
from rislam_rt.slam.nested.particles import operations
from rislam_rt.slam.returns import NONE, Returns, observe

BODY = Body(np.array([-0.04388, -0.02397, 0.0]), np.array([0.04388, 0.02397, 0.0]))
"""The method's baseline of 0.1 m, turned 0.5 rad against the heading."""
START, VELOCITY = np.array([0.5, 0.7, 0.5]), np.array([0.0707, 0.0707, 0.0])
POINTS = np.array([[2.0, 1.0, 1.0], [3.0, 3.0, 3.0]])
"""Scatterer and panel of the paper's room."""
CYCLE, SIGMA_A, HEADING = 0.1, 0.01, 0.3
STD = np.array([0.01, 0.01, 0.01])
"""Of length [m] and cosines: about 25 dB over all antennas."""
FIRST = 12
"""Cycles of history that the landmarks are born from."""
DEAF = np.zeros(3)


class Truth(NamedTuple):
    """What happened."""

    position: Floats
    """(K + 1, 3) [m], the start first."""
    velocity: Floats
    """(K + 1, 3)."""
    features: Floats
    """(F, 3) points and images of the anchor."""
    anchor: Floats
    """(F, 3)."""
    returns: Returns


class Run(NamedTuple):
    """What a filter made of it."""

    moments: list[Moments]
    """After every cycle."""
    nees: Floats
    """(K,) of horizontal position and velocity, chi^2 with 4 degrees of freedom."""
    particles: operations.PointParticles
    resampled: int


def room(cycles: int, walls: int, *, rng: np.random.Generator) -> Truth:
    """A walk drawn from the motion model among the points, seen directly and in up to two walls."""
    acceleration = SIGMA_A * rng.standard_normal((cycles, 3)) * [1.0, 1.0, 0.0]
    velocity = np.concatenate([VELOCITY[None], VELOCITY + CYCLE * np.cumsum(acceleration, axis=0)])
    steps = CYCLE * velocity[:-1] + 0.5 * CYCLE**2 * acceleration
    position = np.concatenate([START[None], START + np.cumsum(steps, axis=0)])
    planes = [(np.array([0.0, 1.0, 0.0]), 6.0), (np.array([1.0, 0.0, 0.0]), 6.0)][:walls]
    images = [START + 2.0 * (d - START @ n) * n for n, d in planes]
    features = np.concatenate([POINTS, *[image[None] for image in images]])
    anchor = np.concatenate([np.zeros_like(POINTS), np.tile(START, (walls, 1))])
    legs = [[0, NONE, NONE], [1, NONE, NONE], *[[0, 2 + k, NONE] for k in range(walls)]]
    ends = np.array(legs), np.array([0, 1] + [0] * walls), np.arange(2 + walls)
    return Truth(position, velocity, features, anchor, Returns(*ends))


def measure(truth: Truth, cycle: int, std: Floats, *, rng: np.random.Generator) -> Floats:
    """(A, 3) lengths and cosines of all returns."""
    poses = poses_of(truth.position[cycle], np.asarray(HEADING), BODY)
    seen = observe(truth.returns, truth.features, truth.anchor, poses).seen
    return np.asarray(seen + std * rng.standard_normal(seen.shape))


def walk(config: SlamConfig, cycles: int, walls: int = 0, std: Floats = STD, *, rng: np.random.Generator) -> Run:
    """A filter led through a walk; its start prior is as wrong as it says."""
    rng, own = rng.spawn(2)
    truth = room(cycles, walls, rng=rng)
    wrong = 0.01 * rng.standard_normal((2, 3)) * [1.0, 1.0, 0.0]
    start = StartPrior(START + wrong[0], VELOCITY + wrong[1], HEADING)
    particles = operations.begin(start, config, rng=own)
    history: list[Floats] = []
    moments, nees, resampled = [], [], 0
    for cycle in range(1, cycles + 1):
        accelerate = SIGMA_A * config.axes
        particles = operations.propagate(
            particles, CYCLE, accelerate, HEADING, cycle % config.nested.window, config, rng=own
        )
        seen = measure(truth, cycle, std, rng=rng)
        if cycle <= FIRST:
            history.append(seen)
        if cycle == FIRST:
            particles = born(particles, truth, np.array(history), std, rng=own)
        if cycle > FIRST:
            wide = np.tile(std, (len(seen), 1))
            told = operations.update(particles, truth.returns, truth.returns, truth.anchor, BODY, seen, wide, rng=own)
            particles = told.particles
        particles, done = operations.resample(particles, config, rng=own)
        resampled += done
        moments.append(operations.moments(particles))
        nees.append(pose_nees(moments[-1], truth, cycle))
    return Run(moments, np.array(nees), particles, resampled)


def pose_nees(moments: Moments, truth: Truth, cycle: int) -> float:
    """Normalised squared error of horizontal position and velocity."""
    columns = np.array([0, 1, 3, 4])
    error = moments.mean[columns] - np.concatenate([truth.position[cycle], truth.velocity[cycle]])[columns]
    return float(error @ np.linalg.solve(moments.covariance[np.ix_(columns, columns)], error))


def born(
    particles: operations.PointParticles, truth: Truth, history: Floats, std: Floats, *, rng: np.random.Generator
) -> operations.PointParticles:
    """Landmarks from the first cycles, as the front end would hand them over."""
    slots = np.arange(1, FIRST + 1)
    position, heading = operations.trail(particles, slots)
    poses = poses_of(position, heading, BODY)
    known = operations.moments(particles).position
    for row in range(history.shape[1]):
        wall = row >= len(POINTS)
        kind, parent = (IMAGE, 0) if wall else (POINT, -1)
        point = operations.moments(particles).features[0] if wall else None
        past = History(history[:, row], np.tile(std, (FIRST, 1)), poses, np.zeros(FIRST), 0.0, np.zeros((6, 0)))
        anchor = truth.anchor[row]
        first = initial_value(kind, point, anchor, past)
        assert first is not None
        fit = fit_feature(kind, first, point, anchor, past, 10)
        birth = Birth(BirthDecision(kind, parent, fit), anchor, slots, past.seen, past.std)
        particles = operations.initialise_landmark(particles, birth, BODY, rng=rng)
    assert known.shape == (3,)
    return particles
