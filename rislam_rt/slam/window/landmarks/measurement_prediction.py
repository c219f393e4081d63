"""Measurement prediction: which returns of the believed map should be detected now, where, how strong, and which
unresolved."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
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
from rislam_rt.slam.window.solver_limits import EDGE, FAINT

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
    """Predicted log amplitudes (R,) of returns and their standard deviations (R,): free space, walls' reflectivity,
    points' strengths, and panels under the phase code."""
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


class UnresolvedClusters(NamedTuple):
    """Clusters of R predicted returns that come out as C components; the strongest return of each resolution cell
    leads."""

    leader: Integers
    """(C,) row of the leading return."""
    partner: Integers
    """(C,) row of the strongest other return in the cell, -1 for none."""
    share: Floats
    """(C,) weight of the partner in the place of the merged component, before its amplitude is known: mean..."""
    share_variance: Floats
    """(C,) ...and variance."""
    disturbance: Floats
    """(C, 3) variance of length and cosines by other returns in the cell or at its edge."""
    log_amplitude: Floats
    """(C,) log amplitude of the merged component."""
    log_amplitude_std: Floats
    """(C,) its standard deviation."""
    by_itself: Floats
    """(C,) probability that it comes out by itself: 1 for leaders, less for a return that a leader should absorb."""
    gap: Floats
    """(C, 3) difference of length and cosines from the leader to its partner; 0 without one."""
    presence: Floats
    """(C,) probability that the partner is heard with the leader; 0 without one."""

    def mean_share(self) -> tuple[Floats, Floats]:
        """Mean and variance (C,) of the partner's weight in the place of the merged component, heard or not."""
        return _with_presence(self.share, self.share_variance, self.presence)


def cluster(
    expected: ExpectedComponents, cell: Floats, clear: Floats, sides: Integers | None = None
) -> UnresolvedClusters:
    """Cluster predicted returns that the receiver cannot resolve: from the strongest down, each absorbs the weaker ones
    in its cell, and those at the cell's edge add variance."""
    strength, power = expected.log_amplitude, np.exp(2.0 * expected.log_amplitude)
    first, second, gap = _neighbours(expected.seen / cell, strength, sides)
    inside = gap < 1.0
    taken, partner, by_itself, total = _taken_in(first[inside], second[inside], strength, power, clear)
    around = ~taken[first] & (partner[first] != second)
    first, second = first[around], second[around]
    ratio = 0.5 * power[second] / power[first] * clear[second]
    disturbance = np.zeros(expected.seen.shape)
    np.add.at(disturbance, first, ratio[:, None] * (expected.seen[second] - expected.seen[first]) ** 2)
    leader = np.concatenate([(~taken).nonzero()[0], taken.nonzero()[0]])
    mate = np.where(taken[leader], -1, partner[leader])
    both = mate >= 0
    ratio = np.where(both, np.exp(strength[mate] - strength[leader]), 0.0)
    uncertainty = np.where(both, np.hypot(expected.log_amplitude_std[mate], expected.log_amplitude_std[leader]), 0.0)
    twins = both & (expected.forms[leader] == reciprocal(expected.forms[mate])).all(axis=1)
    uncertainty[twins] = TWIN_STD
    # a ratio r leaves a mean share of 0 below one and 1 above, of variance r^2/2: averaged over the uncertainty about r
    lean = _above(np.log(np.maximum(ratio, 1e-9)) / np.maximum(uncertainty, 1e-3))
    share = np.where(both, lean, 0.0)
    spread = np.where(
        both,
        np.minimum(0.5 * ratio**2, 0.25) + lean * (1.0 - lean) * np.exp(-np.abs(np.log(np.maximum(ratio, 1e-9)))),
        0.0,
    )
    share[twins], spread[twins] = 0.5, TWIN_STD**2
    presence = np.where(both, clear[mate], 0.0)
    presence[twins] = 1.0  # what is in the way of the one is in the way of the other
    fade = np.where(both, 0.7 * np.minimum(ratio, 1.0), 0.0)
    return UnresolvedClusters(
        leader,
        mate,
        share,
        spread,
        disturbance[leader],
        np.where(taken[leader], strength[leader], 0.5 * np.log(total[leader])),
        np.hypot(expected.log_amplitude_std[leader], fade),
        by_itself[leader],
        np.where(both[:, None], expected.seen[mate] - expected.seen[leader], 0.0),
        presence,
    )


def _with_presence(share: Floats, variance: Floats, presence: Floats) -> tuple[Floats, Floats]:
    """Mean and variance of an unresolved partner's share: the given ones with a probability `presence`, else 0."""
    mean = presence * share
    return mean, np.maximum(presence * (variance + share**2) - mean**2, 0.0)


