"""The moving form of BP-SLAM: course, Gaussian sums and their messages against closed forms."""

import numpy as np
import pytest
from rooms import BODY, CYCLE, HEADING, RADIO, build_room

from rislam_rt.model import SensorModel
from rislam_rt.slam.schemes import bp_slam
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory, advance, begin
from rislam_rt.slam.schemes.shared.gaussian_sums import Sums, born, carry, predict_ranges, prune, unit_of
from rislam_rt.slam.schemes.shared.ranges import Bistatic, Odds, Scan, birth_ratio
from rislam_rt.slam.schemes.shared.sum_correction import absorb, claims

CONFIG = bp_slam.BpSlamConfig(sigma_a=0.01)
MODEL = Bistatic(np.array([-0.05, 0.0, 0.0]), np.array([0.05, 0.0, 0.0]))
PUSH = np.array([0.01, 0.01])
PLACE = np.array([0.5, 0.7, 0.5])


def course_after(cycles: int, stride: int) -> AgentTrajectory:
    course = begin(PLACE[:2], np.array([0.07, 0.07]), 0.01, 0.01)
    for cycle in range(cycles):
        course, _ = advance(course, CYCLE, PUSH, cycle % stride == 0)
    return course


def one_feature(course: AgentTrajectory, kinds: tuple[float, float, float] = (1.0, 0.0, 0.0)) -> Sums:
    return born(np.array([4.0]), np.array([0.005]), np.array([kinds]), np.array([0.9]), course, PLACE, 6, 0)


def test_a_course_that_leaves_states_out_keeps_the_present_one() -> None:
    """The marginal of the present state is the same whatever is kept of the past, up to rounding."""
    every, few = course_after(23, 1), course_after(23, 10)
    assert len(few.mean) < len(every.mean)
    assert np.allclose(few.covariance[:4, :4], every.covariance[:4, :4], rtol=1e-12, atol=0.0)


@pytest.mark.parametrize("stride", [1, 7])
def test_a_feature_keeps_its_moments_over_a_motion(stride: int) -> None:
    """Mean and covariance of the feature itself do not change as the agent moves on, whatever is left out.

    The regression holds a ridge of 1e-10 on correlations that differ from one by 1e-5 and more: 1e-4 of it is allowed.
    """
    rng = np.random.default_rng(1)
    course = course_after(5, 1)
    sums = one_feature(course)
    sums = sums._replace(slope=rng.normal(0.0, 0.3, sums.slope.shape))

    def spread(sums: Sums, course: AgentTrajectory) -> np.ndarray:
        return sums.covariance + sums.slope @ course.covariance @ sums.slope.swapaxes(1, 2)

    wanted = spread(sums, course)
    for cycle in range(20):
        course, step = advance(course, CYCLE, PUSH, cycle % stride == 0)
        sums = carry(sums, step, np.zeros(3))
    got = spread(sums, course)
    assert np.allclose(got[:, 1:, 1:], wanted[:, 1:, 1:], rtol=1e-4)
    # the first number also takes what the base's regression missed, which only widens it
    assert np.all(got[:, 0, 0] > (1.0 - 1e-4) * wanted[:, 0, 0])


def test_the_range_of_a_gaussian_is_that_of_its_point() -> None:
    """Law of cosines against the points themselves; curvature is none as the spread is none.

    `LEAST_SPEED` shortens the direction of the walk by (0.001 / 0.1)^2 / 2, of the 4 m less than 0.5 mm.
    """
    course = course_after(1, 1)
    sums = one_feature(course)
    sums = sums._replace(covariance=1e-20 * sums.covariance, mean=sums.mean + np.array([0.1, 0.3, 0.05]))
    agent = PLACE + np.array([0.3, 0.1, 0.0])
    walk, speed = sums.walk[sums.owner], sums.speed[sums.owner]
    point = PLACE + sums.mean[:, :1] * unit_of(sums.mean, walk, speed)
    wanted = sum(np.linalg.norm(point - agent - end, axis=1) for end in (MODEL.tx, MODEL.rx))
    assert np.allclose(predict_ranges(sums, course, agent, MODEL).length, wanted, rtol=0.0, atol=5e-4)


def test_the_range_to_a_wall_is_that_of_the_image() -> None:
    """A wall straight ahead: the image of the Tx is twice its distance away."""
    course = course_after(1, 1)
    sums = one_feature(course, (0.0, 1.0, 0.0))
    sums = sums._replace(covariance=1e-20 * sums.covariance, mean=np.array([[2.0, 1.0, 0.0]] * 3))
    ahead = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0])
    # the wall's normal is the walk but for sqrt(LEAST_ACROSS) = 0.01 rad across
    depth = 2.0 * (2.0 - ahead @ (0.4 * ahead + MODEL.tx))
    wanted = np.linalg.norm(MODEL.tx - MODEL.rx + depth * ahead)
    assert predict_ranges(sums, course, PLACE + 0.4 * ahead, MODEL).length[0] == pytest.approx(wanted, abs=3e-3)


