"""What is reported over all turns and mirror images, against samples of them."""

import numpy as np
import pytest
from rooms import BODY, CYCLE, HEADING, RADIO, build_room, measurement_of

from rislam_rt.model import SensorModel
from rislam_rt.slam.schemes import bp_slam
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory, advance, begin
from rislam_rt.slam.schemes.shared.gauge import over_all_turns

PLACE, WALK = np.array([0.5, 0.7]), np.array([0.08, 0.06])
ALONG, ACROSS = np.array([0.8, 0.6]), np.array([-0.6, 0.8])


def course_after(cycles: int) -> AgentTrajectory:
    course = begin(PLACE, WALK, 0.01, 0.01)
    for cycle in range(cycles):
        course, _ = advance(course, CYCLE, np.full(2, 0.01), cycle % 40 == 0)
    return course


def turned(course: AgentTrajectory, angle: float) -> AgentTrajectory:
    """The same shape at another direction, mean and covariance: the course that another gauge would hold."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    big = np.kron(np.eye(len(course.mean) // 2), turn)
    start = np.kron(np.ones(len(course.mean) // 4), np.r_[PLACE, 0.0, 0.0])
    return course._replace(mean=start + big @ (course.mean - start), covariance=big @ course.covariance @ big.T)


def certain(course: AgentTrajectory) -> AgentTrajectory:
    return course._replace(covariance=1e-12 * course.covariance)


def test_nothing_measured_is_dead_reckoning() -> None:
    """Mean and covariance of the start prior and the motion, up to rounding."""
    course = course_after(100)
    found = over_all_turns(course)
    assert np.allclose(found[0], course.mean[:4], rtol=0.0, atol=1e-12)
    assert np.allclose(found[1], course.covariance[:4, :4], rtol=1e-9, atol=1e-15)


def test_a_known_length_against_samples_of_its_arc() -> None:
    """Moments of the end of a course of known length, turned at random about a random start; to five standard errors.

    The displacement's spread across is that of dead reckoning to second order in its angle: 3 % of it at 0.17 rad.
    """
    course = certain(course_after(100))
    found, draws = over_all_turns(course), 40_000
    rng = np.random.default_rng(4)
    length = np.linalg.norm(course.mean[:2] - PLACE)
    angle = np.sqrt(ACROSS @ course.blind[:2, :2] @ ACROSS - 0.01**2) / length * rng.standard_normal(draws)
    way = length * (np.cos(angle)[:, None] * ALONG + np.sin(angle)[:, None] * ACROSS)
    sample = PLACE + way + 0.01 * rng.standard_normal((draws, 2))
    spread = sample.std(axis=0)
    assert np.all(np.abs(sample.mean(axis=0) - found[0][:2]) < 5.0 * spread / np.sqrt(draws))
    variance = found[1][:2, :2]
    assert ALONG @ variance @ ALONG == pytest.approx(np.var(sample @ ALONG), rel=5.0 * np.sqrt(8.0 / draws))
    assert ACROSS @ variance @ ACROSS == pytest.approx(np.var(sample @ ACROSS), rel=0.03 + 5.0 * np.sqrt(2.0 / draws))


@pytest.mark.parametrize("angle", [0.3, -1.2, 3.0])
def test_the_gauge_does_not_matter(angle: float) -> None:
    """Whichever of the equivalent courses the filter works at, the same is reported."""
    course = course_after(60)
    course = course._replace(covariance=0.2 * course.covariance)
    one, other = over_all_turns(course), over_all_turns(turned(course, angle))
    assert np.allclose(one[0], other[0], rtol=0.0, atol=1e-12)
    assert np.allclose(one[1], other[1], rtol=1e-9, atol=1e-12)


def test_an_agent_that_was_told_to_stand_has_no_direction() -> None:
    """The filter's own moments, and no division by zero."""
    course = begin(PLACE, np.zeros(2), 0.01, 0.01)
    course, _ = advance(course, CYCLE, np.full(2, 0.01), True)
    assert np.array_equal(over_all_turns(course)[0], course.mean[:4])


def test_an_estimated_height_is_a_proper_belief() -> None:
    """Three axes: positive definite, finite, and level moments as with two."""
    config = bp_slam.BpSlamConfig(sigma_a=0.01, height="estimated")
    room, rng = build_room(5, 1), np.random.default_rng(1)
    state = bp_slam.init(room.start, BODY, None, SensorModel(RADIO), config, rng=rng)
    for cycle in range(30):
        nothing = measurement_of(np.zeros(0))
        state, _ = bp_slam.step(state, nothing, None, CYCLE if cycle else 0.0, HEADING, config, rng=rng)
    belief = bp_slam.estimate(state, config)
    assert np.linalg.eigvalsh(belief.covariance)[0] > 0.0
    assert np.allclose(belief.covariance, state.agent.course.covariance[:6, :6], rtol=1e-9, atol=1e-15)
    assert np.allclose(belief.position, room.start.position + 29 * CYCLE * room.start.velocity, rtol=0.0, atol=1e-12)
