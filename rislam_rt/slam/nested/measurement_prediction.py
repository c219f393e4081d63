"""Prediction of measurements: which returns of the believed map should show now, and how strong."""

from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.information import amplitude_std
from rislam_rt.model import Body, DataSheet, RadioConfig, RisCode, RisSpec, SensorModel
from rislam_rt.ris import leg_response, panel_gain
from rislam_rt.ris.path_gain import point_amplitude
from rislam_rt.slam.nested.landmark_table import LandmarkTable
from rislam_rt.slam.returns import NONE, TX, Poses, PredictedReturn, Returns, bounced, compact, observe, reflect

FAINT = 0.35
"""Amplitude, in units of the detection threshold, down to which a return is still looked for."""
DEPTH = 0.1
"""Distance [m] from a wall below which a point counts as lying in it."""
HORIZON = 0.02
"""Third direction cosine below which nothing is expected: the array looks up."""
LEVEL = 0.02
"""Third direction cosine down to which wall returns are heard: those of upright walls arrive level."""
PANEL_AMPLITUDE_STD = 0.7
"""Spread of the panel's predicted log amplitude: its gain depends on phases, hence on millimetres."""


class ExpectedReturns(NamedTuple):
    """R returns worth looking for."""

    returns: Returns
    log_amplitude: Floats
    """(R,)."""
    log_amplitude_std: Floats
    """(R,)."""
    bounces: Integers
    """(R,) wall bounces."""
    owner: Integers
    """(R,) the feature that a return speaks about: the point of a direct one, else the wall next to the point."""
    by_parent: Booleans
    """(R,) whether it is direct, or over one wall and from the point that the wall was found by."""
    twin: Integers
    """(R,) row of the reciprocal, which has the legs exchanged; -1 without one."""
    likely: Booleans
    """(R,) strong enough to be seen for certain, unless something shades it."""


class MapBelief(NamedTuple):
    """The mean of the belief, in which returns are enumerated and linearised."""

    features: Floats
    """(F, 3)."""
    table: LandmarkTable
    poses: Poses
    body: Body
    sensor: SensorModel
    ris: DataSheet | None

    @property
    def radio(self) -> RadioConfig:
        """The radio that the receiver belongs to."""
        return self.sensor.radio

    @property
    def threshold(self) -> float:
        """Predicted amplitude at the detection threshold."""
        return float(amplitude_std(self.radio) * np.sqrt(2.0 * self.sensor.threshold))


def expected_returns(belief: MapBelief, code: RisCode | None, max_bounces: int, use_vt: bool) -> ExpectedReturns:
    """Predict all returns of up to `max_bounces` bounces that arrive from above and are not hopelessly faint."""
    table = belief.table
    returns = enumerate_returns(tuple(table.points.tolist()), tuple(table.walls.tolist()), max_bounces, use_vt)
    real = possible_legs(belief, returns)
    rows = (real[returns.tx] & real[returns.rx]).nonzero()[0]
    returns = Returns(returns.legs, returns.tx[rows], returns.rx[rows])
    sight = observe(returns, belief.features, table.anchor, belief.poses)
    heard = (sight.up > np.where(returns.point == TX, -LEVEL, HORIZON)).nonzero()[0]
    returns = Returns(returns.legs, returns.tx[heard], returns.rx[heard])
    sight = PredictedReturn._make(field[heard] for field in sight)
    amplitude, spread = predicted_amplitudes(belief, returns, sight, code)
    visible = ((amplitude >= FAINT * belief.threshold) | (bounces(returns) == 0)).nonzero()[0]
    kept, amplitude = compact(returns, visible), amplitude[visible]
    log_amplitude = np.log(np.maximum(amplitude, 1e-30))
    number, owner, by_parent = _roles(table, kept)
    likely = amplitude > 2.0 * belief.threshold
    return ExpectedReturns(kept, log_amplitude, spread[visible], number, owner, by_parent, partners(kept), likely)


@lru_cache(maxsize=64)
def enumerate_returns(points: tuple[int, ...], walls: tuple[int, ...], max_bounces: int, use_vt: bool) -> Returns:
    """Predicted returns one by one: every point over every pair of legs, and with `use_vt` the images of the Tx."""
    single = [(int(w), NONE) for w in walls] if max_bounces >= 1 else []
    double = [(int(a), int(b)) for a, b in product(walls, walls) if a != b] if max_bounces >= 2 else []
    sequences = [(NONE, NONE), *single, *double]
    order = [0] + [1] * len(single) + [2] * len(double)
    legs: list[tuple[int, int, int]] = []
    tx: list[int] = []
    rx: list[int] = []
    for point in points:
        base = len(legs)
        legs += [(int(point), *sequence) for sequence in sequences]
        for i, j in product(range(len(sequences)), repeat=2):
            if order[i] + order[j] <= max_bounces:
                tx.append(base + i)
                rx.append(base + j)
    if use_vt and walls:
        base = len(legs)
        legs += [(TX, *sequence) for sequence in sequences]
        tx += [base] * (len(sequences) - 1)
        rx += list(range(base + 1, len(legs)))
    return Returns(np.array(legs, dtype=np.int64).reshape(-1, 3), np.array(tx, np.int64), np.array(rx, np.int64))


def bounces(returns: Returns) -> Integers:
    """(R,) wall bounces of each predicted return."""
    walls = (returns.legs[:, 1:] != NONE).sum(axis=1)
    return walls[returns.tx] + walls[returns.rx]


