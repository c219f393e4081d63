"""Probability that a component came over a panel, from the sum and the differences of alternated codes.

A component in the difference of the codes came over the panel, or is what motion within the slot left there of a path
that another capture (the sum, another panel's difference) shows at the same place. The second kind has the source's
complex amplitude times a factor that its Doppler shift sets, within the speed that the receiver assumes; the first
has any. The captures change their roles for components in the sum.
"""

from functools import lru_cache
from itertools import permutations

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers, take_rows
from rislam_rt.measurement.components import ReportedComponents
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.detection_threshold import detection_threshold
from rislam_rt.measurement.slot_motion import code_signs, slot_mean
from rislam_rt.model import RadioConfig

DENSITY = 0.5
"""Expected number of panel paths in a wall return's resolution cell, and the reverse: panels hang on walls, whose
returns come in beside theirs."""
DYNAMIC_RANGE = np.log(1e3)
"""Range of the log amplitude over which a path's prior is uniform: 60 dB."""
SHIFTS = 128
"""Number of Doppler shifts, evenly up to the largest, over which the likelihood of a leak is averaged."""
FINE = 1024
"""Number of them over which it is asked at how many a path stays unheard."""
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
    count = config.num_captures
    leak = np.zeros((len(found.gain), len(found.gain)))
    for own, other in permutations(range(count), 2):
        here, there = ((found.capture == each).nonzero()[0] for each in (own, other))
        factors = leak_factors(radio, config, own, other)
        odds = _leak_odds(take_rows(found, here), take_rows(found, there), factors, radio)
        leak[np.ix_(here, there)] = np.minimum(odds, 1e300)  # a sum of them stays finite
    # of two components one may be what is left of the other, but not each of the other
    alone = leak.sum(axis=1) == 0.0
    odds = (leak / (1.0 + leak.sum(axis=1))) @ (found.capture[:, None] == np.arange(count))
    for own, other in permutations(range(count), 2):
        rows = alone & (found.capture == own)
        odds[rows, other] = _unheard_odds(take_rows(found, rows), own, other, radio, config)
    certain = 1.0 / (1.0 + odds.sum(axis=1))
    over = certain[:, None] * odds
    over[np.arange(len(over)), found.capture] = certain
    probability = np.clip(over[:, 1:].max(axis=1), SUREST, 1.0 - SUREST)
    return probability, np.argmax(over[:, 1:], axis=1) if config.panels > 1 else None


@lru_cache(maxsize=64)
def leak_factors(
    radio: RadioConfig, config: ReceiverConfig, into: int = 1, of: int = 0, shifts: int = SHIFTS
) -> Complexes:
    """Amplitude ratios (`shifts`,) at which moving paths leak from capture `of` into capture `into`, for the panel's
    probability.

    Both ends ride on the agent, so that a path shortens by twice its speed at most.
    """
    shift = _shifts(shifts)[0] * 2.0 * config.top_speed / radio.wavelength
    signs = code_signs(config.order, config.panels)
    factors = np.asarray(slot_mean(shift, signs[into] * signs[of], config) / slot_mean(shift, signs[0], config))
    factors.flags.writeable = False
    return factors


@lru_cache(maxsize=4)
def _shifts(count: int) -> tuple[Floats, Floats]:
    """Doppler shifts (C,) of paths, evenly within 1 of zero, and their probabilities (C,), for the panel's probability:
    any speed up to the largest, and any direction, are alike."""
    shift = (2.0 * np.arange(count) + 1.0 - count) / count
    weight = -np.log(np.maximum(np.abs(shift), 0.5 / count))
    return shift, weight / weight.sum()


def _unheard_odds(
    found: ReportedComponents, own: int, other: int, radio: RadioConfig, config: ReceiverConfig
) -> Floats:
    """Odds (N,) of each component of capture `own`, beside which nothing is heard, for being the leak of a source of
    capture `other`, against a path of its own, for the panel's probability: a path that turns by a whole turn within
    the slot is heard in the wrong capture alone.

    The log amplitude of either is uniform beforehand, so that what counts is how likely the shifts are at which the
    other capture stays below the threshold.
    """
    likely = _shifts(FINE)[1]
    level = detection_threshold(radio, config) * found.gain_std[:, None] ** 2 / np.abs(found.gain[:, None]) ** 2
    leaks, leaves = (np.abs(leak_factors(radio, config, *pair, FINE)) ** 2 for pair in ((own, other), (other, own)))
    return np.asarray(((leaks * level > 1.0) @ likely) / np.maximum((leaves < level) @ likely, likely.min()))


def _leak_odds(
    found: ReportedComponents, sources: ReportedComponents, factors: Complexes, radio: RadioConfig
) -> Floats:
    """Odds (N, S) of each component for being the leak of each of another capture's sources, against a path of its own,
    for the panel's probability."""
    place, aliased = _place_densities(found, sources, radio)
    row, source = np.nonzero(place + aliased > NOWHERE)
    expected = sources.gain[:, None] * factors
    spacing = np.abs(np.gradient(expected, axis=1))
    width = (MIXTURE * np.abs(expected)) ** 2 + spacing**2 / 6.0
    spread = found.gain_std[row, None] ** 2 + width[source]
    leak, turned = (
        (np.exp(-(np.abs(found.gain[row, None] - sign * expected[source]) ** 2) / spread) / (np.pi * spread))
        @ _shifts(factors.shape[-1])[1]
        for sign in (1.0, -1.0)
    )
    own = DENSITY / (2.0 * np.pi * DYNAMIC_RANGE * np.abs(found.gain) ** 2)
    odds = np.zeros(place.shape)
    odds[row, source] = (place[row, source] * leak + aliased[row, source] * turned) / own[row]
    return odds


def _place_densities(
    found: ReportedComponents, sources: ReportedComponents, radio: RadioConfig
) -> tuple[Floats, Floats]:
    """Densities (N, S) per cell of the place of each component, were it the leak of each source, with the source's gain
    and with the opposite one, for the panel's probability: cosines 1 / `spacing` apart are alike to an array
    (`RxArray.mirrored_signs`), so that a path at the rim of the unit disc may be found at the opposite rim."""
    array = radio.array
    counts = np.array([1, array.rows, array.cols])
    cell = np.array([1.0 / radio.bandwidth, *(1.0 / (n * array.spacing) for n in counts[1:])])
    gap = found.points[:, None] - sources.points
    variance = found.deviation[:, None] ** 2 + sources.deviation**2 + (BLUR * cell) ** 2
    scale, period = cell / np.sqrt(2.0 * np.pi * variance), np.where(counts > 1, 1.0 / array.spacing, np.inf)
    most = int(np.ceil(2.0 * array.spacing))  # two cosines are 2 apart at most
    same, opposite = np.zeros_like(gap), np.zeros_like(gap)
    turned = np.append(1.0, array.mirrored_signs) < 0.0
    for turns in range(-most, most + 1):
        shift = turns * period if turns else np.zeros(3)
        density = scale * np.exp(-0.5 * (gap + shift) ** 2 / variance)
        odd = turned & (turns % 2 == 1)
        same += np.where(odd, 0.0, density)
        opposite += np.where(odd, density, 0.0)
    delay, u, v = np.moveaxis(same, -1, 0)
    _, other_u, other_v = np.moveaxis(opposite, -1, 0)
    return delay * (u * v + other_u * other_v), delay * (u * other_v + other_u * v)
