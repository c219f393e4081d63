"""The assumed model: what the SLAM filter and the code design take for true, made from the true model of a run.

Nothing of the truth reaches them in any other way. `tell_belief` makes the assumed model from the truth and the model
errors of `[told]`; `perceived_paths` changes the true paths as a tilt or a clock offset that the agent does not know
of. `docs/told.md` lists the quantities.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.model import Antennas, Body, DataSheet, Measurement, Paths, Trajectory, join_sheets
from rislam_rt.pipeline.specification.mismatch import AssumedSection
from rislam_rt.pipeline.specification.pipeline_spec import ESTIMATOR_SECTIONS, PipelineSpec, Settings, StartSection
from rislam_rt.slam import StartPrior


class AssumedModel(NamedTuple):
    """Assumed model of a run: all that estimators and code designers get beside measurements and the applied code."""

    start: StartPrior
    """Prior of position, velocity and heading at the first cycle."""
    body: Body
    """Assumed offsets of Tx and Rx from the agent's position, body frame."""
    panel: DataSheet | None
    """Assumed data sheet of the RIS panels; None without a panel."""
    settings: Settings
    """Assumed radio, sensor model and estimator settings; those of the receiver alone are the true ones."""
    heading: Floats
    """(K,) [rad] compass readings; an estimator sees each in its own cycle alone."""
    time: Floats
    """(K,) [s] assumed times of the cycles."""


def tell_belief(
    motion: Trajectory, body: Body, panel: DataSheet | None, spec: PipelineSpec, settings: Settings,
    *, start: np.random.Generator, compass: np.random.Generator,
) -> AssumedModel:  # fmt: skip
    """Assumed model of a run, made from the true motion, body, panel and settings and the errors of `[told]`.

    Parameters
    ----------
    motion
        True motion.
    body
        Offsets of Tx and Rx on a level agent.
    settings
        True ones.
    start, compass
        Generators of the errors of the start prior, and of the compass.
    """
    told = spec.told
    noise = np.radians(told.compass_noise_deg) * compass.standard_normal(len(motion))
    heading = motion.heading + np.radians(told.compass_bias_deg) + noise
    span = body.tx_offset - body.rx_offset
    return AssumedModel(
        tell_start(motion, float(heading[0]), spec.start, told, settings, rng=start),
        replace(body, tx_offset=body.tx_offset + told.baseline_m * (span / np.linalg.norm(span))),
        None if panel is None else tell_panel(panel, told), tell_settings(settings, told), heading,
        motion.time * told.time_scale,
    )  # fmt: skip


def tell_start(
    motion: Trajectory, compass: float, start: StartSection, told: AssumedSection, settings: Settings,
    *, rng: np.random.Generator,
) -> StartPrior:  # fmt: skip
    """Start prior that the agent is told (the assumed model): the true first pose plus one draw of the prior's errors.

    A known height is exact; a known heading is the first compass reading `compass` [rad].
    """
    free_height, free_heading = settings.slam.height == "estimated", settings.slam.heading == "estimated"
    axes = told.start_scale * np.array([1.0, 1.0, float(free_height)])
    shift, push = rng.standard_normal(3), rng.standard_normal(3)
    turn = told.start_scale * np.radians(start.heading_std_deg) * rng.standard_normal()
    heading = motion.heading[0] + turn + np.radians(told.start_heading_deg) if free_heading else compass
    return StartPrior(
        motion.position[0] + shift * start.position_std_m * axes + [0.0, 0.0, told.height_m],
        motion.velocity[0] + push * start.velocity_std_m_s * axes, float(heading), start.position_std_m,
        start.velocity_std_m_s, float(np.radians(start.heading_std_deg)),
    )  # fmt: skip


def tell_panel(panel: DataSheet, told: AssumedSection) -> DataSheet:
    """Assumed data sheet of the RIS panel, or of each of several, with the errors of orientation, spacing and gain."""
    tilt, turn = np.radians(told.panel_tilt_deg), np.radians(told.panel_turn_deg)
    sheets = []
    for one in panel.panels:
        normal, up = one.normal, one.up
        if turn:
            up = np.cos(turn) * up + np.sin(turn) * one.right
        if tilt:
            normal, up = np.cos(tilt) * normal + np.sin(tilt) * up, np.cos(tilt) * up - np.sin(tilt) * normal
        sheet = replace(
            one, normal=normal, up=up, spacing=one.spacing * told.panel_spacing_scale,
            element=told.panel_element or one.element, amplitude=one.amplitude * _amplitude(told.panel_gain_db),
        )  # fmt: skip
        sheets.append(sheet)
    return join_sheets(tuple(sheets))


