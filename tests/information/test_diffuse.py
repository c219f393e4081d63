"""Diffuse multipath against the whitened information of sampled tones."""

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.information import DiffuseTail, diffuse_snr, range_information
from rislam_rt.model import RadioConfig, RxArray
from rislam_rt.waveform import delay_response, subcarrier_frequencies

RADIO = RadioConfig(array=RxArray(1, 1), noise_psd=1e-9)


@pytest.mark.parametrize("power", [0.0, 1e-7, 1e-5])
def test_effective_noise_equals_whitening_the_tones(power):
    """Gain unknown, noise covariance N0 plus that of the tail: the information on the delay, by linear algebra."""
    tones = 600
    tail = DiffuseTail(power, 20e-9, 50e-9)
    frequency = subcarrier_frequencies(tones, RADIO.bandwidth)
    cells = np.arange(0.0, 500e-9, 0.125e-9)
    response = delay_response(cells, frequency) * np.sqrt(RADIO.energy / tones)
    covariance = RADIO.noise_psd * np.eye(tones) + (response.T * tail.density(cells) * 0.125e-9) @ response.conj()
    gain, tau = 3e-3, 60e-9
    signal = delay_response(np.array(tau), frequency) * np.sqrt(RADIO.energy / tones)
    slope = -2j * np.pi * frequency * signal * gain
    white_slope, white_signal = np.linalg.solve(covariance, slope), np.linalg.solve(covariance, signal)
    lost = np.abs(slope.conj() @ white_signal) ** 2 / np.real(signal.conj() @ white_signal)
    exact = 2.0 * (np.real(slope.conj() @ white_slope) - lost)
    short = range_information(diffuse_snr(np.array(gain), np.array(tau), RADIO, tail), RADIO) * 299792458.0**2
    # the profile falls by 2 % over a resolution cell, and its edge is 40 cells away
    assert short == pytest.approx(exact, rel=0.05)


def test_tail_starts_at_its_onset_and_holds_its_power():
    tail = DiffuseTail(2.0, 10e-9, 5e-9)
    tau = np.arange(0.0, 200e-9, 1e-12)
    assert np.sum(tail.density(tau)) * 1e-12 == pytest.approx(2.0, rel=1e-3)
    assert tail.density(np.array(9e-9)) == 0.0
    with pytest.raises(ConfigError, match="positive time"):
        DiffuseTail(1.0, 0.0, 0.0)
