"""The bound-driven receiver: draws the multipath components that an efficient estimator would report, without a signal.

A component's complex amplitude is measured with the variance of the matched filter over the signal and all L antennas,
N0 / (L E) for a lone path; it is detected when its measured SNR exceeds the threshold, which makes the detection
probability the Marcum Q function of a noncentral chi-square detector. Delay and cosines err as the Cramér-Rao bound
says.
"""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats, join_rows, take_rows
from rislam_rt.measurement import components
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.detection_threshold import build_sensor, draw_false_alarms
from rislam_rt.measurement.joint_bound import joint_errors
from rislam_rt.measurement.panel_probability import panel_probability
from rislam_rt.measurement.received_paths import Received
from rislam_rt.measurement.slot_motion import split_by_code
from rislam_rt.model import Measurement, PathTruth, RadioConfig, SensorModel

NEGLIGIBLE = 1e-3
"""SNR over the detection threshold below which paths are left out: they move an amplitude at the threshold by 3 %."""


def measure_bound(
    received: Received, radio: RadioConfig, config: ReceiverConfig, num_paths: int, num_extra: int = 0, *,
    rng: np.random.Generator,
) -> tuple[Measurement, PathTruth]:  # fmt: skip
    """Draw the multipath components of a cycle by the Cramér-Rao bound, with missed detections, merging and clutter.

    The errors have the variance that belongs to the true SNR; the standard deviations reported are those that the
    measured one suggests, all that a receiver knows. Each of the `num_paths` columns has its own draws in every capture
    whether heard or not, so that two codes see the same noise; the `num_extra` columns beyond have theirs from a
    generator of their own, so that they change nobody else's. Components are in the order of their delays.
    """
    sensor, captures = build_sensor(radio, config), split_by_code(received, config)
    draws = rng.standard_normal((len(captures), num_paths, 5))
    if num_extra:
        more = rng.spawn(1)[0].standard_normal((len(captures), num_extra, 5))
        draws = np.concatenate([draws, more], axis=1)
    # false components are as many in all, whichever capture they are in
    rate = replace(sensor, false_alarms=sensor.false_alarms / len(captures))
    parts = [_capture(*one, rate, config, rng=rng) for one in zip(captures, draws, strict=True)]
    parts = [part._replace(capture=np.full(len(part.path), number)) for number, part in enumerate(parts)]
    found = join_rows(parts)
    found = take_rows(found, np.argsort(found.points[:, 0]))
    told = panel_probability(found, radio, config) if config.alternation else ()
    measurement = Measurement(
        found.points[:, 0], components.clip_to_unit_disc(components.blind_axes(found.points[:, 1:], radio)),
        np.abs(found.gain), found.deviation[:, 0], components.capped_cosine_std(found.deviation[:, 1:], radio),
        found.gain_std / np.sqrt(2.0), *told,
    )  # fmt: skip
    return measurement, PathTruth(found.path)


def _capture(
    received: Received, draws: Floats, sensor: SensorModel, config: ReceiverConfig, *, rng: np.random.Generator
) -> components.ReportedComponents:
    """Draw the detected components of one capture by the bound, and its false alarms."""
    radio, window = sensor.radio, sensor.window
    received = take_rows(received, radio.integrated_snr(received.gain) > NEGLIGIBLE * sensor.threshold)
    if config.resolution == "joint":
        parts, errors = joint_errors(received, radio, config, draws)
    else:
        parts = components.merge(received, sensor) if config.merge else components.single(received)
        errors = components.lone_errors(parts, radio, draws[parts.path])
    noise = draws[parts.path, :2] / np.sqrt(2.0)
    gain = parts.gain + errors.gain_std * (noise[:, 0] + 1j * noise[:, 1])
    points = np.column_stack([parts.tau, parts.cosines]) + errors.error
    seen = np.abs(gain) ** 2 > sensor.threshold * errors.gain_std**2
    seen &= (points[:, 0] >= window[0]) & (points[:, 0] <= window[1])
    # Deviations go as one over the amplitude: this is the bound at the measured one.
    deviation = errors.deviation * (np.abs(parts.gain) / np.maximum(np.abs(gain), 1e-300))[:, None]
    none = np.zeros_like(parts.path)
    true = components.ReportedComponents(parts.path, points, deviation, gain, errors.gain_std, none)
    return join_rows([take_rows(true, seen), draw_false_alarms(sensor, rng=rng)])
