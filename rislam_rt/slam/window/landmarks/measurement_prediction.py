"""Prediction of measurements: which returns of the believed map should show now, where, how strong, which as one."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Body, DataSheet, RadioConfig, RisCode, RisSpec
from rislam_rt.model.sensor import SensorModel
from rislam_rt.model.sensor import detection_probability as detection_probability_of
from rislam_rt.ris import leg_response, panel_gain
from rislam_rt.ris.path_gain import image_amplitude, point_amplitude
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.returns import NONE, TX, Poses, Returns, compact, linearise, observe, reflect
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.path_forms import enumerate_forms, forms_of, possible_legs
from rislam_rt.slam.window.smoother.steps import HEAD
from rislam_rt.slam.window.solver_limits import EDGE, FAINT

PANEL_STD = float(np.pi / np.sqrt(24.0))
"""Spread of the panel's predicted log amplitude: that of a Rayleigh variable, as phases hang on millimetres."""


class KnownEnvironment(NamedTuple):
    """What the filter knows of the world beside its features."""

    body: Body
    radio: RadioConfig
    sensor: SensorModel
    ris: DataSheet | None
    max_bounces: int
    use_vt: bool

    @property
    def num_panels(self) -> int:
        """Q: panels that points may be; one, that none is, where there is no panel."""
        return 1 if self.ris is None else len(self.ris.panels)


class ExpectedComponents(NamedTuple):
    """R returns worth looking for, at the mean belief."""

    forms: Integers
    """(R, 5) feature rows."""
    seen: Floats
    """(R, 3) length [m] as it is heard and two cosines."""
    jacobian: Floats
    """(R, 3, 7 + 3F) by the present: position, velocity, compass offset, features."""
    log_amplitude: Floats
    """(R,)."""
    log_amplitude_std: Floats
    """(R,)."""
    bounces: Integers
    """(R,)."""
    detection: Floats
    """(R,) probability that it shows, were nothing in its way and it alone."""


def predict_returns(
    features: Floats,
    landmarks: WindowTable,
    poses: Poses,
    position: Floats,
    scene: KnownEnvironment,
    code: RisCode | None,
    covariance: Floats,
) -> ExpectedComponents:
    """All forms that are possible, arrive from above, and may be detected; `covariance` (3F, 3F) of the features."""
    points, walls = tuple(landmarks.points.tolist()), tuple(landmarks.walls.tolist())
    returns, bounces = enumerate_forms(points, walls, scene.max_bounces)
    fine = possible_legs(returns.legs, features, covariance, landmarks.anchor, poses)
    rows = (fine[returns.tx] & fine[returns.rx]).nonzero()[0]
    returns, bounces = compact(returns, rows), bounces[rows]
    sight = observe(returns, features, landmarks.anchor, poses)
    reported = scene.sensor.in_window(scene.sensor.heard_as(sight.seen[:, 0]) / SPEED_OF_LIGHT)
    rows = ((sight.up > -CONSTANTS.dip * np.maximum(bounces, 1)) & reported).nonzero()[0]
    returns, bounces, ways = compact(returns, rows), bounces[rows], (sight.tx_length[rows], sight.rx_length[rows])
    level, spread = amplitudes(returns, features, landmarks, *ways, poses, scene, code)
    rows = (scene.radio.integrated_snr(np.exp(level + spread)) > FAINT).nonzero()[0]
    returns, bounces, level, spread = compact(returns, rows), bounces[rows], level[rows], spread[rows]
    linear = linearise(returns, features, landmarks.anchor, poses, HEAD)
    jacobian = linear.wide
    jacobian[..., :3], jacobian[..., 6] = linear.by_pose, linear.by_heading(poses, position)
    linear.seen[:, 0] = scene.sensor.heard_as(linear.seen[:, 0])
    return ExpectedComponents(
        forms_of(returns), linear.seen, jacobian, level, spread, bounces,
        detection_probability(level, spread, scene.sensor),
    )  # fmt: skip


