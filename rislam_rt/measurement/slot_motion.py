"""Motion within the measurement slot: how Doppler shifts weigh paths in the sum and differences of alternated codes.

The codes take turns over the slot, and a path of Doppler shift f turns by `2 pi f t` meanwhile. What is the same under
all codes goes to the sum, what changes its sign with a panel's code to that panel's difference; a path that turns goes
into all of them. The order A-B-B-A cancels the first order of it.
"""

from functools import lru_cache

import numpy as np
import scipy

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.received_paths import Received


@lru_cache(maxsize=64)
def code_signs(order: str, panels: int) -> Floats:
    """Signs (1 + panels, S) over the S codes of a slot, of paths that meet no panel and of each panel's paths.

    Rows of a Hadamard matrix, so that the sum over the codes with the signs of one panel holds its paths alone. `ABBA`
    goes through them and back: products of such rows are even about the middle as well, so that what moves evenly
    leaks to first order neither from the walls to a panel nor from panel to panel.
    """
    rows = codes_in_turn(panels)[: 1 + panels]
    signs = np.concatenate([rows, rows[:, ::-1]], axis=1) if order == "ABBA" else rows
    signs.flags.writeable = False
    return signs


@lru_cache(maxsize=64)
def codes_in_turn(panels: int) -> Floats:
    """Hadamard matrix (C, C) of the signs of the codes in a slot, against motion within it: two codes for one
    panel, four for two."""
    signs = scipy.linalg.hadamard(2 ** int(np.ceil(np.log2(1 + panels)))).astype(np.float64)
    signs.flags.writeable = False
    return signs


def slot_mean(doppler: Floats, signs: Floats, config: ReceiverConfig) -> Complexes:
    """Mean phase factor (N,) over the slot of paths of Doppler shifts (N,) [Hz], with a sign for each code (S,).

    Every code is held for the same time, the order repeated until the slot is full; phases are those at its middle.
    """
    block = config.code_dwell * len(signs) if config.code_dwell else config.slot
    dwell = block / len(signs)
    middle = (np.arange(len(signs)) - (len(signs) - 1) / 2.0) * dwell
    turning = np.exp(2j * np.pi * np.multiply.outer(doppler, middle)) * np.sinc(doppler * dwell)[:, None]
    repeats = max(round(config.slot / block), 1)
    # the mean of the blocks' phases, a geometric sum
    common = np.sinc(doppler * block * repeats) / np.sinc(doppler * block)
    mean = turning.mean(axis=1) if (signs > 0.0).all() else (turning @ signs) / len(signs)
    return np.asarray(common * mean)


def slot_weights(doppler: Floats, config: ReceiverConfig) -> tuple[Complexes, ...]:
    """Weights (N,) of paths of Doppler shifts (N,) [Hz] in the sum of a slot's codes and in each panel's difference.

    Without alternation the mean over the slot, and zero.
    """
    if not config.alternation:
        return np.sinc(doppler * config.slot).astype(np.complex128), np.zeros(len(doppler), dtype=np.complex128)
    return tuple(slot_mean(doppler, signs, config) for signs in code_signs(config.order, config.panels))


def split_by_code(received: Received, config: ReceiverConfig) -> list[Received]:
    """Received paths with their gains in the sum of a slot's codes and, with alternation, in panels' differences."""
    if not config.alternation:
        return [received._replace(gain=received.gain * slot_weights(received.doppler, config)[0])]
    signs = code_signs(config.order, config.panels)
    kind = np.minimum(received.panel, config.panels - 1) + 1
    captures, means = [], dict[bytes, Complexes]()  # products of rows are few: the sum's and a panel's own are the same
    for own in signs:
        weight = np.zeros(len(kind), dtype=np.complex128)
        for number in np.unique(kind):
            product = own * signs[number]
            name = product.tobytes()
            if name not in means:
                means[name] = slot_mean(received.doppler, product, config)
            weight = np.where(kind == number, means[name], weight)
        captures.append(received._replace(gain=received.gain * weight))
    return captures
