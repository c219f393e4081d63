"""The received signal against its defining sum, its energy, and the limits of its approximations."""

import numpy as np
import pytest

from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.measurement import ReceiverConfig, build_sensor
from rislam_rt.measurement.estimation.path_signals import build_sounding, correlate_waves, wave_signals
from rislam_rt.measurement.received_paths import receive
from rislam_rt.measurement.received_signal import (
    add_noise,
    convert,
    num_tones,
    to_samples,
    to_tones,
    tones,
)
from rislam_rt.model import PathKind, Paths, RadioConfig, RxArray

RADIO = RadioConfig()
CONFIG = ReceiverConfig()
UP = (0.3, -0.2, 0.9)


def received(paths, config=CONFIG, radio=RADIO):
    return receive(paths, 0, 0.0, radio, config)


@pytest.mark.parametrize(("bandwidth", "count"), [(20e6, 16), (1e9, 128), (4e9, 512)])
def test_tones_span_the_delay_window(bandwidth, count):
    radio = RadioConfig(bandwidth=bandwidth)
    assert num_tones(radio, CONFIG) == count
    assert count / bandwidth >= CONFIG.max_delay
    assert num_tones(radio, ReceiverConfig(num_subcarriers=100)) == 100


def test_tones_repeat_after_the_period_that_the_sensor_model_tells(make_paths, make_gain):
    period, gain = SPEED_OF_LIGHT * build_sensor(RADIO, CONFIG).period, make_gain(40.0, RADIO)
    near, far = (
        tones(received(make_paths([(PathKind.VT, 7.0 + turn, UP, gain)])), RADIO, CONFIG) for turn in (0.0, period)
    )
    # the carrier's phase is the gain's: what is left is a common sign, as the tones lie about zero
    np.testing.assert_allclose(np.abs(np.vdot(near, far)), np.vdot(near, near).real, rtol=1e-9)
    half = tones(received(make_paths([(PathKind.VT, 7.0 + 0.5 * period, UP, gain)])), RADIO, CONFIG)
    assert np.abs(np.vdot(near, half)) < 1e-6 * np.vdot(near, near).real


def test_tones_are_the_sum_of_their_paths(make_paths, make_gain):
    """Against eq. `all` written out for one antenna and one tone."""
    rows = [(PathKind.PS, 4.0, UP, make_gain(20.0, RADIO, 1.0)), (PathKind.VT, 7.0, (0, 1, 1), make_gain(40.0, RADIO))]
    paths = make_paths(rows)
    signal = tones(received(paths), RADIO, CONFIG)
    element, tone = 6, 37
    position = RADIO.array.positions(RADIO.wavelength)[element]
    frequency = (tone - 63.5) * 1e9 / 128
    expected = sum(
        paths.gain[0, i]
        * np.exp(2j * np.pi / RADIO.wavelength * position @ paths.arrival[0, i])
        * np.exp(-2j * np.pi * frequency * paths.tau[0, i])
        for i in range(2)
    )
    assert signal[element, tone] == pytest.approx(np.sqrt(RADIO.energy / 128) * expected, rel=1e-9)


@pytest.mark.parametrize("bandwidth", [20e6, 1e9, 4e9])
def test_energy_over_all_antennas_is_the_integrated_snr(make_paths, make_gain, bandwidth):
    radio = RadioConfig(bandwidth=bandwidth)
    paths = make_paths([(PathKind.PS, 4.0, UP, make_gain(20.0, radio, 1.0))])
    energy = np.sum(np.abs(tones(received(paths), radio, CONFIG)) ** 2)
    assert energy / radio.noise_psd == pytest.approx(100.0, rel=1e-9)


def test_samples_and_tones_are_one_signal(make_paths, make_gain):
    spectrum = tones(received(make_paths([(PathKind.PS, 4.0, UP, make_gain(20.0, RADIO))])), RADIO, CONFIG)
    samples = to_samples(spectrum, RADIO)
    np.testing.assert_allclose(to_tones(samples, RADIO), spectrum, atol=1e-12 * np.abs(spectrum).max())
    assert np.sum(np.abs(samples) ** 2) / RADIO.bandwidth == pytest.approx(np.sum(np.abs(spectrum) ** 2))


def test_noise_has_the_variance_asked_for_and_no_direction():
    noise = add_noise(np.zeros((100, 100), dtype=np.complex128), 3.0, rng=np.random.default_rng(1))
    # 10 000 draws: five standard errors
    assert np.mean(np.abs(noise) ** 2) == pytest.approx(3.0, rel=0.05)
    assert abs(np.mean(noise**2)) < 0.15


@pytest.mark.parametrize("bits", [6, 10])
def test_converters_add_the_noise_they_say(make_paths, make_gain, bits):
    paths = make_paths([(PathKind.PS, 4.0, UP, make_gain(20.0, RADIO))])
    noisy = add_noise(tones(received(paths), RADIO, CONFIG), RADIO.noise_psd, rng=np.random.default_rng(2))
    digital, variance = convert(noisy, bits, RADIO)
    # rounding errors are even over a step to the extent that noise moves them over many steps
    assert np.mean(np.abs(digital - noisy) ** 2) == pytest.approx(variance, rel=0.1)
    same, nothing = convert(noisy, 0, RADIO)
    assert same is noisy
    assert nothing == 0.0


