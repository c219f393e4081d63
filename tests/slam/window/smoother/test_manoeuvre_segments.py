"""Manoeuvres that the last steps tell of together: the marginal likelihood of a segment's accelerations."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.smoother.manoeuvre_segments import _log_ratios, manoeuvring_share
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic

DT, STEPS = 0.1, 24
CALM = np.full(STEPS, 0.005**-2.0)
BEFORE = motion.first_motion_mode(0.005)


def window_of(place, std):
    """Window of poses whose horizontal places (K, 2) [m] were measured with deviations (K,) [m], solved as calm."""
    begin = window_gaussian.begin(np.zeros(3), np.zeros(3), np.array([1e-5] * 3 + [0.01, 0.01, 1e-3, 0.0]))
    window = begin
    for _ in range(len(place) - 1):
        window = window_gaussian.extend(window, DT, np.full(3, CALM[0]))
    hessian, gradient, middle = (np.array(field) for field in window.slots)
    for axis in range(2):
        hessian[:, axis, axis], gradient[:, axis] = std**-2.0, -place[:, axis] * std**-2.0
    return window_gaussian.solve(window._replace(slots=Quadratic(hessian, gradient, middle)))


def set_off(steps, accel=1.0):
    """Way (K, 2) [m] of an agent that is accelerated along x over its last `steps`."""
    time = DT * np.maximum(np.arange(STEPS + 1) - (STEPS - steps), 0)
    return np.stack([0.5 * accel * time**2, np.zeros(STEPS + 1)], axis=1)


@pytest.mark.parametrize("steps", [slice(19, 24), slice(14, 19)])
def test_the_ratio_is_that_of_the_measurements_densities(steps):
    """The window's Gaussian says what the joint density of all measured places does under either prior."""
    rng, std = np.random.default_rng(0), np.full(STEPS + 1, 2e-3)
    place = set_off(5) + 2e-3 * rng.standard_normal((STEPS + 1, 2))
    design, lively = window_gaussian.pose_design(window_of(place, std)), CALM.copy()
    lively[steps] = CONSTANTS.liveliest**-2.0
    found = []
    for prior in (lively, CALM):
        head = np.array([1e-10, 1e-10, 1e-10, 1e-4, 1e-4, 1e-6, 0.0])
        spread = np.diag(np.concatenate([head, np.repeat(1.0 / prior, 3)]))
        found.append(sum(
            multivariate_normal.logpdf(place[:, axis], cov=rows @ spread @ rows.T + np.diag(std**2))
            for axis, rows in enumerate(design.transpose(1, 0, 2)[:2])
        ))  # fmt: skip
    # the start is held to 1e-5 m, and infinitely well where the density takes it from the prior
    (ratio,) = _log_ratios(window_of(place, std), CALM, [steps])
    assert ratio == pytest.approx(found[0] - found[1], rel=1e-4, abs=1e-3)


def test_steps_tell_together_what_none_tells_alone():
    """Of five steps only the last place is measured: five lively ones explain each other."""
    place, std = set_off(5), np.full(STEPS + 1, 1e-3)
    std[-5:-1] = 1e3
    window = window_of(place, std)
    window = window_gaussian.solve(window._replace(precision=np.where(
        np.arange(STEPS)[:, None] >= STEPS - 5, CONSTANTS.liveliest**-2.0, window.precision
    )))  # fmt: skip
    size = len(window.head)
    block = window.covariance[size:, size:].reshape(STEPS, 3, STEPS, 3)[np.arange(STEPS), :2, np.arange(STEPS), :2]
    alone = motion.log_likelihood(window.accel[:, :2], block, window.solved[:, 0])
    assert (alone[-5:, -1] - alone[-5:, 0]).max() < -CONSTANTS.log_rare  # none is worth a change of the mode
    share = manoeuvring_share(window, CALM, BEFORE, 0.0)
    assert share[-3:].min() > 0.99
    assert share[:-10].max() < 0.01


def test_a_calm_way_has_none():
    rng = np.random.default_rng(1)
    shares = [
        manoeuvring_share(
            window_of(2e-3 * rng.standard_normal((STEPS + 1, 2)), np.full(STEPS + 1, 2e-3)), CALM, BEFORE, 0.0
        )
        for place in 2e-3 * rng.standard_normal((20, STEPS + 1, 2))
    ]
    assert np.max(shares) < 0.02


def test_nothing_heard_changes_nothing():
    """What single steps hold beforehand stands."""
    window = window_of(np.zeros((STEPS + 1, 2)), np.full(STEPS + 1, 1e4))
    np.testing.assert_allclose(manoeuvring_share(window, CALM, BEFORE, 0.0), 0.0, atol=1e-6)


def test_what_association_tells_counts_for_segments_that_last():
    window = window_of(np.zeros((STEPS + 1, 2)), np.full(STEPS + 1, 1e4))
    share = manoeuvring_share(window, CALM, BEFORE, 20.0)
    assert share[-1] > 0.99
    assert share[0] == 0.0
