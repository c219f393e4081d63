"""How strongly the agent manoeuvres upwards: one datum counts once, and a climb is a climb."""

import numpy as np
import pytest

from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.motion.motion_learning import (
    assumed_precision,
    manoeuvre_share,
    nearer_floor,
    vertical_information,
)
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic

DT, CYCLES = 0.1, 40
LIVELY = motion.first_motion_mode(1.0)


def window_of(height, std, floor=1e-3):
    """Window of 40 poses whose heights (40,) [m] were measured with deviations (40,) [m], on a level floor's prior."""
    begin = window_gaussian.begin(np.zeros(3), np.zeros(3), np.array([1e-5] * 3 + [0.01, 0.01, 1e-3, 0.0]))
    window = begin
    for _ in range(CYCLES - 1):
        window = window_gaussian.extend(window, DT, np.full(3, floor**-2.0))
    hessian, gradient, middle = (np.array(field) for field in window.slots)
    hessian[:, 2, 2], gradient[:, 2] = std**-2.0, -height * std**-2.0
    return window_gaussian.solve(window._replace(slots=Quadratic(hessian, gradient, middle)))


def share_of(window):
    """The share of what the chain of single steps would ask for."""
    return learnt(window)[0]


def learnt(window, *, was_level=True):
    """That share, and the probability that the height does not change at all."""
    precision = np.full(CYCLES - 1, motion.expected_precision(LIVELY))
    return manoeuvre_share(vertical_information(window), precision, was_level=was_level)


def test_one_datum_does_not_make_an_agent_climb():
    """A height that is told once, three deviations off, 2.4 m: each step alone takes it for its own."""
    std = np.full(CYCLES, 1e6)
    std[-1] = 0.8
    window = window_of(np.where(np.arange(CYCLES) == CYCLES - 1, 2.4, 0.0), std)
    size = len(window.head)
    single = motion.log_likelihood(
        window.accel[:, 2:3], window.covariance[size + 2 :: 3, size + 2 :: 3].diagonal()[:, None, None],
        window.solved[:, 2],
    )  # fmt: skip
    # what forty steps together seemed to tell, and the most that a datum three deviations off can
    assert (single[:, -1] - single[:, 0]).sum() > 10.0 > 0.5 * 3.0**2
    assert share_of(window) < 0.5


@pytest.mark.parametrize("speed", [0.1, 0.3])
def test_a_climb_is_one(speed):
    height = speed * DT * np.maximum(np.arange(CYCLES) - 20, 0)
    assert share_of(window_of(height, np.full(CYCLES, 0.01))) > 0.7


def test_a_level_floor_is_one():
    rng = np.random.default_rng(0)
    shares = [share_of(window_of(0.01 * rng.standard_normal(CYCLES), np.full(CYCLES, 0.01))) for _ in range(20)]
    assert np.mean(shares) < 0.1


def test_nothing_heard_leaves_a_manoeuvre_a_rare_event():
    share = share_of(window_of(np.zeros(CYCLES), np.full(CYCLES, 1e6)))
    assert share == pytest.approx(2.5 * 0.02 / (1.0 + 4.0 * 0.02), rel=1e-3)


def test_the_floor_makes_nothing_livelier():
    calm = np.eye(len(LIVELY))[0]
    np.testing.assert_array_equal(nearer_floor(calm[None], 0.0)[0], calm)
    floor = motion.first_motion_mode(0.0)
    np.testing.assert_allclose(nearer_floor(LIVELY[None], 0.0)[0], floor)
    np.testing.assert_allclose(nearer_floor(LIVELY[None], 1.0)[0], LIVELY)
    variance = motion.expected_variance(np.stack([nearer_floor(LIVELY[None], share)[0] for share in (0.0, 0.5, 1.0)]))
    assert (np.diff(variance) > 0.0).all()


def test_a_level_floor_is_told_from_an_uneven_one():
    """Heights to 0.1 mm: constant ones speak for a level floor, a random walk of the velocity against it."""
    rng, std = np.random.default_rng(1), np.full(CYCLES, 1e-4)
    steps = np.cumsum(np.cumsum(CONSTANTS.level * DT**2 * rng.standard_normal((20, CYCLES)), axis=1), axis=1)
    noise = 1e-4 * rng.standard_normal((20, CYCLES))
    level = [learnt(window_of(one, std))[1] for one in noise]
    uneven = [learnt(window_of(one, std))[1] for one in noise + steps]
    assert np.mean(level) > 0.95
    assert np.median(uneven) < 0.05


def test_nothing_heard_leaves_floors_as_level_as_other_surfaces():
    still = learnt(window_of(np.zeros(CYCLES), np.full(CYCLES, 1e6)))[1]
    assert still == pytest.approx(9.0 / (9.0 + 1.0 + 4.0 * 0.02), rel=1e-3)


def test_from_an_uneven_floor_a_level_one_is_a_rare_event():
    still = learnt(window_of(np.zeros(CYCLES), np.full(CYCLES, 1e6)), was_level=False)[1]
    rare = CONSTANTS.rare
    assert still == pytest.approx(rare / (rare + 1.0 + 4.0 * rare), rel=1e-3)


@pytest.mark.parametrize("speed", [0.1, 0.3])
def test_who_climbs_is_on_no_level_floor(speed):
    height = speed * DT * np.maximum(np.arange(CYCLES) - 20, 0)
    assert learnt(window_of(height, np.full(CYCLES, 0.01)))[1] < 0.01


def test_in_no_time_a_told_motion_stays_finite():
    """Two measurements of one time stamp, the heading estimated: the belief is what it was."""
    config = SlamConfig(motion="told", heading="estimated")
    window = window_gaussian.begin(np.zeros(3), np.ones(3), np.full(7, 0.1), turns=True)
    later = window_gaussian.extend(window, 0.0, assumed_precision(config, 0.0, turns=True))
    for before, after in zip(window_gaussian.now(window), window_gaussian.now(later), strict=True):
        np.testing.assert_allclose(after, before)
