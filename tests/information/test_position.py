"""Position information and priors: by hand, and as outcomes."""

import numpy as np
import pytest

from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.information import (
    Outcome,
    amplitude_std,
    measurement_std,
    position_bound,
    position_information,
    prior_from_covariance,
    range_information,
)
from rislam_rt.model import RadioConfig

RADIO = RadioConfig()


def test_one_path_by_hand():
    """|g| = 2, 20 dB over all antennas, 1 GHz: c / (2 pi B sqrt(2 / 12 SNR)) / 2 = 5.85 mm."""
    snr = np.array([100.0])
    information = position_information(np.array([[2.0, 0.0]]), snr, RADIO)
    by_hand = SPEED_OF_LIGHT / (2 * np.pi * 1e9 * np.sqrt(2 / 12 * 100.0)) / 2.0
    assert 1 / np.sqrt(information[0, 0]) == pytest.approx(by_hand, rel=1e-12)
    assert by_hand == pytest.approx(5.843e-3, rel=1e-3)
    assert measurement_std(snr, RADIO).tau[0] * SPEED_OF_LIGHT / 2 == pytest.approx(by_hand, rel=1e-12)


def test_outcomes_are_values():
    gradient = np.array([[[1.0, 0.5], [2.0, 1.0]], [[1.0, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, 1.0]]])
    snr = np.array([[10.0, 20.0], [10.0, 20.0], [0.0, 0.0]])
    bound = position_bound(position_information(gradient, snr, RADIO))
    assert bound.outcome.tolist() == [Outcome.UNOBSERVABLE, Outcome.OK, Outcome.NO_PATHS]
    assert np.isinf(bound.variance[[0, 2]]).all()
    assert not np.isnan(bound.rms).any()
    helped = position_bound(position_information(gradient, snr, RADIO), 4.0 * np.eye(2))
    assert (helped.outcome == Outcome.OK).all()
    assert helped.variance[2] == pytest.approx(0.5)


def test_no_paths_at_all():
    assert position_bound(position_information(np.zeros((0, 2)), np.zeros(0), RADIO)).outcome == Outcome.NO_PATHS


def test_adding_a_path_never_hurts_and_rotation_does_not_matter():
    rng = np.random.default_rng(0)
    gradient, snr = rng.normal(size=(200, 4, 2)), rng.exponential(size=(200, 4))
    all_four = position_bound(position_information(gradient, snr, RADIO)).variance
    three = position_bound(position_information(gradient[:, :3], snr[:, :3], RADIO)).variance
    assert (all_four <= three * (1 + 1e-12)).all()
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    turned = position_bound(position_information(gradient @ turn.T, snr, RADIO)).variance
    np.testing.assert_allclose(turned, all_four, rtol=1e-9)


def test_priors_of_many_covariances_are_those_of_each():
    root = np.random.default_rng(5).normal(size=(4, 2, 2))
    covariance = 0.01 * root @ root.swapaxes(1, 2) + 1e-4 * np.eye(2)
    np.testing.assert_allclose(prior_from_covariance(covariance), np.linalg.inv(covariance), rtol=1e-9)
    skew = covariance + np.array([[0.0, 1e-3], [-1e-3, 0.0]])  # what is not symmetric in it plays no part
    np.testing.assert_allclose(prior_from_covariance(skew), np.linalg.inv(covariance), rtol=1e-9)


def test_a_collapsed_belief_is_still_finite():
    prior = prior_from_covariance(np.zeros((2, 2)))
    np.testing.assert_allclose(prior, 1e8 * np.eye(2), rtol=1e-12, atol=1e-6)
    assert np.isfinite(prior_from_covariance(np.array([[1.0, 1.0], [1.0, 1.0]]))).all()


def test_least_standard_deviations():
    std = measurement_std(np.array([0.0, 100.0]), RADIO)
    assert np.isinf(std.tau[0])
    assert np.isinf(std.cosines[0]).all()
    assert std.tau[1] == pytest.approx(1 / np.sqrt(8 * np.pi**2 * 1e18 / 12 * 100.0), rel=1e-12)
    # 4 x 4, half a wavelength: sum x^2 = 4 * (2 * 0.25^2 + 2 * 0.75^2) lambda^2 = 5 lambda^2, 6.25 a antenna
    assert std.cosines[1] == pytest.approx(np.full(2, 1 / np.sqrt(2 * (2 * np.pi) ** 2 * 6.25 * 5)), rel=1e-12)
    assert amplitude_std(RADIO) == pytest.approx(np.sqrt(3.52e-11 / 32))
    snr = np.array(100.0)
    gain = np.sqrt(snr * RADIO.noise_psd / 16)
    assert gain / amplitude_std(RADIO) == pytest.approx(np.sqrt(2 * snr))
    assert range_information(snr, RADIO) == pytest.approx(1 / (SPEED_OF_LIGHT * std.tau[1]) ** 2)