def _roles(table: LandmarkTable, returns: Returns) -> tuple[Integers, Integers, Booleans]:
    """(R,) bounces, owner, and whether by_parent, of each predicted return."""
    number, point = bounces(returns), returns.point
    walls = returns.legs[:, 1]
    first = np.where(walls[returns.rx] != NONE, walls[returns.rx], walls[returns.tx])
    owner = np.where(number == 0, point, first)
    if not len(table.ident):
        return number, owner, np.zeros(len(owner), dtype=np.bool_)
    ident = np.where(point == TX, -1, table.ident[point])
    return number, owner, (number == 0) | ((number == 1) & (table.parent[owner] == ident))


def partners(returns: Returns) -> Integers:
    """(R,) row of each predicted return's reciprocal, -1 where there is none or it is the return itself."""
    row_of = {pair: row for row, pair in enumerate(zip(returns.tx.tolist(), returns.rx.tolist(), strict=True))}
    pairs = zip(returns.rx.tolist(), returns.tx.tolist(), strict=True)
    return np.array([row_of.get((rx, tx), -1) if rx != tx else -1 for rx, tx in pairs], dtype=np.int64)


def detection_share(table: LandmarkTable, expected: ExpectedReturns) -> Floats:
    """(R,) share of the cycles in which what each return speaks about showed lately, of those in which it should."""
    over_tx = expected.returns.legs[expected.returns.tx, 1] != NONE
    return table.detection_rate[expected.owner, over_tx.astype(np.int64)]


def predicted_amplitudes(
    belief: MapBelief, returns: Returns, sight: PredictedReturn, code: RisCode | None
) -> tuple[Floats, Floats]:
    """Amplitude (R,) predicted of each return, and standard deviation of its logarithm (R,)."""
    table, radio = belief.table, belief.radio
    if not len(returns.tx):
        return np.zeros(0), np.zeros(0)
    ratio, ratio_variance = _leg_ratio(table, returns)
    log_ratio = ratio[returns.tx] + ratio[returns.rx]
    variance = ratio_variance[returns.tx] + ratio_variance[returns.rx]
    strength, strength_std = table.log_strength
    point = returns.point
    moving = point == TX
    log_strength = np.where(moving, 0.0, strength[point])
    amplitude = point_amplitude(
        np.exp(log_strength + log_ratio), np.maximum(sight.tx_length, 1e-6), sight.rx_length, radio
    )
    free = radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain) / (4.0 * np.pi * sight.rx_length)
    amplitude = np.where(moving, free * np.exp(log_ratio), amplitude)
    spread = np.sqrt(np.where(moving, 0.0, strength_std[point] ** 2) + variance)
    if belief.ris is None or code is None:
        return amplitude, spread
    for holder, sheet, part in zip(table.holders, belief.ris.panels, belief.ris.parts(code), strict=True):
        rows = (point == holder).nonzero()[0] if holder >= 0 else []
        if len(rows):
            own = Returns(returns.legs, returns.tx[rows], returns.rx[rows])
            amplitude[rows] = _panel_amplitudes(belief, own, sheet, part) * np.exp(log_ratio[rows])
            spread[rows] = np.sqrt(PANEL_AMPLITUDE_STD**2 + variance[rows])
    return amplitude, spread


def _panel_amplitudes(belief: MapBelief, returns: Returns, sheet: RisSpec, code: RisCode) -> Floats:
    """Predicted |gain| (R,) of a panel's returns with perfect walls."""
    radio, returns = belief.radio, compact(returns, np.arange(len(returns.tx)))
    center, legs = belief.features[returns.legs[:, 0]], returns.legs
    tx, rx = (
        leg_response(sheet, center, _unfolded(belief, legs, device), np.sqrt(gain), radio.wavelength)
        for device, gain in ((belief.poses.tx, radio.tx_gain), (belief.poses.rx, radio.rx_gain))
    )
    return np.abs(panel_gain(tx[returns.tx], rx[returns.rx], code))


def _unfolded(belief: MapBelief, legs: Integers, device: Floats) -> Floats:
    """Device (G, 3) mirrored in the walls of each leg, so that it lies where the panel's ray seems to come from."""
    end = np.tile(device, (len(legs), 1))
    for column in (2, 1):
        rows, walls = bounced(legs, column)
        end[rows] = reflect(end[rows], belief.features[walls], belief.table.anchor[walls])
    return end


def _leg_ratio(table: LandmarkTable, returns: Returns) -> tuple[Floats, Floats]:
    """Predicted log amplitude ratio (G,) of each leg's walls, and its variance (G,)."""
    walls, none = returns.legs[:, 1:], returns.legs[:, 1:] == NONE
    total, variance = table.ratio[walls], table.ratio_variance[walls]
    total[none] = variance[none] = 0.0
    return total.sum(axis=1), variance.sum(axis=1)


def possible_legs(belief: MapBelief, returns: Returns) -> Booleans:
    """(G,) whether a leg can be predicted: each of its bounces has both ends on one side of the wall.

    Mirroring takes a source away from the device then, by twice the smaller of both depths at least; an image that
    comes nearer belongs to a wall that stands between. A point in the wall (the panel in its ceiling) has no image.
    """
    legs = returns.legs
    base = np.where((legs[:, 0] == TX)[:, None], belief.poses.tx, belief.features[legs[:, 0]])
    possible = np.ones(len(legs), dtype=np.bool_)
    for column in (1, 2):
        rows, walls = bounced(legs, column)
        wall, anchor = belief.features[walls], belief.table.anchor[walls]
        span, middle = wall - anchor, 0.5 * (wall + anchor)
        normal = span / np.sqrt(np.vecdot(span, span))[:, None]
        depth = np.vecdot(base[rows] - middle, normal)
        own = np.vecdot(belief.poses.rx - middle, normal)
        possible[rows] &= (depth * own > 0.0) & (np.abs(depth) > DEPTH)
        base[rows] -= 2.0 * depth[:, None] * normal
    return possible