def tell_settings(settings: Settings, told: AssumedSection) -> Settings:
    """Assumed settings of all estimators: true ones with errors of radio (noise density, antenna gain and patterns),
    process noise, threshold and clutter."""
    slam = replace(settings.slam, max_bounces=max(settings.slam.max_bounces - told.bounces_less, 0))
    radio = replace(
        settings.radio, noise_psd=settings.radio.noise_psd * _amplitude(told.noise_db) ** 2,
        tx_gain=settings.radio.tx_gain * _amplitude(told.gain_db) ** 2,
        antennas=Antennas() if told.antennas else settings.radio.antennas,
    )  # fmt: skip
    sensor = replace(
        settings.sensor, radio=radio, threshold=settings.sensor.threshold * _amplitude(told.threshold_db) ** 2,
        false_alarms=settings.sensor.false_alarms * told.clutter_scale,
    )  # fmt: skip
    found = settings._replace(radio=radio, slam=slam, sensor=sensor)
    configs: dict[str, Any] = {name: getattr(found, name) for name in ("slam", *ESTIMATOR_SECTIONS)}
    scale = told.process_noise_scale
    return found._replace(**{name: replace(one, sigma_a=one.sigma_a * scale) for name, one in configs.items()})


def tell_measurement(measurement: Measurement, told: AssumedSection) -> Measurement:
    """Measurement that the estimator is told (the assumed model): the receiver's, with errors of array calibration and
    of reported stds."""
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
    """True trajectory with the offsets of a body tilted by `tilt_deg`, of which the assumed model knows nothing."""
    if told.tilt_deg == 0.0:
        return motion
    tilt, body = _rotations(np.radians(told.tilt_deg), np.zeros(())), motion.body
    return replace(motion, body=replace(body, tx_offset=tilt @ body.tx_offset, rx_offset=tilt @ body.rx_offset))


def perceived_paths(
    paths: Paths, motion: Trajectory, told: AssumedSection, *, rng: np.random.Generator, since: float | None = None
) -> Paths:
    """True paths as a tilted, swaying array with a clock offset hears them, of which the assumed model knows nothing.

    The agent is told neither. Arrival directions are turned so that a level body frame gives what the tilted array
    measures; the clock drifts from the time `since` [s] on, the motion's first if it is not given.
    """
    arrival, tau = paths.arrival, paths.tau
    if told.tilt_deg or told.wobble_deg:
        sway = np.radians(told.wobble_deg) * rng.standard_normal((len(motion), 2))
        level, tilt = rotation_z(motion.heading), _rotations(np.radians(told.tilt_deg) + sway[:, 0], sway[:, 1])
        arrival = arrival @ np.swapaxes(level @ np.swapaxes(tilt, -1, -2) @ np.swapaxes(level, -1, -2), -1, -2)
    if told.clock_offset_ns or told.clock_drift_ns_s:
        late = clock_lateness(motion.time, told, since)
        tau = np.where(paths.valid, tau + late[:, None], tau)
    return replace(paths, arrival=arrival, tau=tau)


def clock_lateness(time: Floats, told: AssumedSection, since: float | None = None) -> Floats:
    """Delay (K,) [s] that clocks apart, of which the assumed model knows nothing, add to every path at `time` (K,) [s];
    they drift from the time `since` on, the first if it is not given."""
    elapsed = time - (time[0] if since is None else since)
    return np.asarray(1e-9 * (told.clock_offset_ns + told.clock_drift_ns_s * elapsed))


def _rotations(pitch: Floats, roll: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) of a body whose tilt the assumed model lacks: front raised by `pitch` (about y)
    after a roll about x [rad]."""
    pitch, roll = np.broadcast_arrays(pitch, roll)
    one, zero = np.ones_like(pitch), np.zeros_like(pitch)
    cp, sp, cr, sr = np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    about_y = np.stack([cp, zero, -sp, zero, one, zero, sp, zero, cp], axis=-1).reshape(*pitch.shape, 3, 3)
    about_x = np.stack([one, zero, zero, zero, cr, -sr, zero, sr, cr], axis=-1).reshape(*pitch.shape, 3, 3)
    return np.asarray(about_y @ about_x)


def _amplitude(decibel: float) -> float:
    """Amplitude ratio of decibels, for errors that the assumed model does not know."""
    return float(10.0 ** (decibel / 20.0))
