"""Heave: a body that bobs above the floor, which is no floor that rises and no path's error."""

import numpy as np
import pytest
import scipy

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.smoother import heave, motion
from rislam_rt.slam.window.smoother.attitude import Attitude
from rislam_rt.slam.window.smoother.cholesky import log_evidence, log_evidences
from rislam_rt.slam.window.smoother.motion_basis import HEAD, pose_matrix
from rislam_rt.slam.window.solver_limits import BEGUN, HEAVES, STILL

COUNT, DT, ERROR = 30, 0.1, 1e-3
TIME = DT * np.arange(COUNT + 1)
RISES = pose_matrix(np.full(COUNT, DT).tobytes(), np.zeros(COUNT).tobytes(), False)[1:, 2, HEAD + 2 :: 3]


def told(height):
    """What heights (K + 1,) measured to within `ERROR` tell of the accelerations, the first pose's included."""
    rows = np.concatenate([np.zeros((1, COUNT)), RISES])
    return rows.T @ rows / ERROR**2, rows.T @ height / ERROR**2


@pytest.mark.parametrize("std", HEAVES)
def test_the_level_of_the_heave_is_learnt(std):
    rng = np.random.default_rng(1)
    levels = heave.first_levels()
    turn, slopes = 0.01 * rng.standard_normal(2), rng.standard_normal((COUNT, 9, 3)) / [1.0, 1.0, ERROR]
    for each in slopes:
        seen = each @ np.append(turn, std * rng.standard_normal()) + rng.standard_normal(9)
        levels = heave.next_levels(levels, Attitude((each.T @ each)[None], (each.T @ seen)[None]), np.full(2, 1e-4))
    assert int(np.argmax(levels)) == HEAVES.tolist().index(std)
    assert (heave.variance(levels) == 0.0) == (std == 0.0)


def test_a_cycle_weighs_its_levels_by_their_marginal_likelihood():
    """Against the dense density of what is seen, where no cycle tells more than a rare event would."""
    rng = np.random.default_rng(2)
    slopes, rotation, before = 50.0 * rng.standard_normal((6, 3)), np.array([1e-4, 4e-4]), heave.first_levels()
    seen = rng.standard_normal(6)
    found = heave.next_levels(before, Attitude((slopes.T @ slopes)[None], (slopes.T @ seen)[None]), rotation)
    prior = (1.0 - CONSTANTS.rare) * before + CONSTANTS.rare * before
    like = [
        scipy.stats.multivariate_normal.logpdf(
            seen, cov=np.eye(6) + slopes @ np.diag(np.append(rotation, std**2)) @ slopes.T
        )
        for std in HEAVES
    ]  # fmt: skip
    assert max(like) - min(like) < CONSTANTS.max_log_ratio
    wanted = prior * np.exp(like - np.max(like))
    np.testing.assert_allclose(found, wanted / wanted.sum(), rtol=1e-9)


def test_what_is_told_of_one_nuisance_leaves_out_the_others():
    rng = np.random.default_rng(3)
    rows = rng.standard_normal((8, 3))
    both = Attitude((rows.T @ rows)[None], (rows.T @ rng.standard_normal(8))[None])
    prior = np.array([0.3, 0.5, 0.7])
    whole = np.linalg.inv(both.information[0] + np.diag(1.0 / prior))
    mean = whole @ both.slope[0]
    for part, at, own in (
        (heave.alone(both, prior[:2]), [2], prior[2:]),
        (heave.without(both, float(prior[2])), [0, 1], prior[:2]),
    ):
        covariance = np.linalg.inv(part.information[0] + np.diag(1.0 / own))
        np.testing.assert_allclose(covariance, whole[np.ix_(at, at)], atol=1e-12)
        np.testing.assert_allclose(covariance @ part.slope[0], mean[at], atol=1e-12)
    np.testing.assert_array_equal(heave.without(both, 0.0).information, both.information[:, :2, :2])


