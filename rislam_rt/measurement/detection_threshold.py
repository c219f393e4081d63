"""Sensor model of a receiver: detection threshold, false alarms and resolution that follow from its settings.

Noise alone makes the matched filter's output, searched over delay and both direction cosines without a grid, a
stationary complex Gaussian field. How many of its peaks exceed a level follows from the expected Euler characteristic
of the excursion set of a chi-square field with two degrees of freedom (Worsley, Adv. Appl. Probab. 26, 1994), which
includes the edges of the searched region: small arrays have only a few beams across the sky, and half of the peaks lie
on its edge.
"""

from functools import lru_cache

import numpy as np
import scipy

from rislam_rt.measurement.components import NoiselessComponents, ReportedComponents, lone_errors
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.received_signal import num_tones
from rislam_rt.model import RadioConfig, SensorModel
from rislam_rt.model.sensor_model import ONE_PULSE

GRID_SHARE = 0.83
"""Share of the noise's peaks above the threshold that the search on a grid finds: measured on noise alone
(docs/receiver.md)."""


@lru_cache(maxsize=64)
def build_sensor(radio: RadioConfig, config: ReceiverConfig) -> SensorModel:
    """Sensor model of a receiver's settings: detection threshold, false-alarm rate, delay window, resolution.

    The bound-driven receiver draws as many false components as it is set to; the waveform's are the peaks of its noise.
    """
    threshold = detection_threshold(radio, config)
    rate, period = config.clutter_rate, ONE_PULSE
    if config.estimator == "waveform":
        expected = expected_false_alarms(threshold, radio, config.max_delay - config.min_delay)
        rate = config.num_captures * GRID_SHARE * expected
        period = num_tones(radio, config) / radio.bandwidth
    resolution = "cell" if config.estimator == "bound" and config.resolution == "cell" else "joint"
    return SensorModel(
        radio, threshold=threshold, false_alarms=rate, window=(config.min_delay, config.max_delay), period=period,
        resolution=resolution if config.merge else "all", alternation=config.alternation,
    )  # fmt: skip


def detection_threshold(radio: RadioConfig, config: ReceiverConfig) -> float:
    """Detection threshold (linear) on the measured SNR over all antennas: as set, or as the false-alarm rate demands,
    of which every capture of a cycle has the same share."""
    if not config.false_alarm_rate:
        return float(10.0 ** (config.detection_threshold_db / 10.0))
    rate = config.false_alarm_rate / config.num_captures
    return _threshold_of_rate(rate, radio, config.max_delay - config.min_delay)


def expected_false_alarms(threshold: float, radio: RadioConfig, window: float) -> float:
    """Mean number of peaks of noise alone above a linear SNR threshold, in delays over a window [s] and the whole sky.

    `sum_d mu_d rho_d(2 threshold)` over d = 0 .. 3: mu_d are the intrinsic volumes of (disc of cosines) x (window) in
    units in which the field's derivatives have unit variance, rho_d Worsley's densities for two degrees of freedom.
    """
    u, turn = 2.0 * threshold, 2.0 * np.pi
    density = np.array([1.0, np.sqrt(u / turn), (u - 1.0) / turn, np.sqrt(u) * (u - 3.0) / turn**1.5])
    return float(np.exp(-threshold) * density @ _intrinsic_volumes(radio, window))


def _intrinsic_volumes(radio: RadioConfig, window: float) -> tuple[float, float, float, float]:
    """Intrinsic volumes mu_0 .. mu_3 of the region where noise may pass the threshold: ellipse of cosines times
    interval of delays."""
    length = 2.0 * np.pi * np.sqrt(radio.effective_bandwidth_squared) * window
    positions = 2.0 * np.pi * radio.array.positions(1.0)[:, :2]
    minor, major = np.sort(np.sqrt(np.mean(positions**2, axis=0)))
    area = np.pi * minor * major
    half_perimeter = _half_perimeter(float(major), float(minor))
    return 1.0, half_perimeter + length, area + half_perimeter * length, area * length


def _half_perimeter(major: float, minor: float) -> float:
    """Half perimeter of the ellipse of cosines where noise may pass the threshold, by Gauss' arithmetic-geometric mean
    (Abramowitz and Stegun 17.6).

    `scipy.special.ellipe` would cost every command a tenth of a second to load.
    """
    if minor == 0.0:
        return 2.0 * major
    square, weight, a, b = major**2, 0.5, major, minor
    square -= weight * (a**2 - b**2)
    for _ in range(8):  # each step doubles the digits
        weight, gap, a, b = 2.0 * weight, 0.5 * (a - b), 0.5 * (a + b), np.sqrt(a * b)
        square -= weight * gap**2
    return float(np.pi * square / a)


@lru_cache(maxsize=64)
def _threshold_of_rate(rate: float, radio: RadioConfig, window: float) -> float:
    """Detection threshold (linear SNR) at which noise causes `rate` false alarms a cycle in a window [s] of delays."""
    # From here on all densities fall with the threshold; fewer alarms than exp(-300) nobody asks for.
    lowest, highest = 4.0, 300.0
    if expected_false_alarms(lowest, radio, window) <= rate:
        return lowest
    return float(
        scipy.optimize.brentq(lambda level: expected_false_alarms(level, radio, window) - rate, lowest, highest)
    )


def draw_false_alarms(sensor: SensorModel, *, rng: np.random.Generator) -> ReportedComponents:
    """Draw false alarms: a Poisson number, uniform over window and disc, amplitudes of noise above the threshold."""
    radio, count = sensor.radio, rng.poisson(sensor.false_alarms)
    tau = rng.uniform(*sensor.window, count)
    radius, azimuth = np.sqrt(rng.uniform(size=count)), rng.uniform(-np.pi, np.pi, count)
    cosines = np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth)])
    snr = sensor.threshold + rng.exponential(size=count)
    phase = np.exp(2j * np.pi * rng.uniform(size=count))
    gain = phase * np.sqrt(snr * radio.noise_psd / (radio.array.num_antennas * radio.energy))
    parts = NoiselessComponents(np.full(count, -1), tau, cosines, gain)
    errors = lone_errors(parts, radio, np.zeros((count, 5)))
    return ReportedComponents(
        parts.path, np.column_stack([tau, cosines]), errors.deviation, gain, errors.gain_std, np.zeros_like(parts.path)
    )
