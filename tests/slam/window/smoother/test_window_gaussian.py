"""The window's Gaussian against a batch least squares of another making; what slides out is not lost."""

import numpy as np
import pytest

from rislam_rt.slam.window.smoother import motion, window_features, window_gaussian
from rislam_rt.slam.window.smoother.direction_priors import DirectionPriors, no_holds
from rislam_rt.slam.window.smoother.motion_basis import HEAD, POSE
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic

DT, CYCLES, SIGMA_A = 0.1, 12, 0.5


def _sighting(rng):
    """A linear measurement of pose (4) and one feature (3): rows, value, and the weight of each row."""
    rows = rng.standard_normal((3, POSE + 3))
    rows[:, 3] = 0.0
    return rows, rng.standard_normal(3), rng.uniform(1.0, 100.0, 3)


def _filtered(sightings, start, std, keep, turned):
    """The window's answer, at most `keep` poses long."""
    window = window_gaussian.begin(start[:3], start[3:6], std)
    window = window_features.add_feature(window, np.ones(3), no_holds(), ridge=1.0)
    for cycle, (rows, value, weight) in enumerate(sightings):
        if cycle:
            while window.num_poses >= keep:
                window = window_gaussian.slide(window)
            window = window_gaussian.extend(window, DT, np.full(3, SIGMA_A**-2.0), velocity_turn=turned[cycle])
        hessian, gradient, middle = (field.copy() for field in window.slots)
        spot = np.concatenate([window_gaussian.poses(window)[-1], window.features[0]])
        hessian[-1] = rows.T @ (weight[:, None] * rows)
        gradient[-1], middle[-1] = rows.T @ (weight * (rows @ spot - value)), spot
        window = window_gaussian.solve(window._replace(slots=Quadratic(hessian, gradient, middle)))
    return window_gaussian.now(window)


def _batch(sightings, start, std, turned):
    """All cycles at once, in positions, velocities and the feature, from the motion's own recursion."""
    free = np.flatnonzero(std > 0.0)
    count = len(sightings)
    # unknowns: start's free numbers (of position and velocity), accelerations, feature
    size = len(free) + 3 * (count - 1) + 3
    position, velocity = np.zeros((3, size)), np.zeros((3, size))
    offset_p, offset_v = start[:3].copy(), start[3:6].copy()
    for column, axis in enumerate(free):
        (position if axis < 3 else velocity)[axis % 3, column] = 1.0
    feature = np.zeros((3, size))
    feature[:, -3:] = np.eye(3)
    rows = [np.diag(np.concatenate([1.0 / std[free], np.full(3 * (count - 1), 1.0 / SIGMA_A), np.ones(3)]))]
    values = [np.concatenate([np.zeros(size - 3), np.ones(3)])]
    for cycle, (design, value, weight) in enumerate(sightings):
        if cycle:
            at = len(free) + 3 * (cycle - 1)
            push = np.zeros((3, size))
            push[:, at : at + 3] = np.eye(3)
            cos, sin = np.cos(turned[cycle]), np.sin(turned[cycle])
            turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
            later, offset = turn @ velocity + DT * push, turn @ offset_v
            position = position + 0.5 * DT * (velocity + later)
            offset_p = offset_p + 0.5 * DT * (offset_v + offset)
            velocity, offset_v = later, offset
        root = np.sqrt(weight)[:, None]
        rows.append(root * (design[:, :3] @ position + design[:, 4:] @ feature))
        values.append(np.sqrt(weight) * (value - design[:, :3] @ offset_p))
    matrix, right = np.concatenate(rows), np.concatenate(values)
    solution = np.linalg.lstsq(matrix, right, rcond=None)[0]
    covariance = np.linalg.inv(matrix.T @ matrix)
    wide = np.concatenate([position, velocity, feature])
    return wide @ solution + np.concatenate([offset_p, offset_v, np.zeros(3)]), wide @ covariance @ wide.T


