"""Whether the agent goes where it faces is learnt, and a curve that nothing measures is carried on."""

import numpy as np
import pytest

from rislam_rt.model import Body, Measurement, RadioConfig, SensorModel
from rislam_rt.slam import SlamConfig, StartPrior, estimate, init, step
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.window import filter, tracks
from rislam_rt.slam.window.motion import coordinated_turn, motion_learning
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic

DT, SPEED, SEEN = 0.1, 0.5, 1e-3
"""Time of a cycle [s], speed of the agent [m/s], deviation of a measured position [m]."""
BODY = Body(np.array([0.1, 0.0, 0.0]), np.zeros(3))
SENSOR = SensorModel(RadioConfig())
CONFIG = SlamConfig(height="known")


def walk(turn, facing):
    """Positions (K, 3) and headings (K,) of an agent at constant speed whose velocity turns by `turn` (K - 1,) [rad] a
    step, and which faces `facing` (K,) [rad] to the left of that."""
    way = np.concatenate([[0.0], np.cumsum(turn)])
    velocity = SPEED * np.exp(1j * way)
    place = np.concatenate([[0.0], np.cumsum(0.5 * DT * (velocity[1:] + velocity[:-1]))])
    return np.stack([place.real, place.imag, np.zeros(len(place))], axis=1), way + facing


def followed(place, heading, config=CONFIG):
    """State of the window filter after each of K cycles in which the position was measured as (K, 3)."""
    start = StartPrior(place[0], np.array([SPEED, 0.0, 0.0]), float(heading[0]))
    state, found = filter.init(start, BODY, None, SENSOR, config, rng=np.random.default_rng(0)), []
    for cycle, (seen, angle) in enumerate(zip(place, heading, strict=True)):
        state = filter._move(state, DT if cycle else 0.0, float(angle))
        hessian, gradient, middle = (field.copy() for field in state.window.slots)
        hessian[-1, :3, :3], middle[-1, :3] = SEEN**-2.0 * np.eye(3), seen
        window = window_gaussian.solve(state.window._replace(slots=Quadratic(hessian, gradient, middle)))
        state = coordinated_turn.learn_coordinated_turn(motion_learning.learn_motion(state._replace(window=window)))
        state = state._replace(cycle=state.cycle + 1)
        found.append(state)
    return found


def lively(state):
    """How lively [m/s^2] the last steps are held to be."""
    return float(np.exp(-0.5 * np.log(state.window.precision[-10:, 0]).mean()))


def test_a_curve_along_which_the_agent_faces_is_calm():
    curve = np.full(60, 0.05)  # 0.5 rad/s at 0.5 m/s: 0.25 m/s^2 to the side
    along = followed(*walk(curve, np.zeros(61)))
    assert all(state.is_coordinated for state in along)
    aside = followed(walk(curve, np.zeros(61))[0], np.zeros(61))  # the body does not turn: nothing to follow
    assert lively(along[-1]) < 0.02
    assert lively(aside[-1]) > 0.1


def test_who_looks_about_keeps_the_velocity():
    """A straight walk, the body turning to and fro by a radian; then curves along which it faces."""
    look = np.concatenate([np.zeros(5), np.sin(np.arange(60) * 2.0 * np.pi / 40.0), np.zeros(61)])
    curve = np.concatenate([np.zeros(65), np.full(60, 0.05)])
    states = followed(*walk(curve, look))
    assert states[5].is_coordinated
    assert not any(state.is_coordinated for state in states[15:65])
    assert all(state.is_coordinated for state in states[105:])  # a window after the last look
    assert lively(states[64]) < 0.02
    assert lively(states[-1]) < 0.02


def test_other_turns_of_the_velocity_are_the_same_motion():
    rng = np.random.default_rng(2)
    turn = rng.uniform(-0.3, 0.3, 30)
    window = followed(*walk(turn, np.zeros(31)))[-1].window
    assert window.velocity_turn.any()
    other = coordinated_turn.with_velocity_turn(window, np.zeros(30))
    np.testing.assert_allclose(window_gaussian.poses(other), window_gaussian.poses(window), atol=1e-12)
    last = window_gaussian.mean_now(window)
    np.testing.assert_allclose(window_gaussian.mean_now(other), last, atol=1e-12)
    back = coordinated_turn.with_velocity_turn(other, window.velocity_turn)
    np.testing.assert_allclose(back.accel, window.accel, atol=1e-12)


