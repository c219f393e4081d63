"""Probability that a component came over a panel, from the sum and the differences of alternated codes.

A component in the difference of the codes came over the panel, or is what motion within the slot left there of a path
that another capture (the sum, another panel's difference) shows at the same place. The second kind has the source's
complex amplitude times a factor that its Doppler shift sets, within the speed that the receiver assumes; the first
has any. The captures change their roles for components in the sum.
"""

from functools import lru_cache

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers, take_rows
from rislam_rt.measurement.components import ReportedComponents
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.slot_motion import code_signs, slot_mean
from rislam_rt.model import RadioConfig

DENSITY = 0.5
"""Expected number of panel paths in a wall return's resolution cell, and the reverse: panels hang on walls, whose
returns come in beside theirs."""
DYNAMIC_RANGE = np.log(1e3)
"""Range of the log amplitude over which a path's prior is uniform: 60 dB."""
SHIFTS = 33
"""Number of Doppler shifts, evenly up to the largest, over which the likelihood of a leak is averaged."""
MIXTURE = 0.3
"""Relative error of a leak's factor: unresolved paths have not one Doppler shift."""
BLUR = 0.1
"""Standard deviation [cells] of a leak's delay and cosines about its source's, for the same reason."""
NOWHERE = 1e-25
"""Density per cell below which a component is not another's leak: at any SNR that leaves its odds far below
`SUREST`."""
SUREST = 1e-6
"""Least distance of the probability from 0 and 1: the model has its own errors."""


def panel_probability(
    found: ReportedComponents, radio: RadioConfig, config: ReceiverConfig
) -> tuple[Floats, Integers | None]:
    """Probability (N,) that each component, if a path made it, came over a panel, and the likeliest panel (N,).

    Where there is one panel the second is None.
    """
    over = np.zeros((len(found.gain), config.num_captures))
    for own in range(config.num_captures):
        here = found.capture == own
        odds = np.zeros((np.count_nonzero(here), config.num_captures))
        for other in range(config.num_captures):
            if other != own:
                factors = leak_factors(radio, config, own, other)
                sources = take_rows(found, found.capture == other)
                leak = _leak_odds(take_rows(found, here), sources, factors, radio)
                odds[:, other] = np.minimum(leak, 1e300)  # a sum of them stays finite
        total = odds.sum(axis=1)
        certain = 1.0 / (1.0 + total)
        over[here] = (1.0 - certain)[:, None] * odds / np.where(total > 0.0, total, 1.0)[:, None]
        over[here, own] = certain
    probability = np.clip(over[:, 1:].max(axis=1), SUREST, 1.0 - SUREST)
    return probability, np.argmax(over[:, 1:], axis=1) if config.panels > 1 else None


@lru_cache(maxsize=64)
def leak_factors(radio: RadioConfig, config: ReceiverConfig, into: int = 1, of: int = 0) -> Complexes:
    """Amplitude ratios (`SHIFTS`,) at which moving paths leak from capture `of` into capture `into`, for the panel's
    probability.

    Both ends ride on the agent, so that a path shortens by twice its speed at most.
    """
    shift = np.linspace(-1.0, 1.0, SHIFTS) * 2.0 * config.top_speed / radio.wavelength
    signs = code_signs(config.order, config.panels)
    factors = np.asarray(slot_mean(shift, signs[into] * signs[of], config) / slot_mean(shift, signs[0], config))
    factors.flags.writeable = False
    return factors


def _leak_odds(
    found: ReportedComponents, sources: ReportedComponents, factors: Complexes, radio: RadioConfig
) -> Floats:
    """Odds (N,) of each component for being the leak of another capture's source, against a path of its own, for the
    panel's probability."""
    array = radio.array
    cell = np.array([1.0 / radio.bandwidth, *(1.0 / (n * array.spacing) for n in (array.rows, array.cols))])
    gap = found.points[:, None] - sources.points
    variance = found.deviation[:, None] ** 2 + sources.deviation**2 + (BLUR * cell) ** 2
    place = np.prod(np.exp(-0.5 * gap**2 / variance) / np.sqrt(2.0 * np.pi * variance) * cell, axis=-1)
    row, source = np.nonzero(place > NOWHERE)
    expected = sources.gain[:, None] * factors
    spacing = np.abs(np.gradient(expected, axis=1))
    width = (MIXTURE * np.abs(expected)) ** 2 + spacing**2 / 6.0
    spread = found.gain_std[row, None] ** 2 + width[source]
    miss = np.abs(found.gain[row, None] - expected[source]) ** 2
    leak = np.mean(np.exp(-miss / spread) / (np.pi * spread), axis=-1)
    own = DENSITY / (2.0 * np.pi * DYNAMIC_RANGE * np.abs(found.gain) ** 2)
    return np.bincount(row, place[row, source] * leak, minlength=len(place)) / own
