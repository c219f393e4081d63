"""The bound-driven receiver: what an efficient estimator would report, without making the signal.

A component's complex amplitude is measured with the variance of the matched filter over the signal and all L antennas,
N0 / (L E) for a lone path; it is detected when its measured SNR exceeds the threshold, which makes the detection
probability the Marcum Q function of a noncentral chi-square detector. Delay and cosines err as the Cramér-Rao bound
says.
"""

import numpy as np

from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.joint import joint_errors
from rislam_rt.measurement.parts import (
    Errors,
    Parts,
    audible,
    blind_axes,
    capped,
    into_disc,
    lone_errors,
    merge,
    single,
)
from rislam_rt.measurement.received import Received
from rislam_rt.measurement.sensor import build_sensor
from rislam_rt.model import Measurement, PathTruth, RadioConfig, SensorModel

NEGLIGIBLE = 1e-3
"""Paths this far below the detection threshold are left out: they move an amplitude at the threshold by 3 %."""


def measure_bound(
    received: Received, radio: RadioConfig, config: ReceiverConfig, num_paths: int, *, rng: np.random.Generator
) -> tuple[Measurement, PathTruth]:
    """Components with bound-driven errors, missed detections, merging and clutter, in the order of their delays.

    The errors have the variance that belongs to the true SNR; the standard deviations reported are those that the
    measured one suggests, all that a receiver knows. Each of the `num_paths` columns has its own draws whether heard
    or not, so that two codes see the same noise.
    """
    sensor = build_sensor(radio, config)
    threshold, window = sensor.threshold, sensor.window
    draws = rng.standard_normal((num_paths, 5))
    received = audible(received, radio.integrated_snr(received.gain) > NEGLIGIBLE * threshold)
    if config.resolution == "joint":
        parts, errors = joint_errors(received, radio, config, draws)
    else:
        parts = merge(received, sensor) if config.merge else single(received)
        errors = lone_errors(parts, radio, draws[parts.path])
    noise = draws[parts.path, :2] / np.sqrt(2.0)
    gain = parts.gain + errors.gain_std * (noise[:, 0] + 1j * noise[:, 1])
    points = np.column_stack([parts.tau, parts.cosines]) + errors.error
    seen = np.abs(gain) ** 2 > threshold * errors.gain_std**2
    seen &= (points[:, 0] >= window[0]) & (points[:, 0] <= window[1])
    # Deviations go as one over the amplitude: this is the bound at the measured one.
    deviation = errors.deviation * (np.abs(parts.gain) / np.maximum(np.abs(gain), 1e-300))[:, None]
    clutter, clutter_errors = _clutter(sensor, rng)
    points = np.vstack([points[seen], np.column_stack([clutter.tau, clutter.cosines])])
    deviation = np.vstack([deviation[seen], clutter_errors.deviation])
    order = np.argsort(points[:, 0])
    points, deviation = points[order], deviation[order]
    from_panel = np.concatenate([parts.from_panel[seen], clutter.from_panel])[order]
    measurement = Measurement(
        points[:, 0],
        into_disc(blind_axes(points[:, 1:], radio)),
        np.abs(np.concatenate([gain[seen], clutter.gain]))[order],
        deviation[:, 0],
        capped(deviation[:, 1:], radio),
        np.concatenate([errors.gain_std[seen], clutter_errors.gain_std])[order] / np.sqrt(2.0),
        from_panel if config.alternation else None,
    )
    return measurement, PathTruth(np.concatenate([parts.path[seen], clutter.path])[order])


def _clutter(sensor: SensorModel, rng: np.random.Generator) -> tuple[Parts, Errors]:
    """Poisson many, even over the delay window and the disc of cosines; amplitudes as of noise above the threshold."""
    radio, count = sensor.radio, rng.poisson(sensor.false_alarms)
    tau = rng.uniform(*sensor.window, count)
    radius, azimuth = np.sqrt(rng.uniform(size=count)), rng.uniform(-np.pi, np.pi, count)
    cosines = np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth)])
    snr = sensor.threshold + rng.exponential(size=count)
    gain = np.sqrt(snr * radio.noise_psd / (radio.array.num_antennas * radio.energy)).astype(np.complex128)
    parts = Parts(np.full(count, -1), tau, cosines, gain, rng.uniform(size=count) < 0.5)
    return parts, lone_errors(parts, radio, np.zeros((count, 5)))