def test_the_likelihood_of_shifted_accelerations_is_that_of_the_gaussians():
    """By completing the square in room axes, with the prior's mean at the shift, instead of in principal axes."""
    rng, count = np.random.default_rng(3), 5
    root = rng.standard_normal((count, 2, 2))
    told, pull, precision = root @ np.swapaxes(root, 1, 2), rng.standard_normal((count, 2)), rng.uniform(1, 9, count)
    spread = np.linalg.inv(told + precision[:, None, None] * np.eye(2))
    accel, shift = (spread @ pull[..., None])[..., 0], rng.standard_normal((3, count, 2))
    found = motion.log_likelihood(accel, spread, precision, shift)
    for (case, row), by in zip(np.ndindex(3, count), shift.reshape(-1, 2), strict=True):
        for column, std in enumerate(motion.ladder()):
            slope = pull[row] - by / std**2
            form = slope @ np.linalg.solve(told[row] + np.eye(2) / std**2, slope) - by @ by / std**2
            wanted = 0.5 * (form - np.linalg.slogdet(np.eye(2) + std**2 * told[row])[1])
            assert found[case, row, column] == pytest.approx(wanted, rel=1e-6, abs=1e-6)
    np.testing.assert_allclose(motion.log_likelihood(accel, spread, precision, 0.0 * shift)[0],
                               motion.log_likelihood(accel, spread, precision), atol=1e-9)  # fmt: skip


def test_the_evidence_of_a_chain_is_the_sum_over_all_its_ways():
    rng, before = np.random.default_rng(4), motion.first_motion_mode(0.1)
    like, move = rng.standard_normal((2, 3, len(before))), motion.transition(0.9)
    ways = np.einsum("a,ab,nb,bc,nc,cd,nd->n", before, move, np.exp(like[:, 0]), move, np.exp(like[:, 1]), move,
                     np.exp(like[:, 2]))  # fmt: skip
    np.testing.assert_allclose(motion.log_evidence(before, like, 0.9), np.log(ways), rtol=1e-12)


@pytest.mark.parametrize(("told", "off"), [("learnt", 0.01), ("told", 1.0)])
def test_a_curve_that_nothing_measures_is_carried_on(told, off):
    """Nothing is heard for 6 s, in which the agent goes round by 172 degrees; a motion that is told stays as told."""
    place, heading = walk(np.full(60, 0.05), np.zeros(61))
    config = SlamConfig(height="known", motion=told)
    rng = np.random.default_rng(5)
    start = StartPrior(place[0], np.array([SPEED, 0.0, 0.0]), 0.0)
    state = init(start, BODY, None, SENSOR, config, rng=rng)
    none = Measurement(*(np.zeros(shape) for shape in (0, (0, 2), 0, 0, (0, 2), 0)))
    for cycle, angle in enumerate(heading):
        state, _ = step(state, none, None, DT if cycle else 0.0, float(angle), config, rng=rng)
    error = float(np.linalg.norm(estimate(state, config).position - place[-1]))
    assert (error < off) == (told == "learnt")


def test_a_track_of_a_wall_goes_on_along_a_curve():
    """The length of a wall's return, by the wall's distance from either end of a step of a coordinated turn: its rate
    is that of the new velocity, but for the third order of the turn."""
    turn, velocity, normal = 0.05, np.array([SPEED, 0.0]), np.exp(0.4j)
    seen = np.array([[10.0, normal.real, normal.imag]])
    heard = Observations(seen, np.full((1, 3), 1e-6), np.ones(1), 0.1 * np.ones(1), np.ones(1))
    found, _ = tracks.start(tracks.no_tracks(), heard, np.array([0]), np.full((1, 3), 1e-6), 0)
    rate = -2.0 * SPEED * normal.real
    mean = found.mean.copy()
    mean[0, 0, 1] = rate
    after = tracks.advance(found._replace(mean=mean), DT, turn, np.zeros(3), velocity)
    ahead = np.exp(1j * turn)
    assert after.mean[0, 0, 1] == pytest.approx(-2.0 * SPEED * (normal * ahead.conjugate()).real, rel=1e-9)
    kept = tracks.advance(found._replace(mean=mean), DT, turn, np.zeros(3), np.zeros(2))
    assert kept.mean[0, 0, 1] == pytest.approx(rate)
