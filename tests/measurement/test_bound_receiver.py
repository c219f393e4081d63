"""The bound-driven receiver: its errors have the variance it says, and what it detects follows the detector's law."""

import numpy as np
import pytest

from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import ConfigError
from rislam_rt.measurement import ReceiverConfig, detection_probability, measure, path_std
from rislam_rt.measurement.config import check_half_turn
from rislam_rt.model import PathKind, RadioConfig, RxArray

RADIO = RadioConfig()
QUIET = ReceiverConfig(estimator="bound", clutter_rate=0.0, alternation=False)
UP = (0.3, -0.2, 0.9)


def repeat(paths, config, times, radio=RADIO, heading=0.0, seed=1):
    """Measurements of the same cycle under fresh noise."""
    rng = np.random.default_rng(seed)
    return [measure(paths, 0, heading, radio, config, rng=rng) for _ in range(times)]


def many(make_paths, gain):
    """Fifty paths more than a resolution cell apart: fifty draws a measurement."""
    return make_paths([(PathKind.PS, 2.0 + 0.4 * i, UP, gain) for i in range(50)])


def test_lone_path_errs_as_the_bound_says(make_paths, make_gain):
    paths = many(make_paths, make_gain(25.0, RADIO, 0.7))
    times = 2000
    runs = [m for m, _ in repeat(paths, QUIET, times // 50)]
    errors = np.concatenate(
        [np.column_stack([m.tau - paths.tau[0], m.cosines - paths.arrival[0, :, :2]]) for m in runs]
    )
    snr = 10.0**2.5
    tau = 1.0 / np.sqrt(8.0 * np.pi**2 * RADIO.bandwidth**2 / 12.0 * snr)
    lever = np.arange(4) - 1.5  # half wavelengths, four elements each
    cosine = 1.0 / np.sqrt(2.0 * snr / 16.0 * np.pi**2 * 4.0 * np.sum(lever**2))
    # a standard deviation from 2000 draws has a relative standard error of 1.6 %: five of them
    np.testing.assert_allclose(errors.std(axis=0), [tau, cosine, cosine], rtol=0.08)
    # mean of 2000: five standard errors
    assert np.all(np.abs(errors.mean(axis=0)) < 5.0 * np.array([tau, cosine, cosine]) / np.sqrt(times))
    amplitude = np.concatenate([m.amplitude for m in runs])
    assert amplitude.std() == pytest.approx(runs[0].amplitude_std[0], rel=0.08)


def test_reported_deviations_come_from_the_measured_amplitude(make_paths, make_gain):
    paths = make_paths([(PathKind.PS, 4.0, UP, make_gain(14.0, RADIO))])
    for measurement, _ in repeat(paths, QUIET, 20):
        tau, cosines = path_std(RADIO.integrated_snr(measurement.amplitude), RADIO)
        np.testing.assert_allclose(measurement.tau_std, tau, rtol=1e-12)
        np.testing.assert_allclose(measurement.cosines_std, cosines, rtol=1e-12)


@pytest.mark.parametrize("snr_db", [4.0, 10.0, 13.0])
def test_detection_follows_marcum_q(make_paths, make_gain, snr_db):
    """What the receiver does, against Q_1 (`tests/model/test_sensor.py`)."""
    probability = float(detection_probability(np.array(10.0 ** (snr_db / 10.0)), 10.0))
    paths = many(make_paths, make_gain(snr_db, RADIO))
    seen = np.mean([len(m) / 50.0 for m, _ in repeat(paths, QUIET, 40)])
    assert seen == pytest.approx(probability, abs=5.0 * np.sqrt(0.25 / 2000))


def test_turning_the_body_turns_the_cosines(make_paths, make_gain):
    paths = make_paths([(PathKind.PS, 4.0, (1.0, 0.0, 1.0), make_gain(70.0, RADIO))])
    measurement, _ = repeat(paths, QUIET, 1, heading=np.pi / 2.0)[0]
    # a ray from room x comes from the right of a body that looks along y; 70 dB leave errors of 1e-4
    np.testing.assert_allclose(measurement.cosines[0], [0.0, -np.sqrt(0.5)], atol=1e-3)


def test_rays_from_below_are_not_heard_but_level_ones_are(make_paths, make_gain):
    gain = make_gain(40.0, RADIO)
    paths = make_paths([(PathKind.VT, 2.0, (0.0, 0.0, -1.0), gain), (PathKind.VT, 4.0, (1.0, 0.0, -1e-9), gain)])
    _, truth = repeat(paths, QUIET, 1)[0]
    assert truth.path.tolist() == [1]
    isotropic = RadioConfig(array=RxArray(pattern="isotropic"))
    _, truth = repeat(paths, QUIET, 1, radio=isotropic)[0]
    assert truth.path.tolist() == [0, 1]


def test_cosines_stay_in_the_disc(make_paths, make_gain):
    paths = make_paths([(PathKind.VT, 4.0, (1.0, 1.0, 0.0), make_gain(15.0, RADIO))])
    cosines = np.array([m.cosines[0] for m, _ in repeat(paths, QUIET, 200) if len(m)])
    assert np.linalg.norm(cosines, axis=-1).max() <= 1.0 + 1e-12
    assert np.linalg.norm(cosines, axis=-1).min() < 0.99


def test_an_axis_without_aperture_says_nothing(make_paths, make_gain):
    radio = RadioConfig(array=RxArray(rows=1, cols=8))
    paths = make_paths([(PathKind.PS, 4.0, UP, make_gain(30.0, radio))])
    measurement, _ = repeat(paths, QUIET, 1, radio=radio)[0]
    assert measurement.cosines[0, 0] == 0.0
    assert measurement.cosines_std[0, 0] == 0.5
    assert measurement.cosines_std[0, 1] < 0.02


class TestMerging:
    """Cells are 1/B wide in delay (0.3 m at 1 GHz) and half a cosine in angle (4 elements, half a wavelength apart)."""

    strong_direction = (0.1, 0.0, 1.0)

    def pair(self, make_paths, make_gain, gap, direction, phase=0.0):
        return make_paths(
            [
                (PathKind.VT, 5.0, self.strong_direction, make_gain(50.0, RADIO)),
                (PathKind.RIS, 5.0 + gap, direction, make_gain(40.0, RADIO, phase)),
            ]
        )

    @pytest.mark.parametrize(
        ("gap", "direction", "count"),
        [(0.25, (0.2, 0.0, 1.0), 1), (0.35, (0.2, 0.0, 1.0), 2), (0.25, (1.0, 0.0, 0.7), 2)],
    )
    def test_only_what_shares_a_cell_merges(self, make_paths, make_gain, gap, direction, count):
        paths = self.pair(make_paths, make_gain, gap, direction)
        measurement, truth = repeat(paths, QUIET, 1)[0]
        assert len(measurement) == count
        assert truth.path[0] == 0
        assert len(repeat(paths, ReceiverConfig(estimator="bound", clutter_rate=0.0, merge=False), 1)[0][0]) == 2

    @pytest.mark.parametrize("phase", [0.0, np.pi])
    def test_merged_component_is_where_one_path_fits_the_sum_best(self, make_paths, make_gain, phase):
        """Against a search over the delay of one path fitted to the two-path spectrum."""
        gap = 0.05
        paths = self.pair(make_paths, make_gain, gap, self.strong_direction, phase)
        measurement, _ = repeat(paths, QUIET, 1)[0]
        weak = np.sqrt(0.1) * np.cos(phase)
        tones = np.linspace(-0.5e9, 0.5e9, 201)
        spectrum = 1.0 + weak * np.exp(-2j * np.pi * tones * gap / SPEED_OF_LIGHT)
        lengths = np.linspace(-0.05, 0.1, 3001)
        fit = np.abs(np.exp(2j * np.pi * lengths[:, None] * tones / SPEED_OF_LIGHT) @ spectrum)
        best = lengths[np.argmax(fit)]
        if phase:
            best = max(best, 0.0)  # the model keeps the merged path between its members
        # second-order terms of the fit and noise of 0.1 mm at 50 dB
        assert measurement.tau[0] * SPEED_OF_LIGHT - 5.0 == pytest.approx(best, abs=2e-3)
        expected = abs(make_gain(50.0, RADIO)) * (1.0 + weak)
        assert measurement.amplitude[0] == pytest.approx(expected, rel=0.02)

    def test_alternation_keeps_the_panel_apart(self, make_paths, make_gain):
        paths = self.pair(make_paths, make_gain, 0.1, self.strong_direction)
        measurement, truth = repeat(paths, ReceiverConfig(estimator="bound", clutter_rate=0.0, alternation=True), 1)[0]
        assert truth.path.tolist() == [0, 1]
        np.testing.assert_allclose(measurement.from_panel, [0.0, 1.0], atol=0.01)
        assert repeat(paths, QUIET, 1)[0][0].from_panel is None


def test_clutter_is_poisson_even_and_just_above_the_threshold(make_paths):
    config = ReceiverConfig(estimator="bound", clutter_rate=2.0)
    runs = repeat(make_paths([]), config, 1000)
    counts = np.array([len(m) for m, _ in runs])
    assert counts.mean() == pytest.approx(2.0, abs=5.0 * np.sqrt(2.0 / 1000))
    assert counts.var() == pytest.approx(2.0, abs=0.5)  # five standard errors of a Poisson variance
    assert all((truth.path == -1).all() for _, truth in runs)
    tau = np.concatenate([m.tau for m, _ in runs])
    assert tau.mean() == pytest.approx(40e-9, rel=0.03)  # 2000 draws of an even law: five standard errors
    height = np.concatenate([m.arrival[:, 2] for m, _ in runs])
    assert height.mean() == pytest.approx(2.0 / 3.0, rel=0.04)  # even over the disc of cosines, likewise
    snr = RADIO.integrated_snr(np.concatenate([m.amplitude for m, _ in runs]))
    assert snr.min() >= 10.0 * (1.0 - 1e-12)
    assert snr.mean() == pytest.approx(11.0, abs=0.12)  # noise above a threshold exceeds it by one on average


def test_leakage_is_cancelled_by_what_is_set(make_paths, make_gain):
    paths = make_paths([(PathKind.LOS, 0.1, (1.0, 0.0, 0.0), make_gain(84.0, RADIO))])
    config = ReceiverConfig(estimator="bound", clutter_rate=0.0, leakage_cancellation_db=60.0)
    measurement, _ = repeat(paths, config, 1)[0]
    # 24 dB are left; one draw of noise moves them by less than 3 dB
    assert 10.0 * np.log10(RADIO.integrated_snr(measurement.amplitude[0])) == pytest.approx(24.0, abs=3.0)


def test_components_come_by_delay_and_same_seed_same_result(make_paths, make_gain):
    gain = make_gain(30.0, RADIO)
    rows = [(PathKind.PS, 9.0, UP, gain), (PathKind.PS, 3.0, UP, gain), (PathKind.PS, 6.0, UP, gain)]
    paths = make_paths(rows)
    first, second = (repeat(paths, ReceiverConfig(estimator="bound"), 1, seed=5)[0] for _ in range(2))
    assert np.all(np.diff(first[0].tau) > 0.0)
    np.testing.assert_array_equal(first[0].tau, second[0].tau)
    np.testing.assert_array_equal(first[1].path, second[1].path)


def test_alternation_needs_an_even_panel():
    check_half_turn(4)
    with pytest.raises(ConfigError, match="even number"):
        check_half_turn(3)


@pytest.mark.parametrize(
    "wrong", [{"estimator": "magic"}, {"clutter_rate": -1.0}, {"max_delay": 0.0}, {"detection_threshold_db": np.nan}]
)
def test_unusable_settings_are_refused_in_one_line(wrong):
    with pytest.raises(ConfigError, match=f"receiver.{next(iter(wrong))}") as error:
        ReceiverConfig(**wrong)
    assert "\n" not in str(error.value)


class TestJointResolution:
    """Errors from the joint bound: wider where signals overlap, and one component where they cannot be shared out."""

    config = ReceiverConfig(estimator="bound", clutter_rate=0.0, resolution="joint", alternation=False)

    def pair(self, make_paths, make_gain, gap, snr_db):
        gains = make_gain(snr_db, RADIO), make_gain(snr_db, RADIO, 1.0)
        rows = [(PathKind.PS, 5.0 + i * gap * SPEED_OF_LIGHT / RADIO.bandwidth, UP, g) for i, g in enumerate(gains)]
        return make_paths(rows)

    @pytest.mark.parametrize(
        ("gap", "snr_db", "count"), [(0.5, 40.0, 2), (0.5, 15.0, 1), (0.05, 40.0, 1), (3.0, 15.0, 2)]
    )
    def test_resolution_depends_on_the_snr(self, make_paths, make_gain, gap, snr_db, count):
        paths = self.pair(make_paths, make_gain, gap, snr_db)
        counts = [len(m) for m, _ in repeat(paths, self.config, 20)]
        # at 15 dB one of the two may be missed
        assert np.median(counts) == count

    def test_errors_have_the_joint_deviation_that_is_reported(self, make_paths, make_gain):
        paths = self.pair(make_paths, make_gain, 0.6, 40.0)
        runs = [m for m, _ in repeat(paths, self.config, 800)]
        errors = np.array([m.tau - paths.tau[0] for m in runs])
        reported = np.mean([m.tau_std for m in runs], axis=0)
        # 800 draws: five standard errors of a deviation are 12 %
        np.testing.assert_allclose(errors.std(axis=0), reported, rtol=0.12)
        lone, _ = path_std(np.array(1e4), RADIO)
        assert np.all(reported > 1.5 * lone)
        assert abs(np.corrcoef(errors.T)[0, 1]) > 0.3

    def test_far_apart_it_is_the_lone_bound(self, make_paths, make_gain):
        paths = self.pair(make_paths, make_gain, 20.0, 30.0)
        measurement, _ = repeat(paths, self.config, 1)[0]
        tau, _ = path_std(RADIO.integrated_snr(measurement.amplitude), RADIO)
        np.testing.assert_allclose(measurement.tau_std, tau, rtol=0.01)

    def test_alternation_keeps_the_panel_apart(self, make_paths, make_gain):
        rows = [(PathKind.VT, 5.0, UP, make_gain(30.0, RADIO)), (PathKind.RIS, 5.01, UP, make_gain(20.0, RADIO))]
        config = ReceiverConfig(estimator="bound", clutter_rate=0.0, resolution="joint", alternation=True)
        measurement, truth = repeat(make_paths(rows), config, 1)[0]
        assert sorted(truth.path.tolist()) == [0, 1]
        assert (measurement.from_panel[truth.path == 1] > 0.99).all()
        assert len(repeat(make_paths(rows), self.config, 1)[0][0]) == 1

    def test_nothing_heard_is_nothing_reported(self, make_paths):
        assert len(repeat(make_paths([]), self.config, 1)[0][0]) == 0
