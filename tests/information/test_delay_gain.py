"""The full Fisher matrix: against a numerical Hessian of the log likelihood, the closed forms, and an estimator."""

from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.information import (
    Outcome,
    cosine_information,
    delay_gain_information,
    eliminate_gains,
    map_to_position,
    measurement_std,
    position_information,
    range_information,
    steering,
)
from rislam_rt.model import RadioConfig, RxArray

RADIO = replace(RadioConfig(), array=RxArray(2, 3), energy=2.0, noise_psd=1e-3)
TAU = np.array([10.0e-9, 10.6e-9, 13.0e-9])
GAIN = np.array([1.0 + 0.3j, -0.4 + 0.9j, 0.2 - 0.1j])
COSINES = np.array([[0.1, 0.3], [-0.5, 0.2], [0.4, -0.6]])
NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)


def delay_information(tau, gain, radio, antennas=None):
    """Equivalent Fisher information on the delays alone."""
    return eliminate_gains(delay_gain_information(tau, gain, radio, antennas=antennas), tau.shape[-1])


def direction(cosines):
    return np.concatenate([cosines, np.sqrt(1 - np.sum(cosines**2, -1, keepdims=True))], axis=-1)


def spectrum(tau, gain, antennas, radio):
    """The received signal (..., L, F) in frequency, scaled so that a sum of squares is its energy.

    Gauss-Legendre nodes integrate products of delayed flat-band pulses to float precision.
    """
    frequency = NODES * radio.bandwidth / 2
    amplitude = np.sqrt(radio.energy * WEIGHTS / 2)
    delayed = amplitude * np.exp(-2j * np.pi * frequency * tau[..., None])
    return np.einsum("...p,...pl,...pf->...lf", gain, antennas, delayed)


@pytest.mark.parametrize("angles", [False, True])
def test_full_matrix_equals_the_hessian_of_the_log_likelihood(angles):
    """Second differences of -log p(y | chi) at the truth, y without noise (its expectation)."""
    unit = [1e-9] * 3 + ([1.0] * 6 if angles else []) + [1.0] * 6
    start = np.concatenate([TAU, COSINES.T.ravel() if angles else [], GAIN.real, GAIN.imag])

    def signal(chi):
        tau, gain = chi[:3], chi[-6:-3] + 1j * chi[-3:]
        cosines = chi[3:9].reshape(2, 3).T if angles else COSINES
        return spectrum(tau, gain, steering(direction(cosines), RADIO), RADIO)

    truth = signal(start)

    def cost(chi):
        return np.sum(np.abs(signal(chi) - truth) ** 2) / RADIO.noise_psd

    step = 3e-4 * np.array(unit)
    size = len(start)
    hessian = np.zeros((size, size))
    for i in range(size):
        for j in range(i + 1):
            a, b = step[i] * np.eye(size)[i], step[j] * np.eye(size)[j]
            corners = cost(start + a + b) - cost(start + a - b) - cost(start - a + b) + cost(start - a - b)
            hessian[i, j] = hessian[j, i] = corners / (4 * step[i] * step[j])
    analytic = delay_gain_information(
        TAU, GAIN, RADIO, antennas=steering(direction(COSINES), RADIO), angles=angles
    )  # fmt: skip
    scale = np.sqrt(np.diag(analytic))
    # fourth derivatives times step^2: (pi 3e-4)^2; rounding 1e-16 / step^2
    np.testing.assert_allclose(analytic / scale[:, None] / scale, hessian / scale[:, None] / scale, atol=3e-6)


def test_one_antenna_vector_serves_all_paths_by_default():
    ones = np.ones((3, RADIO.array.num_antennas))
    np.testing.assert_array_equal(
        delay_gain_information(TAU, GAIN, RADIO), delay_gain_information(TAU, GAIN, RADIO, antennas=ones)
    )


def test_closed_form_is_the_limit_of_separated_delays():
    gradient = np.array([[1.2, 0.3], [-0.4, 1.5], [0.8, -1.1]])
    closed = position_information(gradient, RADIO.integrated_snr(GAIN), RADIO)
    error = []
    for separation in (1e-8, 1e-6, 1e-4, 1e-2):
        # a sinc spectrum's skirts fall as 1 / (B tau): 1 ms for 1e-6
        full = delay_information(np.array([0.0, 1.03, 2.21]) * separation, GAIN, RADIO)
        assert full.outcome == Outcome.OK
        error.append(np.abs(map_to_position(full.information, gradient) / closed - 1).max())
    assert error[-1] < 1e-6
    assert (np.diff(error) < 0).all()


def test_overlap_never_helps_a_delay_and_coinciding_paths_are_degenerate():
    rng = np.random.default_rng(0)
    alone = SPEED_OF_LIGHT**2 * range_information(RADIO.integrated_snr(GAIN[:2]), RADIO)
    worst = []
    for gap in (2.0e-9, 1.0e-9, 0.5e-9, 0.25e-9):
        gain = GAIN[:2] * np.exp(2j * np.pi * rng.random((50, 2)))
        tau = np.broadcast_to([10e-9, 10e-9 + gap], (50, 2))
        full = delay_information(tau, gain, RADIO)
        bound = np.diagonal(np.linalg.inv(full.information), axis1=1, axis2=2)
        assert (bound * alone >= 1 - 1e-9).all()  # sharing the band never helps
        worst.append(float((bound * alone).max()))
    assert worst[-1] > 5.0
    assert (np.diff(worst) > 0).all()
    same = delay_information(np.array([1e-8, 1e-8]), GAIN[:2], RADIO)
    assert same.outcome == Outcome.DEGENERATE
    assert np.isfinite(same.information).all()


