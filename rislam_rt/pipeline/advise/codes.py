"""The codes that a panel is judged under: aimed at the agent, swept in search of it, and random."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Integers
from rislam_rt.design import exact_code
from rislam_rt.design.search import sweep_codes
from rislam_rt.measurement.received import HORIZON_MARGIN
from rislam_rt.model import Paths, RadioConfig, RisCode, RisSpec
from rislam_rt.ris import rephase

RANDOM_CODES = 16
"""Random codes over which hearing is averaged: a share of one half is known to an eighth, at each place anew."""


class Codes(NamedTuple):
    """C codes a place, all worth the same."""

    name: str
    levels: Integers
    """(C, K, N, M)."""


def codes_of(paths: Paths, spec: RisSpec, radio: RadioConfig, *, rng: np.random.Generator) -> list[Codes]:
    """`aimed`: the best code for the strongest panel path at each of the K places; `swept`: the beams of the search
    for a panel that is not known yet, in turn; `random`."""
    count = paths.num_cycles
    beams = sweep_codes(spec, radio.wavelength)
    swept = np.broadcast_to(beams[:, None], (len(beams), count, spec.rows, spec.cols))
    chance = rng.integers(spec.levels, size=(RANDOM_CODES, count, spec.rows, spec.cols))
    return [Codes("aimed", aimed_codes(paths, spec, radio)[None]), Codes("swept", swept), Codes("random", chance)]


def aimed_codes(paths: Paths, spec: RisSpec, radio: RadioConfig) -> Integers:
    """(K, N, M) levels for the panel path, of those that the array hears, that can be made strongest; zero without."""
    assert paths.ris is not None
    best, index = np.zeros(paths.num_cycles), np.zeros((paths.num_cycles, spec.rows, spec.cols), dtype=np.int64)
    heard = paths.valid
    if radio.array.pattern == "upper":
        heard = heard & (paths.arrival[..., 2] >= -HORIZON_MARGIN)
    for path in np.flatnonzero(paths.ris.tx_leg >= 0):
        response = paths.ris.tx[:, paths.ris.tx_leg[path]] * paths.ris.rx[:, paths.ris.rx_leg[path]]
        levels, gain = exact_code(response.reshape(len(response), -1), spec.levels)
        better = heard[:, path] & (gain > best)
        best[better], index[better] = gain[better], levels.reshape(index.shape)[better]
    return index


def under(paths: Paths, spec: RisSpec, index: Integers) -> Paths:
    """The paths under levels (K, N, M)."""
    return rephase(paths, RisCode(index, spec.levels))