def test_one_gaussian_and_one_certain_range_are_a_kalman_filter() -> None:
    """Joint posterior of course and feature in moments against `P - P h h' P / s`, up to the share of misses."""
    odds = Odds(1.0 - 1e-12, 1.0, 30.0)
    course = course_after(4, 2)
    rows = prune(one_feature(course), 0.0, 0.9, 5)
    rng = np.random.default_rng(3)
    sums = rows._replace(
        existence=np.array([1.0]), slope=rng.normal(0.0, 0.2, rows.slope.shape), covariance=1e-3 * rows.covariance
    )
    sums = Sums(*sums[:7], *(column[:1] for column in sums[7:-1]), np.ones(1))
    sight = predict_ranges(sums, course, PLACE, MODEL)
    scan = Scan(sight.length + 0.01, np.array([0.02]))
    fresh = np.array([1.0 + 1e-12])
    found = claims(sums, sight, course, scan, fresh, odds)
    after, moved = absorb(sums, sight, course, scan, found, odds)
    direction = sight.by_course[0]
    spread = direction @ course.covariance @ direction + sight.own[0] + 0.02**2
    gain = course.covariance @ direction / spread
    assert np.allclose(moved.mean - course.mean, 0.01 * gain, rtol=1e-6, atol=1e-12)
    assert np.allclose(moved.covariance, course.covariance - spread * np.outer(gain, gain), rtol=1e-6, atol=1e-12)
    cross = sums.slope[0] @ course.covariance @ direction + sums.covariance[0] @ sight.by_mean[0]
    assert np.allclose(after.mean[0] - sums.mean[0], 0.01 * cross / spread, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("existence", [0.1, 0.5, 0.99])
@pytest.mark.parametrize("ranges", [0, 1])
def test_existence_after_a_cycle(existence: float, ranges: int) -> None:
    """One feature of one Gaussian, no range or one: clutter, a new feature or this one; Bayes, up to rounding."""
    odds, course = Odds(0.7, 1.0, 30.0), course_after(4, 2)
    sums = prune(one_feature(course), 0.0, 0.9, 5)
    sums = Sums(*sums[:5], np.array([existence]), sums[6], *(column[:1] for column in sums[7:-1]), np.ones(1))
    sight = predict_ranges(sums, course, PLACE, MODEL)
    scan = Scan(sight.length[:ranges] + 0.01, np.full(ranges, 0.02))
    fresh = 1.0 + birth_ratio(scan.length, 6.0, odds)
    after, _ = absorb(sums, sight, course, scan, claims(sums, sight, course, scan, fresh, odds), odds)
    direction = sight.by_course[0]
    variance = direction @ course.covariance @ direction + sight.own[0] + 0.02**2
    density = np.exp(-0.5 * 0.01**2 / variance) / np.sqrt(2.0 * np.pi * variance)
    ratio = ranges * odds.detection_probability * density / odds.clutter_density
    there = existence * ((1.0 - odds.detection_probability) * np.prod(fresh) + ratio)
    assert after.existence[0] == pytest.approx(there / (there + (1.0 - existence) * np.prod(fresh)), rel=1e-9)


def test_a_feature_that_made_no_range_pulls_nothing() -> None:
    """To the last bit: what is missed tells neither of the agent nor which of the Gaussians it is."""
    odds, course = Odds(0.7, 1.0, 30.0), course_after(4, 2)
    sums = one_feature(course)
    sight = predict_ranges(sums, course, PLACE, MODEL)
    scan, none = Scan(np.zeros(0), np.zeros(0)), np.zeros(0)
    after, moved = absorb(sums, sight, course, scan, claims(sums, sight, course, scan, none, odds), odds)
    np.testing.assert_array_equal(moved.mean, course.mean)
    np.testing.assert_array_equal(moved.covariance, 0.5 * (course.covariance + course.covariance.T))
    np.testing.assert_array_equal(after.share, sums.share)


def test_birth_ratio_integrates_to_the_undetected() -> None:
    """Over all ranges the density of first detections holds `p_d` times the undetected; trapezoids, to 1e-4."""
    odds, length = Odds(0.7, 1.0, 30.0), np.linspace(1e-6, 30.0, 4001)
    density = birth_ratio(length, 6.0, odds) * odds.clutter_density
    assert np.trapezoid(density, length) == pytest.approx(6.0 * odds.detection_probability, rel=1e-4)


def test_a_turn_about_the_start_stays_as_unknown_as_it_was() -> None:
    """Six points, 12 s: along the walk the error is known better than by reckoning, across it is not.

    Four runs: the mean square of 8 errors over its variance is below 2.5 with probability 0.99 (chi^2, 8 dof).
    """
    config, squares = bp_slam.BpSlamConfig(sigma_a=0.001), []
    for seed in range(4):
        room, rng = build_room(80, seed), np.random.default_rng(2)
        state = bp_slam.init(room.start, BODY, None, SensorModel(RADIO), config, rng=rng)
        for cycle, measurement in enumerate(room.measurements):
            state, _ = bp_slam.step(state, measurement, None, CYCLE if cycle else 0.0, HEADING, config, rng=rng)
        belief = bp_slam.estimate(state, config)
        error, spread = (belief.position - room.position[-1])[:2], belief.covariance[:2, :2]
        squares.append(error @ np.linalg.solve(spread, error) / 2.0)
        along, across = np.array([1.0, 1.0]) / np.sqrt(2.0), np.array([1.0, -1.0]) / np.sqrt(2.0)
        reckoned = np.hypot(0.01, 0.01 * CYCLE * (len(room.measurements) - 1))
        assert np.sqrt(along @ spread @ along) < 0.4 * reckoned
        # the walk that the filter was told is off the diagonal by 0.1 rad
        assert np.sqrt(across @ spread @ across) == pytest.approx(reckoned, rel=0.1)
    assert np.mean(squares) < 2.5