def _neighbours(place: Floats, strength: Floats, sides: Integers | None) -> tuple[Integers, Integers, Floats]:
    """Pairs (P,) of returns at places (R, 3) [cells], the second weaker and in the cell of the first or at its edge,
    sorted by row, and the largest gap (P,) of each pair along an axis."""
    # along the first axis a return's neighbours behind it are the next ones, up to the first beyond its edge
    order = np.argsort(place[:, 0], kind="stable")
    axes = place[order].T
    after = np.arange(len(place)) + 1
    many = np.searchsorted(axes[0], axes[0] + EDGE, side="right") - after
    first = np.repeat(after - 1, many)
    second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(many) - many, many)
    close = (np.abs(axes[1][first] - axes[1][second]) <= EDGE) & (np.abs(axes[2][first] - axes[2][second]) <= EDGE)
    first, second = order[first[close]], order[second[close]]
    if sides is not None:
        same = sides[first] == sides[second]
        first, second = first[same], second[same]
    ahead, count = strength[first] - strength[second], len(place)
    pairs = np.concatenate([(first * count + second)[ahead >= 0.0], (second * count + first)[ahead <= 0.0]])
    pairs.sort()
    first, second = np.divmod(pairs, count)
    gap = np.abs(place[first, 0] - place[second, 0])
    for axis in place.T[1:]:
        np.maximum(gap, np.abs(axis[first] - axis[second]), out=gap)
    return first, second, gap


def _taken_in(
    first: Integers, second: Integers, strength: Floats, power: Floats, clear: Floats
) -> tuple[Booleans, Integers, Floats, Floats]:
    """Predicted measurements that are unresolved: which of R expected returns, the weaker ones `second`, stronger ones
    `first` of the same cell absorb, the strongest that each absorbed, the probability that each comes out by itself,
    and its power with what it absorbed."""
    count, level, weaker = len(strength), strength.tolist(), second.tolist()
    owner, partner = [-1] * count, np.full(count, -1)
    crowded = np.flatnonzero(np.bincount(first, minlength=count))
    begin, end = (np.searchsorted(first, crowded, side) for side in ("left", "right"))
    order = np.argsort(-strength[crowded], kind="stable")
    for leader, low, high in zip(crowded[order].tolist(), begin[order].tolist(), end[order].tolist(), strict=True):
        members = [] if owner[leader] >= 0 else [member for member in weaker[low:high] if owner[member] < 0]
        for member in members:
            owner[member] = leader
        if members:
            partner[leader] = max(members, key=level.__getitem__)
    of = np.array(owner, dtype=np.int64)
    taken = of >= 0
    by_itself = np.where(taken, np.maximum(1.0 - clear[of], CONSTANTS.rare), 1.0)
    return taken, partner, by_itself, power + np.bincount(of[taken], power[taken], count)


TWIN_STD = 0.03
"""Relative difference of a return and its reciprocal in amplitude: a baseline of 0.1 m at some metres."""


def reciprocal(forms: Integers) -> Integers:
    """Forms (R, 5) of the reciprocal paths, predicted with Tx and Rx legs exchanged."""
    return forms[:, [0, 3, 4, 1, 2]]


def _above(z: Floats) -> Floats:
    """Probability that a standard normal variable is below z, for predicted measurements, by a logistic curve."""
    return np.asarray(1.0 / (1.0 + np.exp(-1.7 * np.clip(z, -20.0, 20.0))))


def conditioned_share(
    clusters: UnresolvedClusters,
    expected: ExpectedComponents,
    row: Integers,
    log_amplitude: Floats,
    log_amplitude_std: Floats,
    presence: Floats,
) -> tuple[Floats, Floats]:
    """Mean and variance (A,) of the unresolved partner's share in clusters `row` (A,), given the measured amplitudes,
    and the probabilities `presence` (A,) that it is heard.

    Two paths of amplitudes a, b with the sum A come out at the share `(A^2 + b^2 - a^2) / (2 A^2)` from the first to
    the second: exact to first order in the gap, whatever the phase.
    """
    share, variance = clusters.share[row].copy(), clusters.share_variance[row].copy()
    both = (clusters.partner[row] >= 0).nonzero()[0]
    lead, mate = clusters.leader[row[both]], clusters.partner[row[both]]
    whole = np.exp(2.0 * log_amplitude[both])
    first, second = np.exp(2.0 * expected.log_amplitude[lead]), np.exp(2.0 * expected.log_amplitude[mate])
    told = 0.5 * (whole + second - first) / whole
    uncertainty = (first * expected.log_amplitude_std[lead]) ** 2 + (second * expected.log_amplitude_std[mate]) ** 2
    uncertainty = uncertainty / whole**2 + (0.5 * (1.0 - 2.0 * told) * 2.0 * log_amplitude_std[both]) ** 2 + 1e-4
    prior = variance[both]
    twins = prior <= TWIN_STD**2
    gain = np.where(twins, 0.0, prior / (prior + uncertainty))
    share[both] = np.clip(share[both] + gain * (told - share[both]), 0.0, 1.0)
    variance[both] = (1.0 - gain) * prior
    return _with_presence(share, variance, presence)