@pytest.mark.parametrize("turning", [0.0, 0.6])
@pytest.mark.parametrize("keep", [20, 4])
def test_a_linear_window_is_the_batch_and_loses_nothing_when_it_slides(keep, turning):
    """Straight on, and with a velocity that turns by up to 34 degrees a step."""
    rng = np.random.default_rng(3)
    start, std = rng.standard_normal(7), np.array([1.0, 0.5, 0.8, 0.3, 0.2, 0.4, 0.0])
    start[6] = 0.0
    sightings = [_sighting(rng) for _ in range(CYCLES)]
    turned = rng.uniform(-turning, turning, CYCLES)
    mean, covariance = _filtered(sightings, start, std, keep, turned)
    wanted, spread = _batch(sightings, start, std, turned)
    place = np.array([0, 1, 2, 3, 4, 5, HEAD, HEAD + 1, HEAD + 2])
    # what is held (the compass) is held to 1e-6, which moves the rest by less than that
    np.testing.assert_allclose(mean[place], wanted, atol=1e-6)
    np.testing.assert_allclose(covariance[np.ix_(place, place)], spread, atol=1e-7)


def test_a_belief_about_a_wall_gives_way_to_what_contradicts_it():
    rng = np.random.default_rng(4)
    window = window_gaussian.begin(np.zeros(3), np.zeros(3), np.full(7, 1e-3))
    hold = DirectionPriors(
        np.zeros(1, dtype=np.int64), np.full(1, -1), np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3)), np.zeros((1, 3)),
        np.full(1, 0.05), np.array([np.log(9.0) + np.log(5.0)]), np.full(1, 0.5),
    )  # fmt: skip
    for truth, right in ((0.02, True), (0.6, False)):
        held = window_features.add_feature(window, np.array([5.0, 0.0, truth]) + 0.1 * rng.standard_normal(3), hold)
        hessian, gradient, middle = (field.copy() for field in held.slots)
        hessian[0, POSE:, POSE:] = np.eye(3) / 0.03**2
        middle[0, POSE:] = [5.0, 0.0, truth]
        held = held._replace(slots=Quadratic(hessian, gradient, middle))
        for _ in range(4):
            held = window_gaussian.weigh_holds(window_gaussian.solve(held))
        assert (held.holds.probability[0] > 0.9) == right
        # where it does not hold, the measurement alone counts
        if not right:
            assert abs(held.features[0, 2] - truth) < 1e-3


def test_levels_of_acceleration_are_those_of_all_sequences_weighed():
    rng = np.random.default_rng(5)
    log_like = rng.standard_normal((4, len(motion.ladder())))
    before = rng.dirichlet(np.ones(len(motion.ladder())))
    move = motion.transition(0.9)
    total = np.zeros(log_like.shape)
    for path in np.ndindex(*(4 * (len(motion.ladder()),))):
        weight = sum(before * move[:, path[0]]) * np.exp(log_like[0, path[0]])
        for step in range(1, 4):
            weight *= move[path[step - 1], path[step]] * np.exp(log_like[step, path[step]])
        for step in range(4):
            total[step, path[step]] += weight
    (posterior,), (forward,) = motion.smooth(before[None], log_like[None], 0.9)
    np.testing.assert_allclose(posterior, total / total.sum(axis=1, keepdims=True), rtol=1e-10)
    np.testing.assert_allclose(forward, posterior[-1], rtol=1e-10)
    # one step at a time, the last step's are the same
    message = before[None]
    for like in log_like:
        message = motion.forward(message, like[None], 0.9)
    np.testing.assert_allclose(message[0], forward, rtol=1e-10)


def test_the_likelihood_of_a_level_is_that_of_the_measured_acceleration():
    rng = np.random.default_rng(6)
    root = rng.standard_normal((2, 2))
    noise, seen, precision = root @ root.T + 0.01 * np.eye(2), rng.standard_normal(2), 3.0
    posterior = np.linalg.inv(np.linalg.inv(noise) + precision * np.eye(2))
    mean = posterior @ np.linalg.solve(noise, seen)
    found = motion.log_likelihood(mean[None], posterior[None], np.array([precision]))[0]
    wanted = []
    for level in motion.ladder():
        spread = noise + level**2 * np.eye(2)
        wanted.append(-0.5 * seen @ np.linalg.solve(spread, seen) - 0.5 * np.linalg.slogdet(spread)[1])
    np.testing.assert_allclose(found - found[0], np.array(wanted) - wanted[0], atol=1e-8)


