"""Problems that the design tests share. Drawing: a 6 x 6 panel at the ceiling's centre, agent below, image walls."""

import numpy as np
import pytest

from rislam_rt.design import DesignProblem
from rislam_rt.geometry.planes import mirror
from rislam_rt.model import Body, MapEstimate, RadioConfig, RisSpec, SlamEstimate

WALLS = [((1, 0, 0), 0.0), ((1, 0, 0), 6.0), ((0, 1, 0), 0.0), ((0, 1, 0), 6.0), ((0, 0, 1), 0.0)]


def panel_spec(rows=6, cols=6, levels=4):
    return RisSpec(rows, cols, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), levels)


def random_problem(rng, rows=3, cols=3, levels=4, samples=1, panel=2, static=2, prior=1.0):
    def complex_normal(*shape):
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    return DesignProblem(
        response=complex_normal(samples, panel, rows, cols),
        static_gain=complex_normal(samples, static),
        gradient=rng.normal(size=(samples, panel + static, 2)),
        prior=prior * np.eye(2),
        scale=1.0,
        levels=levels,
    )


def room_belief(position, rng, std=0.05):
    """Belief in the paper's room: sphere and panel, each with its images in four walls and the floor."""
    points = [np.array([2.0, 1.0, 1.0]), np.array([3.0, 3.0, 3.0])]
    strength, parent, ris = [np.sqrt(np.pi) * 0.05, 0.0], [-1, -1], [0.0, 1.0]
    for source in (0, 1):
        for normal, offset in WALLS:
            points.append(mirror(points[source], np.array(normal, dtype=np.float64), np.float64(offset)))
            parent.append(source)
            strength.append(0.85)
            ris.append(0.0)
    count = len(points)
    landmarks = MapEstimate(
        np.arange(count), np.array(points), np.tile(1e-4 * np.eye(3), (count, 1, 1)), np.array(parent),
        np.array(ris), np.array(strength), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2)),
    )  # fmt: skip
    cloud = position + std * rng.normal(size=(64, 3)) * [1.0, 1.0, 0.0]
    covariance = np.diag([std**2, std**2, std**2, 0.01, 0.01, 0.01])
    return SlamEstimate(position, np.zeros(3), 0.3, covariance, cloud, Body(), landmarks)


@pytest.fixture
def make_spec():
    return panel_spec


@pytest.fixture
def make_problem():
    return random_problem


@pytest.fixture
def make_belief():
    return room_belief


@pytest.fixture
def rng():
    return np.random.default_rng(4)


@pytest.fixture
def radio():
    return RadioConfig()