def test_a_window_weighs_levels_by_the_density_of_its_heights():
    """Against the dense density of the heights themselves under each floor and each heave."""
    rng = np.random.default_rng(4)
    height = np.append(0.0, 2e-3 * rng.standard_normal(COUNT))
    wanted = np.full(len(HEAVES), -np.inf)
    spans = [COUNT, *BEGUN]
    floors = [(0.0, COUNT, CONSTANTS.upright)]
    for std, share in zip(motion.ladder(), motion.first_motion_mode(0.0), strict=True):
        floors += [(std, span, (1.0 - CONSTANTS.upright) * share / len(spans)) for span in spans]
    for row, std in enumerate(HEAVES):
        for rough, span, share in floors:
            for since in spans if std else spans[:1]:
                accel = np.full(COUNT, STILL**2)
                accel[-span:] += rough**2
                bob = np.diag(np.arange(COUNT) >= COUNT - since) + float(since == COUNT)
                covariance = RISES @ np.diag(accel) @ RISES.T + std**2 * bob + ERROR**2 * np.eye(COUNT)
                like = scipy.stats.multivariate_normal.logpdf(height[1:], cov=covariance)
                wanted[row] = np.logaddexp(wanted[row], np.log(share / (len(spans) if std else 1)) + like)
    wanted = heave.first_levels() * np.exp(wanted - wanted.max())
    # the prior of the accelerations is inverted: condition of the matrix, 1e8
    np.testing.assert_allclose(heave.window_levels(*told(height), RISES), wanted / wanted.sum(), atol=1e-5)


@pytest.mark.parametrize(
    ("height", "bobs"),
    [
        (0.01 * np.sin(2.0 * np.pi * 1.8 * TIME), True),
        (0.004 * np.sin(2.0 * np.pi * 1.6 * TIME + 1.0), True),
        (0.01 * np.sin(2.0 * np.pi * 1.8 * TIME) * (TIME > 2.2), True),
        (0.5 * 0.1 * np.maximum(TIME - 1.5, 0.0) ** 2, False),
        (0.1 * (1.0 - np.cos(np.pi * TIME / 3.0)), False),
        (0.0 * TIME, False),
    ],
    ids=["a walker", "a calm one", "one who sets off", "a climb that begins", "a climb and a fall", "wheels"],
)
def test_a_bob_is_told_from_a_climb(height, bobs):
    rng = np.random.default_rng(5)
    found = heave.window_levels(*told(height - height[0] + ERROR * rng.standard_normal(COUNT + 1)), RISES)
    assert (heave.variance(found) > 0.0) == bobs


@pytest.mark.parametrize("dt", [1.0, 0.01, 1e-3])
def test_a_window_is_weighed_whatever_its_cycles_last_and_rounding_makes_of_it(dt):
    """What is told is a difference of large numbers, and may lack a little of being positive."""
    rises = pose_matrix(np.full(COUNT, dt).tobytes(), np.zeros(COUNT).tobytes(), False)[1:, 2, HEAD + 2 :: 3]
    information = rises.T @ rises / ERROR**2 - 1e-3 * np.eye(COUNT)
    found = heave.window_levels(information, np.zeros(COUNT), rises)
    assert np.isfinite(found).all()
    assert heave.variance(found) == 0.0


@pytest.mark.parametrize(("up", "bobs"), [(0.0, False), (0.03, True), (-0.1, True), (0.6, False)])
def test_a_told_rise_is_a_bob_or_a_climb(up, bobs):
    """What was told is the floor's, exactly, or the body's own: then hardly any of it is the floor's."""
    floor, std, levels = heave.at_start(up, 0.0)
    assert (heave.variance(levels) > 0.0) == bobs
    if bobs:
        assert levels[0] == pytest.approx(floor / up)
        assert 0.0 < floor / up < 0.3
        assert abs(floor) < std < 0.5 * abs(up)
    else:
        assert (floor, std) == (up, 0.0)
    assert levels.sum() == pytest.approx(1.0)


def test_evidence_of_a_joint_prior_is_that_of_single_ones():
    rng = np.random.default_rng(6)
    rows = rng.standard_normal((12, 5))
    information, slope, std = rows.T @ rows, rng.standard_normal(5), rng.uniform(0.1, 2.0, 5)
    found = log_evidences(information, slope, np.diag(std**2)[None])[0]
    assert found == pytest.approx(log_evidence(information, slope, std), abs=1e-10)
    prior = np.cov(rng.standard_normal((5, 40)))
    mixed = np.eye(5) + prior @ information
    wanted = 0.5 * slope @ np.linalg.solve(mixed, prior @ slope) - 0.5 * np.linalg.slogdet(mixed)[1]
    assert log_evidences(information, slope, prior[None])[0] == pytest.approx(wanted, abs=1e-10)
