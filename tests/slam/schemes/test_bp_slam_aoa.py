"""BP-SLAM by delays, angles and amplitudes: its parts against closed forms, the whole against a room made by hand."""

from typing import NamedTuple

import numpy as np
import pytest
from rooms import BODY, CYCLE, HEADING, RADIO

from rislam_rt.arrays import Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Measurement, SensorModel
from rislam_rt.slam import StartPrior, StepOutcome
from rislam_rt.slam.observations import free_space
from rislam_rt.slam.schemes import bp_slam_aoa
from rislam_rt.slam.schemes.bp_slam_aoa.feature_association import CandidatePairs, View, claims, likelihoods, spread_of
from rislam_rt.slam.schemes.bp_slam_aoa.feature_birth import ComponentScan, born, hypothesise
from rislam_rt.slam.schemes.bp_slam_aoa.feature_update import absorb
from rislam_rt.slam.schemes.bp_slam_aoa.gaussian_features import (
    POINT,
    WALL,
    Ends,
    GaussianFeatures,
    predict_returns,
    returns_of,
)
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory
from rislam_rt.slam.schemes.shared.gaussian_sums import prune
from rislam_rt.slam.step_info import REMOVED

CONFIG = bp_slam_aoa.BpSlamAoaConfig(sigma_a=0.01)
SENSOR = SensorModel(RADIO, false_alarms=0.2)
TURN = rotation_z(np.asarray(HEADING))
ENDS = Ends(TURN @ BODY.tx_offset, TURN @ BODY.rx_offset, TURN, True)
FREE = free_space(RADIO)
POINTS = np.array([[2.0, 3.0, 2.4], [4.2, 1.0, 1.9], [1.0, 4.4, 2.8]])
NORMALS = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])
OFFSETS = np.array([6.1, 0.3, 5.2, 0.4, 3.3])
STD = np.array([0.004, 0.01, 0.01])


class Walk(NamedTuple):
    """Truth and data of K cycles."""

    position: Floats
    start: StartPrior
    measurements: list[Measurement]


def heard(agent: Floats) -> tuple[Floats, Floats]:
    """Length and cosines (8, 3), and log amplitudes, of three points and five walls, from the images themselves."""
    tx, rx = agent + ENDS.tx, agent + ENDS.rx
    image = tx - 2.0 * (NORMALS @ tx - OFFSETS)[:, None] * NORMALS
    ends = np.concatenate([POINTS, image])
    arrival = ends - rx
    last = np.linalg.norm(arrival, axis=1)
    first = np.concatenate([np.linalg.norm(POINTS - tx, axis=1), np.zeros(5)])
    cosines = (arrival / last[:, None]) @ TURN
    law = np.concatenate([np.log(0.15 / (first * last)[:3]) - 0.5 * np.log(4.0 * np.pi), -0.6 - np.log(last[3:])])
    return np.column_stack([first + last, cosines[:, :2]]), FREE + law


def build_walk(cycles: int, seed: int) -> Walk:
    """A level walk with white acceleration as told; each return is reported nine times in ten."""
    rng = np.random.default_rng([seed, 4])
    level = np.array([1.0, 1.0, 0.0])
    place, speed = np.array([2.5, 2.0, 0.8]), np.array([0.1, 0.05, 0.0])
    start = StartPrior(
        place + 0.01 * rng.standard_normal(3) * level, speed + 0.03 * rng.standard_normal(3) * level, HEADING,
        velocity_std=0.03,
    )  # fmt: skip
    positions, measurements = [], []
    for cycle in range(cycles):
        if cycle:
            push = 0.01 * rng.standard_normal(3) * level
            place, speed = place + CYCLE * speed + 0.5 * CYCLE**2 * push, speed + CYCLE * push
        positions.append(place)
        measurements.append(report(*heard(place), rng))
    return Walk(np.array(positions), start, measurements)


def report(seen: Floats, loud: Floats, rng: np.random.Generator) -> Measurement:
    shown = rng.permutation(np.flatnonzero(rng.random(len(seen)) < 0.9))
    noisy = seen[shown] + STD * rng.standard_normal((len(shown), 3))
    amplitude = np.exp(loud[shown] + 0.1 * rng.standard_normal(len(shown)))
    return Measurement(
        noisy[:, 0] / SPEED_OF_LIGHT, noisy[:, 1:], amplitude, np.full(len(shown), STD[0] / SPEED_OF_LIGHT),
        np.tile(STD[1:], (len(shown), 1)), 0.1 * amplitude,
    )  # fmt: skip


def follow(walk: Walk, config: bp_slam_aoa.BpSlamAoaConfig = CONFIG):
    state = bp_slam_aoa.init(walk.start, BODY, None, SENSOR, config, rng=np.random.default_rng(0))
    for cycle, measurement in enumerate(walk.measurements):
        dt = CYCLE if cycle else 0.0
        state, info = bp_slam_aoa.step(state, measurement, None, dt, HEADING, config, rng=np.random.default_rng(0))
    return state, info, bp_slam_aoa.estimate(state, config)


