"""The waveform estimator: reaches the bound, resolves, keeps its false-alarm rate, and works beside strong walls."""

import numpy as np
import pytest
import scipy

from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.information import delay_gain_information, measurement_std, steering
from rislam_rt.measurement import ReceiverConfig, measure
from rislam_rt.measurement.detection_threshold import _half_perimeter, detection_threshold, expected_false_alarms
from rislam_rt.measurement.estimation.path_signals import Sounding, build_sounding, inner_of, waves_at
from rislam_rt.measurement.joint_bound import joint_bound
from rislam_rt.measurement.received_paths import receive
from rislam_rt.measurement.waveform_receiver import identify
from rislam_rt.model import PathKind, RadioConfig, RxArray

RADIO = RadioConfig()
CELL = SPEED_OF_LIGHT / RADIO.bandwidth
WAVEFORM = ReceiverConfig(estimator="waveform", alternation=False)
UP = (0.3, -0.2, 0.9)


def repeat(paths, config, times, radio=RADIO, seed=1):
    rng = np.random.default_rng(seed)
    return [measure(paths, 0, 0.0, radio, config, rng=rng) for _ in range(times)]


SOUNDINGS = [
    build_sounding(24, RadioConfig(array=RxArray(rows=3, cols=2))),
    build_sounding(25, RadioConfig(array=RxArray(rows=1, cols=4, spacing=0.4))),
]


class TestAlgebra:
    """Products of small factors against the signals written out; even and odd counts along every axis."""

    parameters = np.array([[3.2, 0.1, -0.4], [3.9, -0.6, 0.2], [11.0, 0.0, 0.7]])
    amplitude = np.array([3.0 + 1.0j, -2.0j, 0.5])

    def signal(self, sounding: Sounding, parameters):
        tau, u, v = np.asarray(parameters)
        x, y = np.meshgrid(sounding.row, sounding.col, indexing="ij")
        antennas = np.exp(2j * np.pi * (u * x + v * y)).ravel()
        return antennas[:, None] * np.exp(-2j * np.pi * tau * sounding.frequency)

    def slopes(self, sounding: Sounding, parameters, step=1e-6):
        return [
            (self.signal(sounding, parameters + s) - self.signal(sounding, parameters - s)) / (2.0 * step)
            for s in step * np.eye(3)
        ]

    @pytest.mark.parametrize("sounding", SOUNDINGS)
    def test_synthesis_and_correlation(self, sounding):
        waves = waves_at(sounding, self.parameters)
        samples = sum(a * self.signal(sounding, p) for a, p in zip(self.amplitude, self.parameters, strict=True))
        np.testing.assert_allclose(waves.sum(self.amplitude), samples, atol=1e-12)
        seen = waves.correlate(sounding, samples)
        for i, p in enumerate(self.parameters):
            assert seen[0, i] == pytest.approx(np.vdot(self.signal(sounding, p), samples), abs=1e-10)
            expected = [np.vdot(slope, samples) for slope in self.slopes(sounding, p)]
            # central differences of step 1e-6: relative error 1e-8 of terms up to 1e4
            np.testing.assert_allclose(seen[1:, i], expected, atol=1e-3)

    @pytest.mark.parametrize("sounding", SOUNDINGS)
    def test_inner_products(self, sounding):
        inner = inner_of(sounding, waves_at(sounding, self.parameters))
        for i, p in enumerate(self.parameters):
            for j, q in enumerate(self.parameters):
                left, right = ([self.signal(sounding, x), *self.slopes(sounding, x)] for x in (p, q))
                full = np.array([[np.vdot(a, b) for b in right] for a in left])
                assert inner.signal[i, j] == pytest.approx(full[0, 0], abs=1e-9)
                np.testing.assert_allclose(inner.mixed[i, :, j], full[0, 1:], atol=1e-3)
                np.testing.assert_allclose(inner.slope[:, i, :, j], full[1:, 1:], atol=1e-2)

    def test_joint_bound_is_the_inverse_fisher_information_of_appendix_b(self):
        """Against `information`, which has the flat band in closed form: tones differ from it by 1 / M^2 and less."""
        sounding = build_sounding(1024, RADIO)
        tau = np.array([20.0, 20.6, 24.0]) / RADIO.bandwidth
        arrival = np.array([[0.1, 0.2, 0.97], [0.3, 0.1, 0.95], [-0.5, 0.4, 0.77]])
        arrival /= np.linalg.norm(arrival, axis=1, keepdims=True)
        gain = np.array([1e-4, 3e-5 + 2e-5j, 4e-5j])  # loud enough for the disc to say nothing
        full = delay_gain_information(tau, gain, RADIO, antennas=steering(arrival, RADIO), angles=True)
        expected = np.linalg.inv(full / np.sqrt(np.outer(np.diag(full), np.diag(full))))
        expected = np.sqrt(np.diag(expected) / np.diag(full))
        parameters = np.column_stack([tau * RADIO.bandwidth, arrival[:, :2]])
        unit = np.sqrt(RADIO.energy / (1024 * RADIO.noise_psd))
        covariance, variance = joint_bound(inner_of(sounding, waves_at(sounding, parameters)), gain * unit)
        bound = np.sqrt(np.diag(covariance)).reshape(3, 3)
        np.testing.assert_allclose(bound[0] / RADIO.bandwidth, expected[:3], rtol=1e-2)
        np.testing.assert_allclose(bound[1:].ravel(), expected[3:9], rtol=1e-2)
        amplitude = np.hypot(expected[9:12], expected[12:])
        np.testing.assert_allclose(np.sqrt(variance) / unit, amplitude, rtol=1e-2)


