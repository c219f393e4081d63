"""With what probability a component came over the panel, from what the receiver sees of it alone.

What is found in the difference of the codes came over the panel, or is what motion within the slot left there of a path
that the sum shows at the same place. The second kind has the source's complex amplitude times a factor that its Doppler
shift sets, within the speed that the receiver reckons with; the first has any. Sum and difference change their roles
for what is found in the sum.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.slot import slot_weights
from rislam_rt.model import RadioConfig

DENSITY = 0.5
"""Paths of either kind to be expected in one resolution cell next to a path of the other: panels hang on walls, whose
returns come in beside theirs."""
DYNAMIC_RANGE = np.log(1e3)
"""e-folds of amplitude over which a path may lie anywhere, 60 dB."""
SHIFTS = 33
"""Doppler shifts, evenly up to the largest, over which a leak is averaged."""
MIXTURE = 0.3
"""Relative error of a leak's factor: paths that came out as one have not one Doppler shift."""
BLUR = 0.1
"""Standard deviation of a leak's place about its source's [cells], likewise."""
SUREST = 1e-6
"""No probability is nearer to 0 or 1: the model has its own errors."""


class Found(NamedTuple):
    """N components."""

    points: Floats
    """(N, 3) delay [s] and cosines."""
    deviation: Floats
    """(N, 3)."""
    gain: Complexes
    """(N,)."""
    gain_std: Floats
    """(N,) of the complex gain."""
    in_difference: Booleans
    """(N,)."""


def panel_probability(found: Found, radio: RadioConfig, config: ReceiverConfig) -> Floats:
    """(N,) probability that each component, if a path made it, ran over the panel."""
    probability = np.full(len(found.gain), np.nan)
    factors = leak_factors(radio, config)
    for side in (True, False):
        here, there = found.in_difference == side, found.in_difference != side
        own = 1.0 / (1.0 + _leak_odds(_pick(found, here), _pick(found, there), factors, radio))
        probability[here] = own if side else 1.0 - own
    return np.clip(probability, SUREST, 1.0 - SUREST)


def leak_factors(radio: RadioConfig, config: ReceiverConfig) -> Complexes:
    """(`SHIFTS`,) amplitude of what a path leaves in the other capture over what it has in its own, over its shifts.

    Both ends ride on the agent, so that a path shortens by twice its speed at most.
    """
    shift = np.linspace(-1.0, 1.0, SHIFTS) * 2.0 * config.top_speed / radio.wavelength
    plain, signed = slot_weights(shift, config)
    return np.asarray(signed / plain)


def _leak_odds(found: Found, sources: Found, factors: Complexes, radio: RadioConfig) -> Floats:
    """(A,) odds of each component for being a leak of one of the sources, against a path of its own kind."""
    cell = np.array([1.0 / radio.bandwidth, *(1.0 / (n * radio.array.spacing) for n in _shape(radio))])
    gap = found.points[:, None] - sources.points
    variance = found.deviation[:, None] ** 2 + sources.deviation**2 + (BLUR * cell) ** 2
    place = np.prod(np.exp(-0.5 * gap**2 / variance) / np.sqrt(2.0 * np.pi * variance) * cell, axis=-1)
    expected = sources.gain[:, None] * factors
    spacing = np.abs(np.gradient(expected, axis=1))
    spread = found.gain_std[:, None, None] ** 2 + (MIXTURE * np.abs(expected)) ** 2 + spacing**2 / 6.0
    miss = np.abs(found.gain[:, None, None] - expected) ** 2
    leak = np.mean(np.exp(-miss / spread) / (np.pi * spread), axis=-1)
    own = DENSITY / (2.0 * np.pi * DYNAMIC_RANGE * np.abs(found.gain) ** 2)
    return np.asarray(np.sum(place * leak, axis=1) / own)


def _shape(radio: RadioConfig) -> tuple[int, int]:
    return radio.array.rows, radio.array.cols


def _pick(found: Found, rows: Booleans) -> Found:
    return Found._make(field[rows] for field in found)
