"""Which returns of the believed map should show now, and how strong."""

from itertools import product
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.model import Body, RadioConfig, RisCode, RisSpec
from rislam_rt.slam.book import Book
from rislam_rt.slam.identity import point_amplitude, predicted_panel_gain
from rislam_rt.slam.returns import NONE, TX, Poses, Returns, Sight, observe, reflect

FAINT = 0.5
"""Amplitude, in units of the detection threshold, down to which a return is still looked for."""
HORIZON = 0.02
"""Third direction cosine below which nothing is expected: the array looks up."""
PANEL_AMPLITUDE_STD = 0.7
"""Spread of the panel's predicted log amplitude: its gain depends on phases, hence on millimetres."""


class Expected(NamedTuple):
    """R returns worth looking for."""

    returns: Returns
    log_amplitude: Floats
    """(R,)."""
    log_amplitude_std: Floats
    """(R,)."""
    likely: Booleans
    """(R,) strong enough to be seen for certain, unless something shades it."""


class Belief(NamedTuple):
    """The mean of the belief, in which returns are enumerated and linearised."""

    features: Floats
    """(F, 3)."""
    book: Book
    poses: Poses
    body: Body
    radio: RadioConfig
    ris: RisSpec | None


def expected_returns(
    belief: Belief, code: RisCode | None, max_bounces: int, detection_snr: float, use_vt: bool
) -> Expected:
    """All returns of up to `max_bounces` bounces that arrive from above and are not hopelessly faint."""
    returns = enumerate_returns(belief.book, max_bounces, use_vt)
    anchor = belief.book.anchor
    sight = observe(returns, belief.features, anchor, belief.poses)
    amplitude, spread = predicted_amplitudes(belief, returns, sight, code)
    radio = belief.radio
    threshold = np.sqrt(detection_snr * radio.noise_psd / (radio.array.num_antennas * radio.energy))
    direct = bounces(returns) == 0
    faint = amplitude < FAINT * threshold
    visible = (sight.up > HORIZON) & ~_degenerate(belief, returns) & (~faint | direct)
    kept = Returns(returns.legs, returns.tx[visible], returns.rx[visible])
    amplitude = amplitude[visible]
    log_amplitude = np.log(np.maximum(amplitude, 1e-30))
    return Expected(kept, log_amplitude, spread[visible], amplitude > 2.0 * threshold)


def enumerate_returns(book: Book, max_bounces: int, use_vt: bool) -> Returns:
    """Every point over every pair of legs, and with `use_vt` the images of the Tx."""
    points, walls = book.points, book.walls
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
    if use_vt and walls.size:
        base = len(legs)
        legs += [(TX, *sequence) for sequence in sequences]
        tx += [base] * (len(sequences) - 1)
        rx += list(range(base + 1, len(legs)))
    return Returns(np.array(legs, dtype=np.int64).reshape(-1, 3), np.array(tx, np.int64), np.array(rx, np.int64))


def bounces(returns: Returns) -> Integers:
    """(R,) wall bounces of each return."""
    walls = np.sum(returns.legs[:, 1:] != NONE, axis=1)
    return walls[returns.tx] + walls[returns.rx]


def predicted_amplitudes(belief: Belief, returns: Returns, sight: Sight, code: RisCode | None) -> tuple[Floats, Floats]:
    """Amplitude (R,) and standard deviation of its logarithm (R,)."""
    book, radio = belief.book, belief.radio
    if not len(returns.tx):
        return np.zeros(0), np.zeros(0)
    ratio, ratio_variance = _leg_ratio(book, returns)
    log_ratio = ratio[returns.tx] + ratio[returns.rx]
    variance = ratio_variance[returns.tx] + ratio_variance[returns.rx]
    strength, strength_std = book.log_strength
    point = returns.point
    moving = point == TX
    log_strength = np.where(moving, 0.0, strength[point])
    amplitude = point_amplitude(
        np.exp(log_strength + log_ratio), np.maximum(sight.tx_length, 1e-6), sight.rx_length, radio
    )
    free = radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain) / (4.0 * np.pi * sight.rx_length)
    amplitude = np.where(moving, free * np.exp(log_ratio), amplitude)
    spread = np.sqrt(np.where(moving, 0.0, strength_std[point] ** 2) + variance)
    panel = int(np.argmax(book.ris_probability))
    if belief.ris is not None and code is not None and book.ris_probability[panel] > 0.5:
        rows = np.flatnonzero(point == panel)
        amplitude[rows] = _panel_amplitudes(belief, Returns(returns.legs, returns.tx[rows], returns.rx[rows]), code)
        amplitude[rows] *= np.exp(log_ratio[rows])
        spread[rows] = np.sqrt(PANEL_AMPLITUDE_STD**2 + variance[rows])
    return amplitude, spread


def _panel_amplitudes(belief: Belief, returns: Returns, code: RisCode) -> Floats:
    """|gain| (R,) of the panel's returns with perfect walls."""
    assert belief.ris is not None
    ends = [_unfolded(belief, returns.legs[rows], end) for rows, end in
            ((returns.tx, belief.poses.tx), (returns.rx, belief.poses.rx))]  # fmt: skip
    center = belief.features[returns.point]
    gain = predicted_panel_gain(belief.ris, code, center, ends[0], ends[1], np.ones(1), belief.radio)
    return np.abs(gain)


def _unfolded(belief: Belief, legs: Integers, device: Floats) -> Floats:
    """Device (R, 3) mirrored in the walls of each leg, so that it lies where the panel's ray seems to come from."""
    end = np.broadcast_to(device, (len(legs), 3)).copy()
    for column in (2, 1):
        rows = np.flatnonzero(legs[:, column] != NONE)
        walls = legs[rows, column]
        end[rows] = reflect(end[rows], belief.features[walls], belief.book.anchor[walls])
    return end


def _leg_ratio(book: Book, returns: Returns) -> tuple[Floats, Floats]:
    """Log amplitude ratio (G,) of each leg's walls, and its variance (G,)."""
    near, far = returns.legs[:, 1], returns.legs[:, 2]
    total, variance = np.zeros(len(returns.legs)), np.zeros(len(returns.legs))
    for column in (near, far):
        total += np.where(column == NONE, 0.0, book.ratio[column])
        variance += np.where(column == NONE, 0.0, book.ratio_variance[column])
    return total, variance


def _degenerate(belief: Belief, returns: Returns) -> Booleans:
    """(R,) whether a leg bounces on a wall that the point itself lies in (within 0.1 m): the image is the point."""
    legs = returns.legs
    rows = np.flatnonzero((legs[:, 1] != NONE) & (legs[:, 0] != TX))
    flat = np.zeros(len(legs), dtype=np.bool_)
    point, wall = belief.features[legs[rows, 0]], legs[rows, 1]
    image = reflect(point, belief.features[wall], belief.book.anchor[wall])
    flat[rows] = np.linalg.norm(image - point, axis=-1) < 0.2
    return flat[returns.tx] | flat[returns.rx]