def course_at(place: Floats) -> AgentTrajectory:
    root = 0.05 * np.random.default_rng(2).standard_normal((6, 6))
    return AgentTrajectory(np.concatenate([place, np.zeros(3)]), root @ root.T, np.zeros(6), 3, np.eye(6), 0.0)


def one(kind: int, mean: Floats) -> GaussianFeatures:
    """One feature of one Gaussian that leans on the course."""
    rng = np.random.default_rng(5)
    root = 0.05 * rng.standard_normal((3, 3))
    return GaussianFeatures(
        np.ones(1), np.array([7]), np.array([0]), np.array([kind]), np.ones(1), mean[None],
        0.3 * rng.standard_normal((1, 3, 6)), (root @ root.T)[None], np.zeros(1), np.ones(1), np.zeros(1),
    )  # fmt: skip


def test_returns_are_those_of_the_mirror_images() -> None:
    """Points and walls (as images of the start, the origin) against images of the Tx, to rounding."""
    agent = np.array([1.7, 1.2, 0.6])
    kind = np.array([POINT] * 3 + [WALL] * 5)
    place = np.concatenate([POINTS, 2.0 * OFFSETS[:, None] * NORMALS])
    got, (seen, loud) = returns_of(kind, place, agent, ENDS), heard(agent)
    assert np.allclose(got[:, :3], seen, rtol=0.0, atol=1e-12)
    own = np.array([np.log(0.15)] * 3 + [-0.6] * 5)
    assert np.allclose(FREE + own + got[:, 4], loud, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("kind", [POINT, WALL])
def test_one_gaussian_and_one_certain_component_are_a_kalman_filter(kind: int) -> None:
    """Known association, nothing else possible: the joint posterior of course and feature is Kalman's."""
    course, features = course_at(np.array([0.2, 0.1, 0.0])), one(kind, np.array([1.5, 2.0, 1.8]))
    predicted = predict_returns(features, course, ENDS, FREE)
    noise = np.array([[1e-4, 4e-4, 9e-4]])
    seen = predicted.seen + np.array([[0.02, -0.01, 0.015]])
    scan = ComponentScan(seen, np.sqrt(noise), np.array(predicted.log_amplitude), np.full(1, 0.1), np.full(1, 1e-30))
    pairs = CandidatePairs(np.array([0]), np.array([0]), noise, np.ones(1), np.zeros(1))
    view = View(predicted, np.array([1.0 - 1e-15]), np.zeros((1, 3, 3)), pairs)
    fresh = np.full(1, 1e-30)
    found, _ = claims(features, view, likelihoods(view, spread_of(predicted, course), scan), fresh)
    after, moved = absorb(features, view, course, scan, found, fresh)
    slope = features.slope[0]
    joint = np.block([
        [course.covariance, course.covariance @ slope.T],
        [slope @ course.covariance, slope @ course.covariance @ slope.T + features.covariance[0]],
    ])  # fmt: skip
    h = np.hstack([np.pad(predicted.by_place[0], ((0, 0), (0, 3))), predicted.by_mean[0]])
    bend = predicted.own[0] - predicted.by_mean[0] @ features.covariance[0] @ predicted.by_mean[0].T
    gain = joint @ h.T @ np.linalg.inv(h @ joint @ h.T + bend + np.diag(noise[0]))
    mean, wanted = gain @ (seen - predicted.seen)[0], joint - gain @ h @ joint
    assert np.allclose(moved.mean - course.mean, mean[:6], rtol=1e-5, atol=1e-9)
    assert np.allclose(moved.covariance, wanted[:6, :6], rtol=1e-5, atol=1e-9)
    total = after.covariance[0] + after.slope[0] @ moved.covariance @ after.slope[0].T
    # the feature's own pull holds the bend as noise of the component; of what it learns that is second order
    assert np.allclose(after.mean[0] - features.mean[0], mean[6:], rtol=0.05, atol=1e-3)
    assert np.allclose(total, wanted[6:, 6:], rtol=0.05, atol=1e-4)


def test_the_evidence_of_one_feature_is_the_sum_over_its_associations() -> None:
    """A tree, on which Bethe's evidence is exact: missed, or made one of three components, each else something new."""
    course, features = course_at(np.zeros(3)), one(POINT, np.array([1.5, 2.0, 1.8]))._replace(existence=np.array([0.6]))
    view = View(
        predict_returns(features, course, ENDS, FREE),
        np.array([0.8]),
        np.zeros((1, 3, 3)),
        CandidatePairs(*np.zeros((5, 3), int)),
    )
    view = view._replace(pairs=view.pairs._replace(component=np.arange(3)))
    density, fresh = np.array([3.0, 0.2, 1.0]), np.array([0.5, 0.1, 2.0])
    found, log = claims(features, view, density, fresh)
    wanted = 1.0 - 0.6 * 0.8 + 0.6 * (density / fresh).sum()
    assert log == pytest.approx(np.log(wanted), rel=1e-12)
    assert found.feature[0, -1] == pytest.approx((1.0 - 0.6 * 0.8) / wanted, rel=1e-3)


@pytest.mark.parametrize("row", range(8))
def test_a_new_feature_is_where_its_component_came_from(row: int) -> None:
    """Each hypothesis predicts the component within its deviations, and the true kind is among the likely ones."""
    agent = np.array([0.3, 0.2, 0.0])
    seen, loud = heard(agent + np.array([2.5, 2.0, 0.8]))
    scan = ComponentScan(seen[row : row + 1], STD[None], loud[row : row + 1], np.full(1, 0.1), np.full(1, 1e-9))
    course = course_at(agent)
    found = hypothesise(scan, 0, TURN, FREE, 24.0, CONFIG)
    new = born([found], np.ones(1), course, ENDS, 0, CONFIG)
    predicted = predict_returns(new, course._replace(covariance=np.zeros((6, 6))), ENDS, FREE)
    spread = np.sqrt(np.einsum("cii->ci", predicted.own)) + STD
    likely = new.share > 1e-3
    assert (np.abs(predicted.seen - seen[row]) < 4.0 * spread)[likely].all()
    assert np.bincount(new.kind[likely], new.share[likely], minlength=3)[POINT if row < 3 else WALL] > 1e-3


def test_a_loud_feature_that_is_missed_is_doubted_more_than_a_faint_one() -> None:
    """Detection follows from the amplitude: a path below the threshold may be there unheard."""
    walk = build_walk(12, 1)
    state, *_ = follow(walk)
    faint = state._replace(features=state.features._replace(strength=state.features.strength - 5.0))
    none = report(np.zeros((0, 3)), np.zeros(0), np.random.default_rng(0))
    left = [
        bp_slam_aoa.step(s, none, None, CYCLE, HEADING, CONFIG, rng=np.random.default_rng(0))[0].features.existence
        for s in (state, faint)
    ]  # fmt: skip
    assert (1.0 - left[0]).min() > 5.0 * (1.0 - left[1]).min()


def test_it_knows_what_it_knows_in_rooms_made_by_hand() -> None:
    """Four walks of 4 s: error far below dead reckoning, and as large as is said.

    The start's own 10 mm is in both. The mean of 8 squares is below 2.5 with probability 0.99 (chi^2, 8 dof).
    """
    squares, errors = [], []
    for seed in range(4):
        walk = build_walk(40, seed)
        _, info, belief = follow(walk)
        error, spread = (belief.position - walk.position[-1])[:2], belief.covariance[:2, :2]
        squares.append(error @ np.linalg.solve(spread, error) / 2.0)
        moved = belief.position - walk.position[-1] - (walk.start.position - walk.position[0])
        errors.append(moved[:2])
    assert info.outcome == StepOutcome.OK
    assert np.mean(squares) < 2.5
    reckoned = 0.03 * CYCLE * 39
    assert np.sqrt(np.mean(np.square(errors))) < 0.1 * reckoned
    known = belief.map
    assert len(known.wall_offset) >= 5
    # the five walls are among those shown, each within what a walk of 0.4 m lets it be known
    gap = np.linalg.norm(known.wall_normal[:, None] - NORMALS, axis=2) + np.abs(known.wall_offset[:, None] - OFFSETS)
    assert (gap.min(axis=0) < 0.1).all()


def test_angles_and_amplitudes_are_what_makes_the_difference() -> None:
    """The same components with cosines worth a thirtieth: less is known of the agent by the same delays."""
    walk = build_walk(15, 3)
    blind = [
        Measurement(m.tau, m.cosines, m.amplitude, m.tau_std, np.full((len(m), 2), 0.3), m.amplitude_std)
        for m in walk.measurements
    ]  # fmt: skip
    with_angles, without = (
        follow(each)[0].course.covariance[:2, :2] for each in (walk, walk._replace(measurements=blind))
    )  # fmt: skip
    assert np.trace(with_angles) < 0.5 * np.trace(without)


def test_wall_returns_may_be_set_aside() -> None:
    """By length and by strength: nothing of the walls is left."""
    config = bp_slam_aoa.BpSlamAoaConfig(use_vt=False)
    walk = build_walk(20, 1)
    _, info, belief = follow(walk, config)
    bright = walk.measurements[-1].amplitude > 0.35 * np.exp(FREE) / (SPEED_OF_LIGHT * walk.measurements[-1].tau)
    assert (info.landmark[bright] == REMOVED).all()
    assert len(belief.map.wall_offset) == 0


def test_pruning_keeps_what_is_likely() -> None:
    """The improbable feature goes, and the improbable Gaussian; shares sum to one."""
    rich = one(POINT, np.ones(3))
    parts = {name: np.repeat(getattr(rich, name), 3, axis=0) for name in GaussianFeatures._fields}
    parts |= {"existence": np.array([0.9, 1e-6]), "ident": np.array([4, 5]), "owner": np.array([0, 0, 1])}
    left = prune(GaussianFeatures(**{**parts, "share": np.array([0.999, 1e-4, 1.0])}), 1e-4, 1e-3, 10)
    assert left.ident.tolist() == [4]
    assert left.share.tolist() == [1.0]
