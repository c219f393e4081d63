"""The assumed model: the one place where anything crosses from the truth to filter, association and design.

`tell_belief` makes the filter's and the design's inputs from the truth and the errors of `[told]`; `perceived_paths`
turns the true signals as an undeclared tilt or clock does. The quantities stand one by one in `docs/told.md`.
"""

from dataclasses import fields, replace
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Antennas, Body, DataSheet, Measurement, Paths, RadioConfig, RisSpec, RisSpecs, Trajectory
from rislam_rt.pipeline.specification.mismatch import AssumedSection
from rislam_rt.pipeline.specification.spec import ESTIMATOR_SECTIONS, PipelineSpec, Settings, StartSection
from rislam_rt.slam import StartPrior


class AssumedModel(NamedTuple):
    """All that estimators and designs get beside measurements and the code in force."""

    start: StartPrior
    body: Body
    """Where Tx and Rx sit on the agent."""
    panel: DataSheet | None
    """Data sheet; None without a panel."""
    settings: Settings
    """Radio and settings of the estimators, as they are told; what concerns the receiver alone is the truth's."""
    heading: Floats
    """(K,) [rad] compass, one a cycle; each is shown in its own cycle alone."""
    time: Floats
    """(K,) [s]."""


def tell_belief(
    motion: Trajectory, body: Body, panel: DataSheet | None, spec: PipelineSpec, settings: Settings,
    *, start: np.random.Generator, compass: np.random.Generator,
) -> AssumedModel:  # fmt: skip
    """All that a run's belief is told of the truth: the assumed model.

    Parameters
    ----------
    motion
        True motion.
    body
        Offsets of Tx and Rx on a level agent.
    settings
        True ones.
    start, compass
        Draw the errors of the start, and of the compass.
    """
    told = spec.told
    noise = np.radians(told.compass_noise_deg) * compass.standard_normal(len(motion))
    heading = motion.heading + np.radians(told.compass_bias_deg) + noise
    return AssumedModel(
        tell_start(motion, float(heading[0]), spec.start, told, settings, rng=start),
        replace(body, tx_offset=body.tx_offset + told.baseline_m * _outwards(body)),
        None if panel is None else tell_panel(panel, told),
        tell_settings(settings, told),
        heading,
        motion.time * told.time_scale,
    )


def tell_start(
    motion: Trajectory, compass: float, start: StartSection, told: AssumedSection, settings: Settings,
    *, rng: np.random.Generator,
) -> StartPrior:  # fmt: skip
    """The start that is told: truth plus one draw of the prior's errors; a known height exact, a known heading by
    compass."""
    free_height, free_heading = settings.slam.height == "estimated", settings.slam.heading == "estimated"
    axes = told.start_scale * np.array([1.0, 1.0, float(free_height)])
    shift, push = rng.standard_normal(3), rng.standard_normal(3)
    turn = told.start_scale * np.radians(start.heading_std_deg) * rng.standard_normal()
    heading = motion.heading[0] + turn + np.radians(told.start_heading_deg) if free_heading else compass
    return StartPrior(
        motion.position[0] + shift * start.position_std_m * axes + [0.0, 0.0, told.height_m],
        motion.velocity[0] + push * start.velocity_std_m_s * axes,
        float(heading),
        start.position_std_m,
        start.velocity_std_m_s,
        float(np.radians(start.heading_std_deg)),
    )


def tell_panel(panel: DataSheet, told: AssumedSection) -> DataSheet:
    """The panel that is told: its data sheet, or one of each, orientation included."""
    if isinstance(panel, RisSpecs):
        return RisSpecs(tuple(_tell_one(one, told) for one in panel.panels))
    return _tell_one(panel, told)


def _tell_one(panel: RisSpec, told: AssumedSection) -> RisSpec:
    tilt, turn = np.radians(told.panel_tilt_deg), np.radians(told.panel_turn_deg)
    normal, up = panel.normal, panel.up
    if turn:
        up = np.cos(turn) * up + np.sin(turn) * panel.right
    if tilt:
        normal, up = np.cos(tilt) * normal + np.sin(tilt) * up, np.cos(tilt) * up - np.sin(tilt) * normal
    return replace(
        panel, normal=normal, up=up, spacing=panel.spacing * told.panel_spacing_scale,
        element=told.panel_element or panel.element, amplitude=panel.amplitude * _amplitude(told.panel_gain_db),
    )  # fmt: skip


