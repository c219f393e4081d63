"""What becomes of a path while the agent moves within the measurement slot.

The codes take turns over the slot, and a path of Doppler shift f turns by `2 pi f t` meanwhile. What all codes hear in
common goes to the sum, what changes its sign with the code to the difference; a path that turns goes into both. The
order A-B-B-A cancels the first order of it.
"""

import numpy as np

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.received import Received

SIGNS = {"AB": np.array([1.0, -1.0]), "ABBA": np.array([1.0, -1.0, -1.0, 1.0])}
"""Sign of the panel's paths in turn, by `ReceiverConfig.order`."""


def slot_weights(doppler: Floats, config: ReceiverConfig) -> tuple[Complexes, Complexes]:
    """Mean over the slot (N,), plain and with the sign of the code, of paths of Doppler shifts (N,) [Hz].

    Every code is held for the same time, the order repeated until the slot is full; phases are those at its middle.
    Without alternation the second is zero.
    """
    if not config.alternation:
        return np.sinc(doppler * config.slot).astype(np.complex128), np.zeros(len(doppler), dtype=np.complex128)
    signs = SIGNS[config.order]
    block = config.code_dwell * len(signs) if config.code_dwell else config.slot
    dwell = block / len(signs)
    middle = (np.arange(len(signs)) - (len(signs) - 1) / 2.0) * dwell
    turning = np.exp(2j * np.pi * np.multiply.outer(doppler, middle)) * np.sinc(doppler * dwell)[:, None]
    repeats = max(round(config.slot / block), 1)
    # the mean of the blocks' phases, a geometric sum
    common = np.sinc(doppler * block * repeats) / np.sinc(doppler * block)
    return common * turning.mean(axis=1), common * (turning @ signs) / len(signs)


def split(received: Received, config: ReceiverConfig) -> list[Received]:
    """The paths as they are in the sum of the codes, and with alternation in the difference, gains over the slot."""
    plain, signed = slot_weights(received.doppler, config)
    if not config.alternation:
        return [received._replace(gain=received.gain * plain)]
    panel = received.from_panel
    return [
        received._replace(gain=received.gain * np.where(panel, signed, plain)),
        received._replace(gain=received.gain * np.where(panel, plain, signed)),
    ]
