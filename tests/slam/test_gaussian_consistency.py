"""Does the Gaussian engine know how wrong it is? NEES over many seeds, associations known."""

import numpy as np
from engine_walk import (
    ANCHOR,
    BODY,
    CYCLE,
    HEADING,
    RETURNS,
    SIGMA_A,
    START_STD,
    STD,
    born,
    draw_walk,
    look,
    told_std,
    with_features,
)

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import consistency, normalised_squares
from rislam_rt.slam import SlamConfig, StartPrior, gaussian
from rislam_rt.slam.moments import Moments

SEEDS, CYCLES, FIRST = 60, 60, 12
FLAT = np.array([0, 1, 3, 4])
"""Columns of the pose that move: horizontal position and velocity."""


def test_errors_are_as_large_as_the_filter_says() -> None:
    """Sixty walks drawn from the filter's own model, landmarks born from their first twelve cycles.

    The mean NEES of a cycle over 60 seeds lies in its two-sided 95 % interval with probability 0.95. Cycles follow each
    other closely, though: an error that the seeds happen to share lasts for some six cycles, a tenth of the run. One
    such excursion is allowed on top of the 5 %, hence 85 %.
    """
    squares = np.array([_nees(np.random.default_rng([7, seed])) for seed in range(SEEDS)])
    found = consistency(squares, len(FLAT))
    assert found.inside >= 0.85
    # the average over all cycles has no wider an interval than one cycle's
    assert found.lower < found.average.mean() < found.upper
    # the test has power: deviations wrong by a fifth, either way, would not pass
    assert consistency(squares * 0.8**2, len(FLAT)).inside < 0.85
    assert consistency(squares / 0.8**2, len(FLAT)).inside < 0.85


def _nees(rng: np.random.Generator) -> Floats:
    """(K,) of one walk."""
    config, walk = SlamConfig(window=FIRST + 1), draw_walk(CYCLES, rng=rng)
    particles = gaussian.begin(walk.start, config, rng=rng)
    squares = []
    for cycle, seen in enumerate(walk.seen, start=1):
        push, slot = SIGMA_A * config.axes, cycle % config.window
        particles = gaussian.propagate(particles, CYCLE, push, HEADING, slot, config, rng=rng)
        if cycle == FIRST:
            particles = born(particles, walk, FIRST, rng=rng)
        elif cycle > FIRST:
            std = np.tile(STD, (len(seen), 1))
            particles = gaussian.update(particles, RETURNS, RETURNS, ANCHOR, BODY, seen, std, rng=rng).particles
        squares.append(_square(gaussian.moments(particles), walk.position[cycle], walk.velocity[cycle]))
    return np.array(squares)


def _square(moments: Moments, position: Floats, velocity: Floats) -> float:
    error = moments.mean[:6] - np.concatenate([position, velocity])
    return float(normalised_squares(error[FLAT], moments.covariance[np.ix_(FLAT, FLAT)]))


def test_estimated_heading_errs_as_much_as_the_filter_says() -> None:
    """Thirty walks on which the agent turns at random, and nobody tells it: pose and heading together.

    Every tenth cycle lies in its 99.9 % interval, and so do all three with probability 0.997 at least.
    """
    squares = np.array([_turning_nees(np.random.default_rng([11, seed])) for seed in range(30)])
    assert consistency(squares, 5, level=0.999).inside == 1.0


def _turning_nees(rng: np.random.Generator) -> Floats:
    """(3,) at cycles 10, 20, 30."""
    config, cycles = SlamConfig(heading="estimated", turn_std=0.05, window=12), 30
    walk = draw_walk(cycles, rng=rng)
    course = HEADING + 0.05 * np.sqrt(CYCLE) * np.cumsum(rng.standard_normal(cycles))
    seen = look(walk.position[1:], walk.features, course)
    seen = seen + told_std() * rng.standard_normal(seen.shape)
    start = StartPrior(
        walk.start.position, walk.start.velocity, HEADING + 0.03 * rng.standard_normal(), START_STD, START_STD, 0.03
    )
    particles = with_features(gaussian.begin(start, config, rng=rng), walk.guess)
    squares, columns = [], np.append(FLAT, 6)
    for cycle in range(1, cycles + 1):
        push, slot = SIGMA_A * config.axes, cycle % config.window
        particles = gaussian.propagate(particles, CYCLE, push, 9.9, slot, config, rng=rng)
        std = np.tile(STD, (len(seen[0]), 1))
        particles = gaussian.update(particles, RETURNS, RETURNS, ANCHOR, BODY, seen[cycle - 1], std, rng=rng).particles
        if cycle % 10 == 0:
            moments = gaussian.moments(particles)
            truth = np.concatenate([walk.position[cycle], walk.velocity[cycle], course[cycle - 1 : cycle]])
            error = (moments.mean[:7] - truth)[columns]
            squares.append(float(normalised_squares(error, moments.covariance[np.ix_(columns, columns)])))
    return np.array(squares)