def test_two_paths_at_one_delay_are_told_apart_by_angle():
    antennas = steering(direction(COSINES[:2]), RADIO)
    full = delay_information(np.array([1e-8, 1e-8]), GAIN[:2], RADIO, antennas=antennas)
    assert full.outcome == Outcome.OK
    alone = SPEED_OF_LIGHT**2 * range_information(RADIO.integrated_snr(GAIN[:2]), RADIO)
    assert (1 / np.diagonal(np.linalg.inv(full.information)) > 0.3 * alone).all()


def test_single_path_gives_the_closed_forms_for_delay_and_cosines():
    for array in (RxArray(4, 4), RxArray(1, 5), RxArray(2, 6, spacing=0.4)):
        radio = replace(RADIO, array=array)
        antennas = steering(direction(COSINES[:1]), radio)
        full = delay_gain_information(TAU[:1], GAIN[:1], radio, antennas=antennas, angles=True)
        reduced = eliminate_gains(full, 1).information
        snr = radio.integrated_snr(GAIN[:1])
        std = measurement_std(snr, radio)
        np.testing.assert_allclose(reduced[0, 0], 1 / std.tau[0] ** 2, rtol=1e-12)
        expected = cosine_information(snr / array.num_antennas, radio)[0]
        np.testing.assert_allclose(reduced[1:, 1:], np.diag(expected), rtol=1e-12, atol=1e-9 * expected.max())
        np.testing.assert_allclose(reduced[0, 1:], 0.0, atol=1e-9 * np.sqrt(reduced[0, 0] * expected.max()))


def test_line_array_gives_the_textbook_variance():
    radio = replace(RADIO, array=RxArray(8, 1, spacing=0.45))
    snr, phi = 7.0, 0.6  # per antenna; phi from broadside, so cosine = sin(phi)
    textbook = 6 / (snr * 8 * (64 - 1) * (2 * np.pi * 0.45 * np.cos(phi)) ** 2)
    variance = measurement_std(np.array(8 * snr), radio).cosines ** 2 / np.cos(phi) ** 2
    assert variance[0] == pytest.approx(textbook, rel=1e-12)
    assert variance[1] == np.inf


def test_rows_and_columns_batch():
    tau = TAU + np.array([[0.0], [1e-9]])
    batch = delay_information(tau, np.stack([GAIN, 2 * GAIN]), RADIO)
    for k, gain in enumerate((GAIN, 2 * GAIN)):
        single = delay_information(tau[k], gain, RADIO)
        np.testing.assert_allclose(batch.information[k], single.information, rtol=1e-12)


def test_maximum_likelihood_reaches_the_bound():
    """2000 draws of noise; position and gains of three overlapping paths by Gauss-Newton from a wrong start."""
    draws = 2000
    radio = replace(RADIO, array=RxArray(1, 2), noise_psd=1e-4)
    rng = np.random.default_rng(7)
    gradient = np.array([[1.2, 0.3], [-0.4, 1.5], [0.8, -1.1]])
    antennas = steering(direction(COSINES), radio)
    information = map_to_position(delay_information(TAU, GAIN, radio, antennas=antennas).information, gradient)
    bound = np.linalg.inv(information)
    clean = spectrum(TAU, GAIN, antennas, radio)
    frequency = NODES * radio.bandwidth / 2
    noise_shape = (draws, *clean.shape)
    noise = (rng.normal(size=noise_shape) + 1j * rng.normal(size=noise_shape)) * np.sqrt(radio.noise_psd / 2)
    received = clean + noise
    position = np.tile([3e-3, -2e-3], (draws, 1))
    for _ in range(8):
        tau = TAU + position @ gradient.T / SPEED_OF_LIGHT
        base = np.sqrt(radio.energy * WEIGHTS / 2) * np.exp(-2j * np.pi * frequency * tau[..., None])
        modes = np.einsum("pl,kpf->klfp", antennas, base).reshape(draws, -1, 3)
        flat = received.reshape(draws, -1)
        gram = modes.conj().swapaxes(1, 2) @ modes
        gain = np.linalg.solve(gram, modes.conj().swapaxes(1, 2) @ flat[..., None])[..., 0]
        slope = modes * np.tile(-2j * np.pi * frequency, clean.shape[0])[:, None]
        moved = (slope * gain[:, None]) @ gradient / SPEED_OF_LIGHT
        # variable projection: what is left of the slopes and of the residual outside the span of the modes
        moved = moved - modes @ np.linalg.solve(gram, modes.conj().swapaxes(1, 2) @ moved)
        residual = flat - (modes @ gain[..., None])[..., 0]
        normal = np.real(moved.conj().swapaxes(1, 2) @ moved)
        right = np.real(moved.conj().swapaxes(1, 2) @ residual[..., None])
        change = np.linalg.solve(normal, right)[..., 0]
        position = position + change
    assert np.abs(change).max() < 1e-6 * np.sqrt(bound.trace())
    rmse, expected = np.sqrt(np.mean(np.sum(position**2, axis=1))), np.sqrt(bound.trace())
    # 2000 draws of two coordinates: the RMSE itself is known to 1.6 % (one sigma, if one coordinate dominates)
    assert rmse == pytest.approx(expected, rel=0.05)
    assert np.abs(position.mean(axis=0)).max() < 4 * np.sqrt(np.diag(bound).max() / draws)
