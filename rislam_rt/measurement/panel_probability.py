"""With what probability a component came over a panel, from what the receiver sees of it alone.

What is found in the difference of the codes came over the panel, or is what motion within the slot left there of a path
that another capture (the sum, another panel's difference) shows at the same place. The second kind has the source's
complex amplitude times a factor that its Doppler shift sets, within the speed that the receiver reckons with; the first
has any. The captures change their roles for what is found in the sum.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.slot_motion import code_signs, slot_mean
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


class ComponentSides(NamedTuple):
    """N components."""

    points: Floats
    """(N, 3) delay [s] and cosines."""
    deviation: Floats
    """(N, 3)."""
    gain: Complexes
    """(N,)."""
    gain_std: Floats
    """(N,) of the complex gain."""
    capture: Integers
    """(N,) 0 for the sum, 1 + q for the difference of panel q."""


def panel_probability(
    found: ComponentSides, radio: RadioConfig, config: ReceiverConfig
) -> tuple[Floats, Integers | None]:
    """(N,) probability that each component, if a path made it, ran over a panel, and which (N,): the likeliest.

    Where there is one panel the second is None.
    """
    over = np.zeros((len(found.gain), config.num_captures))
    for own in range(config.num_captures):
        here = found.capture == own
        odds = np.zeros((np.count_nonzero(here), config.num_captures))
        for other in range(config.num_captures):
            if other != own:
                factors = leak_factors(radio, config, own, other)
                leak = _leak_odds(_pick(found, here), _pick(found, found.capture == other), factors, radio)
                odds[:, other] = np.minimum(leak, 1e300)  # a sum of them stays finite
        total = odds.sum(axis=1)
        certain = 1.0 / (1.0 + total)
        over[here] = (1.0 - certain)[:, None] * odds / np.where(total > 0.0, total, 1.0)[:, None]
        over[here, own] = certain
    probability = np.clip(over[:, 1:].max(axis=1), SUREST, 1.0 - SUREST)
    return probability, np.argmax(over[:, 1:], axis=1) if config.panels > 1 else None


def leak_factors(radio: RadioConfig, config: ReceiverConfig, into: int = 1, of: int = 0) -> Complexes:
    """(`SHIFTS`,) how a path leaks between captures, which blurs whether a panel made it: amplitude there over that
    here.

    Both ends ride on the agent, so that a path shortens by twice its speed at most.
    """
    shift = np.linspace(-1.0, 1.0, SHIFTS) * 2.0 * config.top_speed / radio.wavelength
    signs = code_signs(config.order, config.panels)
    return np.asarray(slot_mean(shift, signs[into] * signs[of], config) / slot_mean(shift, signs[0], config))


def _leak_odds(found: ComponentSides, sources: ComponentSides, factors: Complexes, radio: RadioConfig) -> Floats:
    """(A,) odds of each component for being a leak of one of the sources and no panel's, against a path of its own
    kind."""
    array = radio.array
    cell = np.array([1.0 / radio.bandwidth, *(1.0 / (n * array.spacing) for n in (array.rows, array.cols))])
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


def _pick(found: ComponentSides, rows: Booleans) -> ComponentSides:
    return ComponentSides._make(field[rows] for field in found)