@pytest.mark.parametrize("snr_db", [15.0, pytest.param(40.0, marks=pytest.mark.slow)])
def test_lone_path_reaches_the_bound(make_paths, make_gain, snr_db):
    paths = make_paths([(PathKind.PS, 4.0, UP, make_gain(snr_db, RADIO, 0.4))])
    times = 150
    errors = []
    for measurement, truth in repeat(paths, WAVEFORM, times):
        row = int(np.flatnonzero(truth.path == 0)[0])
        cosines = measurement.cosines[row] - paths.arrival[0, 0, :2]
        errors.append([measurement.tau[row] - paths.tau[0, 0], *cosines])
    bound = measurement_std(np.array(10.0 ** (snr_db / 10.0)), RADIO)
    ratio = np.sqrt(np.mean(np.array(errors) ** 2, axis=0)) / np.array([bound.tau, *bound.cosines])
    # a standard deviation from 150 draws has a relative standard error of 6 %
    assert np.all(ratio < 1.2)
    assert np.all(ratio > 0.8)


@pytest.mark.parametrize("phase", [0.0, 1.6, 3.1])
def test_half_a_cell_is_resolved_at_40_db(make_paths, make_gain, phase):
    gap = 0.5 * CELL
    first, second = make_gain(40.0, RADIO), make_gain(40.0, RADIO, phase)
    paths = make_paths([(PathKind.PS, 4.0, UP, first), (PathKind.PS, 4.0 + gap, UP, second)])
    off = []
    for measurement, truth in repeat(paths, WAVEFORM, 15):
        assert set(truth.path) >= {0, 1}
        tau = measurement.tau[[int(np.flatnonzero(truth.path == i)[0]) for i in (0, 1)]]
        off.append(abs(np.diff(tau)[0] * SPEED_OF_LIGHT - gap))
    # of opposite phases two thirds of the energy cancel: there the median of 100 trials is 0.11 gaps
    assert np.median(off) < 0.2 * gap


def test_path_60_db_below_the_walls_is_found(make_paths, make_gain):
    rows = [
        (PathKind.LOS, 0.1, (1.0, 0.3, 0.0), make_gain(84.0, RADIO, 0.3)),
        (PathKind.VT, 4.4, (0.0, 0.1, 1.0), make_gain(75.0, RADIO, 2.0)),
        (PathKind.VT, 6.1, (0.7, -0.7, 0.1), make_gain(73.0, RADIO, 1.0)),
        (PathKind.RIS, 5.0, (0.3, 0.2, 0.9), make_gain(15.0, RADIO, 0.0)),
    ]
    paths = make_paths(rows)
    found = 0
    for measurement, truth in repeat(paths, WAVEFORM, 10):
        assert set(truth.path) >= {0, 1, 2}
        found += 3 in truth.path
        row = np.flatnonzero(truth.path == 3)
        if len(row):
            assert abs(measurement.tau[row[0]] - paths.tau[0, 3]) < 5.0 * measurement.tau_std[row[0]]
    # at 15 dB against a threshold of 10 dB the detection probability is 0.99
    assert found >= 8


