"""A walk whose associations are known: direct returns of a few points, and of their images in walls."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import Body
from rislam_rt.slam import NestedConfig, SlamConfig
from rislam_rt.slam.nested.particles.engine_choice import pick_engine
from rislam_rt.slam.nested.particles.landmark_cloud import CloudEngine
from rislam_rt.slam.nested.particles.new_landmark import LandmarkHistory, initialise_landmark
from rislam_rt.slam.nested.particles.particle_belief import Nested, draw, gaussian, propagate, remember, renew
from rislam_rt.slam.nested.particles.weights import Seen, update
from rislam_rt.slam.predicted_returns import NONE, Returns, observe, poses_of
from rislam_rt.slam.window.landmarks.path_forms import compile_forms

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
WINDOW = 40
"""Poses of the trail."""


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

    moments: list[tuple[Floats, Floats]]
    """Mean and covariance after every cycle."""
    nees: Floats
    """(K,) of horizontal position and velocity, chi^2 with 4 degrees of freedom."""
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
    truth, engine = room(cycles, walls, rng=rng), pick_engine(config.nested.engine)
    wrong = 0.01 * rng.standard_normal((2, 3)) * [1.0, 1.0, 0.0]
    start = np.concatenate([START + wrong[0], VELOCITY + wrong[1], [HEADING]])
    spread = 0.01 * np.array([1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    belief = draw(start, spread, config.nested.num_agents, rng=own)
    history: list[Floats] = []
    moments, nees, resampled = [], [], 0
    for cycle in range(1, cycles + 1):
        belief = remember(propagate(belief, CYCLE, SIGMA_A * config.axes, 0.0, rng=own), WINDOW)
        spans = CYCLE * np.arange(len(belief.trail))[::-1]
        seen = measure(truth, cycle, std, rng=rng)
        if cycle <= FIRST:
            history.append(seen)
        if cycle == FIRST:
            belief = born(belief, truth, np.array(history), std, spans, config.nested, engine, rng=own)
        if cycle > FIRST:
            told = Seen(truth.returns, truth.anchor, BODY, seen, np.tile(std**2, (len(seen), 1)))
            belief = update(belief, told, config.nested, engine)[0]
        belief, done = renew(belief, spans, config.nested, engine, rng=own)
        resampled += done
        moments.append(gaussian(belief))
        nees.append(pose_nees(*moments[-1], truth, cycle))
    return Run(moments, np.array(nees), resampled)


def pose_nees(mean: Floats, covariance: Floats, truth: Truth, cycle: int) -> float:
    """Normalised squared error of horizontal position and velocity."""
    columns = np.array([0, 1, 3, 4])
    error = mean[columns] - np.concatenate([truth.position[cycle], truth.velocity[cycle]])[columns]
    return float(error @ np.linalg.solve(covariance[np.ix_(columns, columns)], error))


def born(
    belief: Nested, truth: Truth, history: Floats, std: Floats, spans: Floats, config: NestedConfig,
    engine: CloudEngine, *, rng: np.random.Generator,
) -> Nested:  # fmt: skip
    """Landmarks from the first cycles, as the front end would hand them over: sought 0.1 m from where they are, walls
    known to be upright."""
    for row in range(history.shape[1]):
        wall = row >= len(POINTS)
        way = np.array([[0, NONE, NONE, int(wall) or NONE, NONE]])
        known = np.array([0] if wall else [], dtype=np.int64)
        anchor = np.array([np.zeros(3), truth.anchor[row]]) if wall else np.zeros((1, 3))
        upright = 0.1 if wall else 10.0
        place = truth.features[row] + np.array([0.1, 0.1, min(upright, 0.1)]) * rng.standard_normal(3)
        prior, variance = np.diag([100.0, 100.0, upright**2]), np.tile(std**2, (FIRST, 1))
        past = LandmarkHistory(
            compile_forms(way), known, anchor, place, prior, np.arange(1, FIRST + 1), history[:, row], variance
        )  # fmt: skip
        belief = initialise_landmark(belief, past, BODY, spans, config, engine, rng=rng)
    return belief
