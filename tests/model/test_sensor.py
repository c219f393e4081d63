"""What the sensor model says of a receiver, against its definitions and against draws."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ive

from rislam_rt.errors import ConfigError
from rislam_rt.model import RadioConfig, SensorModel, detection_probability, merged_pull

SENSOR = SensorModel(RadioConfig())


@pytest.mark.parametrize(("snr", "threshold"), [(0.0, 10.0), (2.5, 10.0), (10.0, 10.0), (20.0, 15.8), (400.0, 10.0)])
def test_detection_is_marcums_integral(snr: float, threshold: float) -> None:
    a, b = np.sqrt(2.0 * snr), np.sqrt(2.0 * threshold)
    missed = quad(lambda x: x * np.exp(-0.5 * (x - a) ** 2) * ive(0, a * x), 0.0, b, limit=200)[0]
    # the quadrature is good to 1e-8
    assert float(detection_probability(snr, threshold)) == pytest.approx(1.0 - missed, abs=1e-7)


def test_a_strong_path_is_always_detected() -> None:
    np.testing.assert_array_equal(SENSOR.detection_probability(np.array([1e3, 1e6, 1e12])), 1.0)


def test_false_components_of_a_cycle_add_up_over_the_window() -> None:
    """Density times volume, by drawing 200 000 points of a box twice as wide as the sky: 0.3 % standard error."""
    rng, window = np.random.default_rng(1), (5e-9, 45e-9)
    sensor = SensorModel(RadioConfig(), false_alarms=1.7, window=window)
    tau, cosines = rng.uniform(0.0, 60e-9, 200_000), rng.uniform(-1.0, 1.0, (200_000, 2))
    mean = sensor.false_alarm_density(tau, cosines).mean() * 60e-9 * 4.0
    assert mean == pytest.approx(1.7, rel=0.02)
    level = np.linspace(0.0, 60.0, 60_001)
    assert np.trapezoid(sensor.false_alarm_snr_density(level), level) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("ratio", [0.1, 0.5, 0.9, 1.0])
def test_merged_paths_come_out_where_one_fits_best(ratio: float) -> None:
    """Against drawn phases, each weighed by the energy of the sum: 400 000 draws, 0.5 % of the spread."""
    weak = ratio * np.exp(2j * np.pi * np.random.default_rng(3).uniform(size=400_000))
    total = 1.0 + weak
    energy = np.abs(total) ** 2
    share = np.real(weak * total.conj()) / np.maximum(energy, 1e-12)
    mean, variance = merged_pull(ratio)
    drawn = np.average(share, weights=energy)
    assert drawn == pytest.approx(float(mean), abs=0.004)
    assert np.average((share - drawn) ** 2, weights=energy) == pytest.approx(float(variance), abs=0.004)


def test_paths_merge_within_a_cell_of_all_three_or_never() -> None:
    gap = np.array([[0.9e-9, 0.4, 0.4], [1.1e-9, 0.0, 0.0], [0.0, 0.51, 0.0]])
    np.testing.assert_array_equal(SensorModel(RadioConfig()).may_merge(gap), [True, False, False])
    assert not SensorModel(RadioConfig(), resolution="all").may_merge(gap).any()


@pytest.mark.parametrize(
    "wrong", [{"threshold": 0.0}, {"false_alarms": -1.0}, {"window": (1e-9, 1e-9)}, {"resolution": "eye"}]
)
def test_unusable_values_are_refused_in_one_line(wrong: dict[str, object]) -> None:
    with pytest.raises(ConfigError, match=f"sensor.{next(iter(wrong))}"):
        SensorModel(RadioConfig(), **wrong)  # type: ignore[arg-type]


def test_what_comes_a_period_later_is_heard_as_it():
    sensor = SensorModel(RadioConfig(), period=128e-9)
    period = 299792458.0 * 128e-9
    np.testing.assert_allclose(sensor.heard_as(np.array([12.0, 12.0 + period, 12.0 + 2.0 * period])), 12.0, atol=1e-12)
    np.testing.assert_allclose(
        sensor.nearest(np.array([0.4, 0.4 - period, -0.4 + period])), [0.4, 0.4, -0.4], atol=1e-12
    )
    assert float(SENSOR.heard_as(np.array(500.0))) == 500.0