@pytest.mark.parametrize("alternation", [pytest.param(False, marks=pytest.mark.slow), True])
def test_false_alarms_keep_to_the_rate(make_paths, alternation):
    config = ReceiverConfig(estimator="waveform", false_alarm_rate=0.5, alternation=alternation)
    times = 300
    count = np.sum([len(m) for m, _ in repeat(make_paths([]), config, times)])
    # Poisson of 150: three standard deviations are 37; the search over a grid loses up to a tenth
    assert 0.6 * 150 < count < 1.25 * 150


def test_threshold_follows_from_the_rate():
    for rate in (1e-4, 0.1, 1.0):
        for alternation, panels in ((False, 1), (True, 1), (True, 3)):
            config = ReceiverConfig(false_alarm_rate=rate, alternation=alternation, panels=panels)
            a_capture = expected_false_alarms(detection_threshold(RADIO, config), RADIO, 80e-9)
            assert a_capture * config.num_captures == pytest.approx(rate, rel=1e-6)
    assert detection_threshold(RADIO, ReceiverConfig()) == pytest.approx(10.0)
    single = RadioConfig(array=RxArray(rows=1, cols=1))
    # one antenna searches delays alone: crossings of a Rayleigh process, by Rice's formula
    rate = 2.0 * np.pi * np.sqrt(1e18 / 12.0) * 80e-9 * np.sqrt(2.0 * 9.0 / (2.0 * np.pi)) * np.exp(-9.0)
    assert expected_false_alarms(9.0, single, 80e-9) == pytest.approx(rate + np.exp(-9.0), rel=1e-9)


class TestAlternation:
    """The panel a tenth of a cell behind a ceiling return 9 dB stronger, as half a metre before the nadir."""

    def paths(self, make_paths, make_gain):
        ceiling = (PathKind.VT, 5.0, (0.01, 0.02, 1.0), make_gain(29.0, RADIO, 0.5))
        panel = (PathKind.RIS, 5.0 + 0.1 * CELL, (0.05, 0.1, 1.0), make_gain(20.0, RADIO, 1.3))
        return make_paths([ceiling, panel])

    def test_it_sets_the_panel_apart_at_full_snr(self, make_paths, make_gain):
        paths = self.paths(make_paths, make_gain)
        config = ReceiverConfig(estimator="waveform", alternation=True)
        errors = []
        for measurement, truth in repeat(paths, config, 100):
            row = int(np.flatnonzero(truth.path == 1)[0])
            assert measurement.from_panel[row] > 0.99
            errors.append(measurement.tau[row] - paths.tau[0, 1])
        bound = measurement_std(np.array(100.0), RADIO).tau
        # 100 draws: three standard errors are 21 %
        assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(bound, rel=0.21)

    def test_without_it_the_panel_is_lost(self, make_paths, make_gain):
        runs = repeat(self.paths(make_paths, make_gain), WAVEFORM, 20)
        assert np.mean([1 in truth.path for _, truth in runs]) < 0.2