def tell_settings(settings: Settings, told: AssumedSection) -> Settings:
    """The settings that are told: radio, process noise, what is known of detection and of false components."""
    slam = replace(settings.slam, max_bounces=max(settings.slam.max_bounces - told.bounces_less, 0))
    radio = tell_radio(settings.radio, told)
    sensor = replace(
        settings.sensor,
        radio=radio,
        threshold=settings.sensor.threshold * _amplitude(told.threshold_db) ** 2,
        false_alarms=settings.sensor.false_alarms * told.clutter_scale,
    )
    found = settings._replace(radio=radio, slam=slam, sensor=sensor)
    return found._replace(
        **{name: _livelier(getattr(found, name), told.process_noise_scale) for name in ("slam", *ESTIMATOR_SECTIONS)}
    )


def tell_radio(radio: RadioConfig, told: AssumedSection) -> RadioConfig:
    """The radio that is told: carrier, band and array as they are; noise, gains and antennas as assumed."""
    return replace(
        radio,
        noise_psd=radio.noise_psd * _amplitude(told.noise_db) ** 2,
        tx_gain=radio.tx_gain * _amplitude(told.gain_db) ** 2,
        antennas=Antennas() if told.antennas else radio.antennas,
    )


def tell_measurement(measurement: Measurement, told: AssumedSection) -> Measurement:
    """The measurement that is told: what the receiver reports, calibration and deviations as far off as assumed."""
    if told.array_scale == 1.0 and told.array_bias == 0.0 and told.std_scale == 1.0:
        return measurement
    cosines = told.array_scale * measurement.cosines + told.array_bias
    length = np.linalg.norm(cosines, axis=-1, keepdims=True)
    return replace(
        measurement,
        cosines=cosines / np.maximum(length, 1.0),
        **{name: told.std_scale * getattr(measurement, name) for name in ("tau_std", "cosines_std", "amplitude_std")},
    )


def tilted_motion(motion: Trajectory, told: AssumedSection) -> Trajectory:
    """Motion of a body that leans by an untold `tilt_deg`: its ends lie where they truly are."""
    if told.tilt_deg == 0.0:
        return motion
    tilt, body = _rotations(np.radians(told.tilt_deg), np.zeros(())), motion.body
    return replace(motion, body=replace(body, tx_offset=tilt @ body.tx_offset, rx_offset=tilt @ body.rx_offset))


def perceived_paths(
    paths: Paths, motion: Trajectory, told: AssumedSection, *, rng: np.random.Generator, since: float | None = None
) -> Paths:
    """Paths as heard by a leaning, swaying array with a clock of its own, of which the agent is not told.

    Arrivals are such that the body frame of a level agent gives them to the array; delays run with the clock, which
    drifts from the time `since` [s] on, the motion's first if it is not given.
    """
    arrival, tau = paths.arrival, paths.tau
    if told.tilt_deg or told.wobble_deg:
        sway = np.radians(told.wobble_deg) * rng.standard_normal((len(motion), 2))
        level, tilt = rotation_z(motion.heading), _rotations(np.radians(told.tilt_deg) + sway[:, 0], sway[:, 1])
        arrival = arrival @ np.swapaxes(level @ np.swapaxes(tilt, -1, -2) @ np.swapaxes(level, -1, -2), -1, -2)
    if told.clock_offset_ns or told.clock_drift_ns_s:
        elapsed = motion.time - (motion.time[0] if since is None else since)
        late = 1e-9 * (told.clock_offset_ns + told.clock_drift_ns_s * elapsed)
        tau = np.where(paths.valid, tau + late[:, None], tau)
    return replace(paths, arrival=arrival, tau=tau)


def _rotations(pitch: Floats, roll: Floats) -> Floats:
    """Rotations (..., 3, 3) of a body whose front is raised by `pitch` (about y), after a roll about x [rad]."""
    pitch, roll = np.broadcast_arrays(pitch, roll)
    one, zero = np.ones_like(pitch), np.zeros_like(pitch)
    cp, sp, cr, sr = np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    about_y = np.stack([cp, zero, -sp, zero, one, zero, sp, zero, cp], axis=-1).reshape(*pitch.shape, 3, 3)
    about_x = np.stack([one, zero, zero, zero, cr, -sr, zero, sr, cr], axis=-1).reshape(*pitch.shape, 3, 3)
    return np.asarray(about_y @ about_x)


def _outwards(body: Body) -> Floats:
    """Unit vector (3,) from the Rx to the Tx, along which an assumed baseline errs."""
    span = body.tx_offset - body.rx_offset
    return np.asarray(span / np.linalg.norm(span))


def _livelier(config: Any, scale: float) -> Any:
    """An estimator's settings with another assumed process noise."""
    assert "sigma_a" in {field.name for field in fields(config)}
    return replace(config, sigma_a=config.sigma_a * scale)


def _amplitude(decibel: float) -> float:
    return float(10.0 ** (decibel / 20.0))
