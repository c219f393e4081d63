"""Measurement prediction: which returns of the believed map should be detected now, where, and how strong."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Body, DataSheet, RadioConfig, RisCode, RisSpec
from rislam_rt.model.sensor_model import SensorModel
from rislam_rt.model.sensor_model import detection_probability as detection_probability_of
from rislam_rt.ris import leg_response, panel_gain
from rislam_rt.ris.path_gain import image_amplitude, point_amplitude
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import NONE, TX, Poses, Returns, bounced, compact, linearise, observe, reflect
from rislam_rt.slam.window.landmarks.horizon_detection import Elevations, elevations
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.path_forms import enumerate_forms, forms_of, possible_legs
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.solver_limits import FAINT

PANEL_STD = float(np.pi / np.sqrt(24.0))
"""Standard deviation of a panel's predicted log amplitude: that of a Rayleigh variable, as phases hang on
millimetres."""


class KnownEnvironment(NamedTuple):
    """What the filter is told beside its map: body, radio, sensor model, panels, and which paths to look for."""

    body: Body
    """Offsets of Tx and Rx from the agent's position."""
    radio: RadioConfig
    """Carrier, bandwidth, powers and noise."""
    sensor: SensorModel
    """Resolution, window and detection threshold of the receiver."""
    ris: DataSheet | None
    """Data sheet of the panels, None without any."""
    max_bounces: int
    """Most walls on a predicted path."""
    use_vt: bool
    """Whether wall returns, paths over walls alone, update the belief."""

    @property
    def num_panels(self) -> int:
        """Number Q of panels that points may be, as measurements are predicted; 1 where there is no panel, and no point
        is it."""
        return 1 if self.ris is None else len(self.ris.panels)


class ExpectedComponents(NamedTuple):
    """Predicted returns at the mean belief, R of them: form, measurement, jacobian, amplitude and detection
    probability."""

    forms: Integers
    """(R, 5) forms of feature rows (see `path_forms`)."""
    seen: Floats
    """(R, 3) length [m] as it is heard (less whole periods of the sounding) and two cosines."""
    jacobian: Floats
    """(R, 3, 7 + 3F) derivatives by the present: position, velocity, compass offset, features."""
    log_amplitude: Floats
    """(R,) predicted log amplitude."""
    log_amplitude_std: Floats
    """(R,) its standard deviation."""
    bounces: Integers
    """(R,) number of walls on the path."""
    detection: Floats
    """(R,) detection probability, were nothing in its way, it alone, and above the plane of the array."""
    elevation: Elevations
    """Elevations of the R returns for a level body."""


def predict_returns(
    features: Floats,
    landmarks: WindowTable,
    poses: Poses,
    position: Floats,
    scene: KnownEnvironment,
    code: RisCode | None,
    covariance: Floats,
) -> ExpectedComponents:
    """Predict all returns over the map that are geometrically possible, arrive from above and may be detected;
    `covariance` (3F, 3F) is that of the features."""
    points, walls = tuple(landmarks.points.tolist()), tuple(landmarks.walls.tolist())
    returns, bounces = enumerate_forms(points, walls, scene.max_bounces)
    fine = possible_legs(returns.legs, features, covariance, landmarks.anchor, poses)
    rows = (fine[returns.tx] & fine[returns.rx]).nonzero()[0]
    returns, bounces = compact(returns, rows), bounces[rows]
    sight = observe(returns, features, landmarks.anchor, poses)
    reported = scene.sensor.in_window(scene.sensor.heard_as(sight.seen[:, 0]) / SPEED_OF_LIGHT)
    rows = ((sight.up > -CONSTANTS.dip * np.maximum(bounces, 1)) & reported).nonzero()[0]
    returns, bounces, ways = compact(returns, rows), bounces[rows], (sight.tx_length[rows], sight.rx_length[rows])
    rise = sight.up[rows] if scene.radio.array.pattern == "upper" else np.ones(len(rows))
    level, spread = amplitudes(returns, features, landmarks, *ways, poses, scene, code)
    rows = (scene.radio.integrated_snr(np.exp(level + spread)) > FAINT).nonzero()[0]
    returns, bounces, level, spread = compact(returns, rows), bounces[rows], level[rows], spread[rows]
    ways, rise = (ways[0][rows], ways[1][rows]), rise[rows]
    linear = linearise(returns, features, landmarks.anchor, poses, HEAD)
    jacobian = linear.wide
    jacobian[..., :3], jacobian[..., 6] = linear.by_pose, linear.by_heading(poses, position)
    linear.seen[:, 0] = scene.sensor.heard_as(linear.seen[:, 0])
    return ExpectedComponents(
        forms_of(returns), linear.seen, jacobian, level, spread, bounces,
        detection_probability(level, spread, scene.sensor),
        elevations(rise, _rise_std(returns, covariance, ways[1]), linear.seen[:, 1:]),
    )  # fmt: skip


