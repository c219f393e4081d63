"""The flat-band pulse: closed forms against samples, differences and the spectrum."""

import numpy as np
import pytest
from scipy.special import spherical_jn

from rislam_rt.model import RadioConfig
from rislam_rt.waveform import autocorrelation, delay_response, subcarrier_frequencies

BANDWIDTH, ENERGY = 1e9, 2.5


def test_effective_bandwidth_is_the_second_moment_of_the_spectrum():
    frequency = (np.arange(200_001) + 0.5) / 200_001 * BANDWIDTH - BANDWIDTH / 2
    moment = np.mean(frequency**2)  # equal power over the band
    # midpoint rule with 2e5 points: relative error 1 / n^2
    square = RadioConfig(bandwidth=BANDWIDTH).effective_bandwidth_squared
    assert square == pytest.approx(moment, rel=1e-9)
    slope = autocorrelation(0.0, BANDWIDTH, ENERGY, derivative=2)
    assert -slope == pytest.approx(ENERGY * (2 * np.pi) ** 2 * square, rel=1e-14)


def test_sampled_pulse_has_its_energy_and_its_autocorrelation():
    rate = 2.0 * BANDWIDTH
    time = np.arange(-400_000, 400_001) / rate
    for tau in (0.0, 0.3e-9, 1.7e-9):
        product = ENERGY * BANDWIDTH * np.sinc(BANDWIDTH * time) * np.sinc(BANDWIDTH * (time - tau))
        # what lies beyond 400 000 samples of a sinc^2 tail is below 1 / (pi^2 n)
        assert product.sum() / rate == pytest.approx(autocorrelation(tau, BANDWIDTH, ENERGY), abs=ENERGY * 1e-6)


@pytest.mark.parametrize("order", [1, 2])
def test_derivatives_equal_differences(order):
    tau = np.array([-3.1e-9, -1e-10, 0.0, 2e-12, 0.7e-9, 4e-9])
    step = 1e-13
    lower = autocorrelation(tau - step, BANDWIDTH, ENERGY, derivative=order - 1)
    upper = autocorrelation(tau + step, BANDWIDTH, ENERGY, derivative=order - 1)
    scale = ENERGY * (np.pi * BANDWIDTH) ** order
    difference = (upper - lower) / (2 * step)
    # rounding 1e-16 / (pi B step = 3e-4), truncation (3e-4)^2 / 6
    np.testing.assert_allclose(
        autocorrelation(tau, BANDWIDTH, ENERGY, derivative=order), difference, rtol=0, atol=3e-8 * scale
    )


def test_nothing_cancels_near_zero():
    tau = np.array([1e-30, 1e-20, 1e-15, 1e-13])
    x = np.pi * BANDWIDTH * tau
    second = autocorrelation(tau, BANDWIDTH, derivative=2) / (np.pi * BANDWIDTH) ** 2
    np.testing.assert_allclose(second, -1 / 3 + x**2 / 10, rtol=1e-13)
    np.testing.assert_allclose(
        autocorrelation(tau, BANDWIDTH, derivative=1) / (np.pi * BANDWIDTH), -x / 3 + x**3 / 30, rtol=1e-13
    )


def test_closed_form_and_series_meet():
    x = np.concatenate([np.geomspace(1e-6, 50.0, 400), [0.0, 1.0, np.nextafter(1.0, 0.0)]])
    tau, scale = np.concatenate([x, -x]) / (np.pi * BANDWIDTH), np.pi * BANDWIDTH
    j0, j1, j2 = (spherical_jn(n, scale * tau) for n in range(3))
    # closed form next to 1: a difference of terms ten times the result
    np.testing.assert_allclose(autocorrelation(tau, BANDWIDTH, derivative=1) / scale, -j1, rtol=1e-13, atol=1e-15)
    second = autocorrelation(tau, BANDWIDTH, derivative=2) / scale**2
    np.testing.assert_allclose(second, (2 * j2 - j0) / 3, rtol=1e-13, atol=1e-15)


def test_unknown_derivative_is_refused():
    with pytest.raises(ValueError, match="derivative: 3"):
        autocorrelation(0.0, BANDWIDTH, derivative=3)


def test_the_autocorrelation_is_the_inner_product_of_many_delayed_tones():
    """A sum of M tones is the midpoint rule for the band: relative error of order (pi B tau / M)^2."""
    tau = np.linspace(-3e-9, 3e-9, 13)
    tones = delay_response(tau, subcarrier_frequencies(4096, BANDWIDTH))
    flat = autocorrelation(tau, BANDWIDTH, ENERGY)
    np.testing.assert_allclose(ENERGY * tones.mean(axis=-1), flat, rtol=0, atol=1e-5 * ENERGY)