def amplitudes(
    returns: Returns, features: Floats, landmarks: WindowTable, tx_length: Floats, rx_length: Floats, poses: Poses,
    scene: KnownEnvironment,
    code: RisCode | None,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Log amplitude (R,) and its standard deviation (R,)."""
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
    """|gain| (R,) of a panel's returns with perfect walls."""
    legs, center = returns.legs, features[returns.legs[:, 0]]
    ends = []
    for device, gain in ((poses.tx, radio.tx_gain), (poses.rx, radio.rx_gain)):
        end = np.tile(device, (len(legs), 1))
        for column in (2, 1):
            rows = (legs[:, column] != NONE).nonzero()[0]
            walls = legs[rows, column]
            end[rows] = reflect(end[rows], features[walls], landmarks.anchor[walls])
        ends.append(leg_response(spec, center, end, np.sqrt(gain), radio.wavelength))
    return np.abs(panel_gain(ends[0][returns.tx], ends[1][returns.rx], code))


def detection_probability(log_amplitude: Floats, spread: Floats, sensor: SensorModel) -> Floats:
    """(R,) averaged over a log amplitude of that spread: three points carry its mean and variance."""
    level = log_amplitude[..., None] + spread[..., None] * np.sqrt(3.0) * np.array([-1.0, 0.0, 1.0])
    snr = sensor.radio.integrated_snr(np.exp(np.minimum(level, 10.0)))
    curve = _detection_curve(sensor.threshold)
    place = np.minimum(np.sqrt(snr) / ROOT_STEP, len(curve) - 1.0)
    below = np.minimum(place.astype(np.int64), len(curve) - 2)
    each = curve[below] + (place - below) * (curve[below + 1] - curve[below])
    return np.asarray(each @ np.array([1.0, 4.0, 1.0]) / 6.0)


ROOT_STEP = 2e-3
"""Step of the root of the SNR in a table of the probability of detection."""


@lru_cache(maxsize=4)
def _detection_curve(threshold: float) -> Floats:
    """Probability of detection at roots of the SNR from 0 on, close enough for 1e-6 in between."""
    return detection_probability_of(np.arange(0.0, np.sqrt(threshold) + 7.0, ROOT_STEP) ** 2, threshold)


class UnresolvedClusters(NamedTuple):
    """C components that R expected returns come out as: the strongest of each cell leads."""

    leader: Integers
    """(C,) rows of the returns."""
    partner: Integers
    """(C,) the strongest other in the cell, -1 for none."""
    share: Floats
    """(C,) of the partner in the place of the whole, before the amplitude is known: mean..."""
    share_variance: Floats
    """(C,) ...and variance."""
    disturbance: Floats
    """(C, 3) variance by what else is in the cell, or may be."""
    log_amplitude: Floats
    """(C,) of the whole."""
    log_amplitude_std: Floats
    """(C,)."""
    by_itself: Floats
    """(C,) probability that it comes out by itself: 1 for leaders, less for what a leader should take in."""
    gap: Floats
    """(C, 3) from the leader to its partner, in what is seen of them; 0 without one."""


def cluster(
    expected: ExpectedComponents, cell: Floats, clear: Floats, sides: Integers | None = None
) -> UnresolvedClusters:
    """From the strongest down, each return takes in all that is in its cell; neighbours on the cell's edge disturb."""
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
    )


def _neighbours(place: Floats, strength: Floats, sides: Integers | None) -> tuple[Integers, Integers, Floats]:
    """Pairs (P,) of returns at places (R, 3) [cells], each with a weaker one on its cell or its edge, and their gaps.

    Row by row.
    """
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
    """Which of R returns are taken in, the strongest that each took in, the probability that each comes out by itself,
    and its power with what it took in; `second` lies in the cell of `first` and is weaker.
    """
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
    """Forms (R, 5) with their legs exchanged."""
    return forms[:, [0, 3, 4, 1, 2]]


def _above(z: Floats) -> Floats:
    return np.asarray(1.0 / (1.0 + np.exp(-1.7 * np.clip(z, -20.0, 20.0))))


def conditioned_share(
    clusters: UnresolvedClusters,
    expected: ExpectedComponents,
    row: Integers,
    log_amplitude: Floats,
    log_amplitude_std: Floats,
) -> tuple[Floats, Floats]:
    """Mean and variance (A,) of the partner's share in clusters `row` (A,), given the amplitudes measured.

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
    return share, variance