@pytest.mark.parametrize(
    "radio",
    [
        RadioConfig(array=RxArray(rows=1, cols=1)),
        RadioConfig(array=RxArray(rows=1, cols=8)),
        RadioConfig(bandwidth=20e6),
        RadioConfig(bandwidth=4e9),
        RadioConfig(array=RxArray(rows=8, cols=2, spacing=0.4)),
    ],
)
def test_any_array_and_bandwidth(make_paths, make_gain, radio):
    paths = make_paths([(PathKind.PS, 6.0, UP, make_gain(30.0, radio, 0.4))])
    measurement, truth = repeat(paths, WAVEFORM, 1, radio=radio)[0]
    row = int(np.flatnonzero(truth.path == 0)[0])
    assert abs(measurement.tau[row] - paths.tau[0, 0]) < 5.0 * measurement.tau_std[row]
    wide = np.array([radio.array.rows, radio.array.cols]) > 1
    assert np.all(
        np.abs(measurement.cosines[row] - paths.arrival[0, 0, :2])[wide] < 5.0 * measurement.cosines_std[row][wide]
    )
    np.testing.assert_allclose(measurement.cosines_std[row][~wide], 0.5)
    # at 30 dB one draw of noise moves an amplitude, and the deviations that follow from it, by less than a tenth
    bound = measurement_std(np.array(1e3), radio)
    assert measurement.tau_std[row] == pytest.approx(float(bound.tau), rel=0.1)
    np.testing.assert_allclose(measurement.cosines_std[row][wide], bound.cosines[wide], rtol=0.1)


def test_components_are_limited_to_what_is_asked_for(make_paths, make_gain):
    rows = [(PathKind.PS, 2.0 + 2.0 * i, UP, make_gain(30.0, RADIO)) for i in range(6)]
    config = ReceiverConfig(estimator="waveform", max_components=3)
    assert len(repeat(make_paths(rows), config, 1)[0][0]) == 3


def test_identification_prefers_the_path_that_fits_in_all_respects(make_paths, make_gain):
    weak, strong = make_gain(15.0, RADIO), make_gain(45.0, RADIO)
    paths = make_paths([(PathKind.VT, 5.0, UP, strong), (PathKind.RIS, 5.05, UP, weak)])
    received = receive(paths, 0, 0.0, RADIO, WAVEFORM)
    tau = np.array([5.04, 5.02, 9.0]) / SPEED_OF_LIGHT
    cosines = np.tile(received.direction[0, :2], (3, 1))
    gain = np.array([strong, weak, strong])
    assert identify(tau, cosines, gain, received, RADIO).tolist() == [0, 1, -1]


def test_same_seed_same_measurement(make_paths, make_gain):
    paths = make_paths([(PathKind.PS, 6.0, UP, make_gain(30.0, RADIO, 0.4))])
    (first, _), (second, _) = (repeat(paths, WAVEFORM, 1, seed=3)[0] for _ in range(2))
    np.testing.assert_array_equal(first.tau, second.tau)


def test_wrong_side_of_the_sky_is_still_the_path(make_paths, make_gain):
    """Half a wavelength apart, elements see the same from either end of their axis."""
    gain = make_gain(30.0, RADIO)
    paths = make_paths([(PathKind.VT, 5.0, (1.0, 0.01, 0.0), gain)])
    received = receive(paths, 0, 0.0, RADIO, WAVEFORM)
    assert identify(paths.tau[0], np.array([[-0.999, 0.01]]), np.array([gain]), received, RADIO).tolist() == [0]


def test_elements_of_their_own_cost_nothing_when_the_model_knows(make_paths, make_gain):
    """A near wall 60 dB above the noise: plane waves leave a hundredth of it, the exact model nothing."""
    rows = [(PathKind.VT, 1.0, (0.6, 0.3, 0.1), make_gain(60.0, RADIO)), (PathKind.PS, 4.0, UP, make_gain(25.0, RADIO))]
    config = ReceiverConfig(estimator="waveform", element_exact=True, false_alarm_rate=0.01)
    for measurement, truth in repeat(make_paths(rows), config, 3):
        assert truth.path.tolist() == [0, 1]
        assert abs(measurement.tau[1] * SPEED_OF_LIGHT - 4.0) < 5.0 * SPEED_OF_LIGHT * measurement.tau_std[1]


@pytest.mark.parametrize(("major", "minor"), [(1.0, 1.0), (3.0, 1.0), (5.0, 1e-3), (1.0, 1e-9), (2.0, 0.0), (0.0, 0.0)])
def test_half_perimeter_is_the_elliptic_integral(major, minor):
    wanted = 2.0 * major * scipy.special.ellipe(1.0 - (minor / major) ** 2) if major else 0.0
    assert _half_perimeter(major, minor) == pytest.approx(wanted, rel=1e-13)
