"""The local receiver: the waveform's samples, noise and decisions, its search spared (`local`)."""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats
from rislam_rt.information import measurement_std
from rislam_rt.measurement.atoms import Sounding, build_sounding
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.false_alarms import rim_share
from rislam_rt.measurement.inner import Waves, waves_at
from rislam_rt.measurement.local import LocalEstimate, estimate_local
from rislam_rt.measurement.received import Received
from rislam_rt.measurement.sensor import build_sensor
from rislam_rt.measurement.signal import add_noise, num_tones
from rislam_rt.measurement.slot import split
from rislam_rt.measurement.waveform import (
    Bounded,
    Capture,
    by_delay,
    capture,
    reported,
    to_measurement,
    true_paths,
)
from rislam_rt.model import Measurement, PathTruth, RadioConfig, SensorModel

SILENT, FAINT = 1e-4, 0.05
"""SNR over the threshold below which a path is left out of the signal, and is not asked for at its own place."""


def measure_local(
    received: Received, radio: RadioConfig, config: ReceiverConfig, *, rng: np.random.Generator
) -> tuple[Measurement, PathTruth]:
    """Components estimated from the cycle's samples, begun at the paths' own places, and noise taken for paths."""
    sensor, heard = build_sensor(radio, config), split(received, config)
    snr = np.array([radio.integrated_snr(one.gain) for one in heard])
    near = (snr > SILENT * sensor.threshold).any(axis=0)
    places = np.column_stack([received.tau * radio.bandwidth, received.direction[:, :2]])[near]
    sounding = build_sounding(_tones_needed(places, radio, config), radio)
    waves = waves_at(sounding, places, np.zeros(len(places), dtype=np.int64))
    if config.converter_bits:
        captures = capture(received, radio, config, rng=rng)
        samples = np.array([one.samples / np.sqrt(one.noise_psd) for one in captures])
    else:
        samples = _samples(waves, [one.gain[near] for one in heard], sounding, radio, rng=rng)
        captures = [Capture(one, radio.noise_psd, number) for number, one in enumerate(samples)]
    window = (sensor.window[0] * radio.bandwidth, sensor.window[1] * radio.bandwidth)
    found = estimate_local(sounding, _asked(waves, snr[:, near], sensor), samples, sensor.threshold, window)
    parts = []
    for number, one in enumerate(captures):
        bounded = _with_ghosts(_of_capture(found, number), sounding, sensor, len(captures), rng=rng)
        parts.append(reported(bounded, one, radio, config))
    components = by_delay(parts)
    truth = true_paths(components, received, radio, config)
    return to_measurement(components, radio, config), PathTruth(truth)


def _tones_needed(places: Floats, radio: RadioConfig, config: ReceiverConfig) -> int:
    """As many as the latest path needs: nothing is searched for behind it. All, where converters see them."""
    if config.num_subcarriers or config.converter_bits or not len(places):
        return num_tones(radio, config)
    latest = max(float(places[:, 0].max()) / radio.bandwidth, 1e-12)
    return num_tones(radio, replace(config, min_delay=0.0, max_delay=min(latest, config.max_delay)))


def _samples(
    waves: Waves, gains: list[Complexes], sounding: Sounding, radio: RadioConfig, *, rng: np.random.Generator
) -> Complexes:
    """(C, L, M) samples of unit noise, the paths with the gains (P,) of each capture."""
    unit = np.sqrt(radio.energy / (len(sounding.frequency) * radio.noise_psd))
    return add_noise(np.concatenate([waves.sum(unit * gain, 1) for gain in gains]), 1.0, rng=rng)


def _asked(waves: Waves, snr: Floats, sensor: SensorModel) -> Waves:
    """The places in each capture at which a path may be found, by its own SNR (C, P)."""
    tau = waves.parameters[:, 0] / sensor.radio.bandwidth
    inside: Booleans = (tau >= sensor.window[0]) & (tau <= sensor.window[1])
    side, rows = np.nonzero((snr > FAINT * sensor.threshold) & inside)
    return waves.take(rows)._replace(capture=side)


def _of_capture(found: LocalEstimate, number: int) -> Bounded:
    """What was found in one capture."""
    mine = np.flatnonzero(found.capture == number)
    return Bounded(
        found.parameters[mine],
        found.amplitude[mine],
        found.deviation[mine],
        found.amplitude_std[mine],
        found.inverse[np.ix_(mine, mine)],
    )


def _with_ghosts(
    found: Bounded, sounding: Sounding, sensor: SensorModel, captures: int, *, rng: np.random.Generator
) -> Bounded:
    """What was found, and peaks of noise far from any path: Poisson many, over window and sky, some on its rim."""
    radio, window = sensor.radio, sensor.window
    count = rng.poisson(sensor.false_alarms / captures)
    rim = rng.uniform(size=count) < rim_share(sensor.threshold, radio, window[1] - window[0])
    radius, azimuth = np.where(rim, 1.0, np.sqrt(rng.uniform(size=count))), rng.uniform(-np.pi, np.pi, count)
    snr = sensor.threshold + rng.exponential(size=count)
    lone = measurement_std(snr, radio)
    places = np.column_stack([
        rng.uniform(*window, count) * radio.bandwidth, radius * np.cos(azimuth), radius * np.sin(azimuth),
    ])  # fmt: skip
    unit = 1.0 / sounding.num_samples
    phase = np.exp(2j * np.pi * rng.uniform(size=count))
    covariance = np.zeros((len(found.amplitude) + count,) * 2)
    covariance[: len(found.amplitude), : len(found.amplitude)] = found.covariance
    covariance.flat[len(found.amplitude) * (len(covariance) + 1) :: len(covariance) + 1] = unit
    return Bounded(
        np.concatenate([found.parameters, places]),
        np.concatenate([found.amplitude, np.sqrt(snr * unit) * phase]),
        np.concatenate([found.deviation, np.column_stack([lone.tau * radio.bandwidth, lone.cosines])]),
        np.concatenate([found.amplitude_std, np.full(count, np.sqrt(unit))]),
        covariance,
    )