def _rise_std(returns: Returns, covariance: Floats, rx_length: Floats) -> Floats:
    """Standard deviations (R,) of the elevations' sines of returns that arrive nearly level, over unfolded Rx legs of
    lengths (R,) [m], from the covariance (3F, 3F) of the features: an image lifted moves by its height over its
    distance."""
    height = np.append(np.diagonal(covariance)[2::3], 0.0)
    parts = returns.legs[returns.rx]
    return np.asarray(np.sqrt(height[np.where(parts >= 0, parts, -1)].sum(axis=1)) / rx_length)


def amplitudes(
    returns: Returns, features: Floats, landmarks: WindowTable, tx_length: Floats, rx_length: Floats, poses: Poses,
    scene: KnownEnvironment,
    code: RisCode | None,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Log amplitudes (R,) of returns for the prediction of measurements, and their standard deviations (R,): free
    space, walls' reflectivity, points' strengths, and panels under the phase code."""
    radio, legs = scene.radio, returns.legs
    if not len(returns.tx):
        return np.zeros(0), np.zeros(0)
    none = legs[:, 1:] == NONE
    left = np.where(none, 0.0, landmarks.ratio[legs[:, 1:]]).sum(axis=1)
    uncertainty = np.where(none, 0.0, landmarks.ratio_variance[legs[:, 1:]]).sum(axis=1)
    ratio, variance = left[returns.tx] + left[returns.rx], uncertainty[returns.tx] + uncertainty[returns.rx]
    point = returns.point
    moving = point == TX
    strength, strength_std = landmarks.log_strength
    free = np.log(image_amplitude(rx_length, radio)) + ratio
    unit = point_amplitude(np.ones(()), np.maximum(tx_length, 1e-3), rx_length, radio)
    level = np.where(moving, free, np.log(unit) + ratio + strength[point])
    spread = np.sqrt(np.where(moving, 0.0, strength_std[point] ** 2) + variance + (0.3 * CONSTANTS.fading) ** 2)
    if scene.ris is None or code is None:
        return level, spread
    for panel, spec, part in zip(landmarks.panels, scene.ris.panels, scene.ris.parts(code), strict=True):
        if panel >= 0:
            rows = (point == panel).nonzero()[0]
            gain = panel_gains(compact(returns, rows), features, landmarks, poses, radio, spec, part)
            level[rows] = np.log(np.maximum(gain, 1e-30)) + ratio[rows]
            spread[rows] = np.sqrt(PANEL_STD**2 + variance[rows])
    return level, spread


def panel_gains(
    returns: Returns,
    features: Floats,
    landmarks: WindowTable,
    poses: Poses,
    radio: RadioConfig,
    spec: RisSpec,
    code: RisCode,
) -> Floats:
    """Predicted magnitudes (R,) of the path gains of returns over one panel under its phase code, with walls that
    reflect without loss."""
    legs, center = returns.legs, features[returns.legs[:, 0]]
    ends = np.repeat([[poses.tx], [poses.rx]], len(legs), axis=1)
    for column in (2, 1):
        rows, walls = bounced(legs, column)
        ends[:, rows] = reflect(ends[:, rows], features[walls], landmarks.anchor[walls])
    gain = np.sqrt([[radio.tx_gain], [radio.rx_gain]])
    tx, rx = leg_response(spec, center, ends, gain, radio.wavelength)
    return np.abs(panel_gain(tx[returns.tx], rx[returns.rx], code))


def detection_probability(log_amplitude: Floats, spread: Floats, sensor: SensorModel) -> Floats:
    """Predicted detection probability (R,) averaged over a log amplitude of standard deviation `spread`: three points
    carry its mean and variance."""
    level = log_amplitude[..., None] + spread[..., None] * np.sqrt(3.0) * np.array([-1.0, 0.0, 1.0])
    snr = sensor.radio.integrated_snr(np.exp(np.minimum(level, 10.0)))
    curve = _detection_curve(sensor.threshold)
    place = np.minimum(np.sqrt(snr) / ROOT_STEP, len(curve) - 1.0)
    below = np.minimum(place.astype(np.int64), len(curve) - 2)
    each = curve[below] + (place - below) * (curve[below + 1] - curve[below])
    return np.asarray(each @ np.array([1.0, 4.0, 1.0]) / 6.0)


ROOT_STEP = 2e-3
"""Step of the square root of the SNR in the table of detection probabilities."""


@lru_cache(maxsize=4)
def _detection_curve(threshold: float) -> Floats:
    """Table for the prediction of measurements: detection probability at square roots of the SNR from 0 on, close
    enough for 1e-6 in between."""
    return detection_probability_of(np.arange(0.0, np.sqrt(threshold) + 7.0, ROOT_STEP) ** 2, threshold)