class TestElementExact:
    """Every element at its own distance from the source, on geometry that is built here."""

    def scene(self, rx, source, radio=RADIO):
        """One path by way of a landmark, and one bare wall return, with all their geometry."""
        tx = rx + np.array([-0.1, 0.02, 0.0])
        legs = [np.linalg.norm(tx - source), np.linalg.norm(rx - source)]
        image = np.array([4.0, 1.0, 3.0])
        walls = np.linalg.norm(rx - image)
        bounce = 0.5 * (tx + rx + image - tx)
        vertices = np.stack([source, bounce])
        rays = np.stack([(source - rx) / legs[1], (image - rx) / walls])
        away = np.stack([(source - tx) / legs[0], (bounce - tx) / np.linalg.norm(bounce - tx)])
        return Paths(
            kind=np.array([PathKind.PS, PathKind.VT]),
            landmark=np.array([0, -1]),
            tx_walls=np.array([[-1], [0]]),
            rx_walls=np.full((2, 1), -1),
            valid=np.ones((1, 2), dtype=bool),
            tau=np.array([[sum(legs), walls]]) / SPEED_OF_LIGHT,
            departure=away[None],
            arrival=rays[None],
            gain=np.array([[1e-5, 2e-5 + 1e-5j]]),
            vertices=vertices[None, :, None],
            num_vertices=np.array([1, 1]),
            walls=("wall",),
            landmarks=("sphere",),
        ), image  # fmt: skip

    def test_phases_are_those_of_the_distances(self):
        rx, source = np.array([1.0, 2.0, 0.5]), np.array([1.4, 2.3, 1.6])
        paths, image = self.scene(rx, source)
        config = ReceiverConfig(element_exact=True)
        signal = tones(received(paths, config), RADIO, config)
        frequency = (np.arange(128) - 63.5) * 1e9 / 128
        expected = np.zeros((16, 128), dtype=np.complex128)
        for row, element in enumerate(RADIO.array.positions(RADIO.wavelength)):
            for gain, tau, centre in zip(paths.gain[0], paths.tau[0], (source, image), strict=True):
                excess = np.linalg.norm(rx + element - centre) - np.linalg.norm(rx - centre)
                delay = tau + excess / SPEED_OF_LIGHT
                phase = np.exp(-2j * np.pi * (frequency * delay + RADIO.carrier * excess / SPEED_OF_LIGHT))
                expected[row] += np.sqrt(1.0 / 128) * gain * phase
        # the transmitter is recovered from the rays to rounding; 1e-6 of a wavelength moves a phase by 6e-6
        np.testing.assert_allclose(signal, expected, atol=1e-5 * np.abs(expected).max())

    def test_far_and_narrow_it_is_the_plane_wave(self):
        radio = RadioConfig(bandwidth=1e5)
        config = ReceiverConfig(element_exact=True)
        paths, _ = self.scene(np.array([0.0, 0.0, 0.0]), np.array([300.0, 200.0, 500.0]))
        exact, plane = (
            tones(received(paths, c, radio)._replace(wave_radius=np.full(2, 1e4)), radio, c) for c in (config, CONFIG)
        )
        # curvature of a 0.03 m aperture at 10 km: 3e-6 rad
        np.testing.assert_allclose(exact, plane, atol=1e-4 * np.abs(plane).max())


def test_arrays_of_one_antenna_work_too(make_paths, make_gain):
    radio = RadioConfig(array=RxArray(rows=1, cols=1))
    paths = make_paths([(PathKind.PS, 4.0, UP, make_gain(20.0, radio))])
    assert tones(received(paths, radio=radio), radio, CONFIG).shape == (1, 128)


def test_estimator_models_elements_as_the_signal_makes_them(make_paths, make_gain):
    """`waves` against the synthesis: a wall return, whose wave front spreads from a whole path away."""
    config = ReceiverConfig(element_exact=True)
    rows = [(PathKind.VT, 1.0, (0.6, 0.3, 0.4), 1.0), (PathKind.VT, 6.0, (-0.2, 0.9, 0.1), 1.0j)]
    paths = make_paths(rows)
    signal = tones(received(paths, config), RADIO, config)
    sounding = build_sounding(128, RADIO, element_exact=True)
    parameters = np.column_stack([paths.tau[0] * RADIO.bandwidth, paths.arrival[0, :, :2]])
    waves = wave_signals(sounding, parameters)
    model = (waves @ paths.gain[0]).reshape(signal.shape) * np.sqrt(1.0 / 128)
    np.testing.assert_allclose(model, signal, atol=1e-9 * np.abs(signal).max())
    # and its derivatives, by central differences; the model's neglect how the wave front bends with the path
    samples = np.exp(1j * np.arange(16 * 128)).reshape(16, 128)
    _, slopes = correlate_waves(sounding, waves, samples)
    for axis, step in enumerate(1e-6 * np.eye(3)):
        change = (wave_signals(sounding, parameters + step) - wave_signals(sounding, parameters - step)) / 2e-6
        expected = change.conj().T @ samples.ravel()
        np.testing.assert_allclose(slopes[axis], expected, atol=0.05 * np.linalg.norm(change, axis=0).max())