@pytest.mark.parametrize("keep", [20, 4])
def test_a_heading_that_turns_is_filtered_as_a_batch_does(keep):
    rng, rate = np.random.default_rng(11), 0.3
    seen, weight = 0.1 * rng.standard_normal(CYCLES), rng.uniform(10.0, 1e3, CYCLES)
    std = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.2])
    window = window_gaussian.begin(np.zeros(3), np.zeros(3), std, turns=True)
    for cycle in range(CYCLES):
        if cycle:
            while window.num_poses >= keep:
                window = window_gaussian.slide(window)
            window = window_gaussian.extend(window, DT, np.full(4, rate**-2.0))
        hessian, gradient, middle = (field.copy() for field in window.slots)
        hessian[-1, 3, 3] = weight[cycle]
        gradient[-1, 3], middle[-1] = (
            weight[cycle] * (window_gaussian.poses(window)[-1, 3] - seen[cycle]),
            window_gaussian.poses(window)[-1],
        )
        window = window_gaussian.solve(window._replace(slots=Quadratic(hessian, gradient, middle)))
    # the batch: the first heading and every rate
    rows = np.concatenate([np.ones((CYCLES, 1)), DT * np.tri(CYCLES, CYCLES - 1, -1)], axis=1)
    prior = np.concatenate([[0.2**-2.0], np.full(CYCLES - 1, rate**-2.0)])
    covariance = np.linalg.inv(rows.T @ (weight[:, None] * rows) + np.diag(prior))
    wanted = rows @ covariance @ rows.T @ (weight * seen)
    mean, spread = window_gaussian.now(window)
    np.testing.assert_allclose(mean[6], wanted[-1], atol=1e-9)
    np.testing.assert_allclose(spread[6, 6], rows[-1] @ covariance @ rows[-1], rtol=1e-9)


def _seen(turns):
    """A window of five poses and a feature, all seen and solved, and a sixth pose that is open as yet."""
    rng = np.random.default_rng(7)
    std = np.array([0.1, 0.1, 0.1, 0.2, 0.2, 0.2, 0.1 * turns])
    window = window_gaussian.begin(np.zeros(3), rng.standard_normal(3), std, turns=turns)
    window = window_features.add_feature(window, np.ones(3), no_holds(), ridge=1.0)
    for cycle in range(6):
        if cycle:
            window = window_gaussian.extend(window, DT, rng.uniform(1.0, 100.0, 3 + turns))
        if cycle < 5:
            window = window_gaussian.solve(_look(window, rng.standard_normal((3, POSE + 3)), rng.standard_normal(3)))
    return window


def _look(window, rows, value):
    """With rows (N, 7) of the last pose and the feature that were measured as (N,), within one deviation."""
    hessian, gradient, middle = (field.copy() for field in window.slots)
    hessian[-1], gradient[-1] = rows.T @ rows, -rows.T @ value
    middle[-1] = 0.0
    return window._replace(slots=Quadratic(hessian, gradient, middle))


@pytest.mark.parametrize("turns", [False, True])
def test_residuals_of_the_present_are_a_look_at_its_pose_and_features(turns):
    window, rng = _seen(turns), np.random.default_rng(8)
    rows, value = rng.standard_normal((3, POSE + 3)), rng.standard_normal(3)
    jacobian = np.zeros((1, 3, HEAD + 3))
    jacobian[..., [0, 1, 2, 6, 7, 8, 9]] = rows
    spot = np.concatenate([window_gaussian.poses(window)[-1], window.features[0]])
    still = np.zeros((1, 3, 3)), np.zeros(3), np.ones(3)  # nothing tells of the attitude
    found = window_gaussian.with_present(window, (value - rows @ spot)[None], jacobian, *still)
    wanted = window_gaussian.solve(_look(window, rows, value))
    for spread in (False, True):  # without the covariance a solution is the same: condition of the matrix, 1e4
        solved = window_gaussian.solve(found, spread=spread)
        np.testing.assert_allclose(solved.head, wanted.head, atol=1e-10)
        np.testing.assert_allclose(solved.accel, wanted.accel, atol=1e-9)


@pytest.mark.parametrize("turns", [False, True])
def test_the_present_under_livelier_steps_is_that_of_a_solution_of_the_whole(turns):
    window = _seen(turns)
    precision = window.precision.copy()
    precision[-2:, [0, 1]] = 0.01
    mean, covariance = window_gaussian.now_under(window, precision)
    wanted = window_gaussian.now(window_gaussian.solve(window._replace(precision=precision)))
    np.testing.assert_allclose(mean, wanted[0], atol=1e-9)
    np.testing.assert_allclose(covariance, wanted[1], atol=1e-9 * np.abs(wanted[1]).max())
    assert np.abs(mean - window_gaussian.now(window)[0]).max() > 1e-3  # and not what it was
