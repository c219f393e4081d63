"""RIS codes under which the adviser forecasts detection: aimed at the agent, swept in search of it, and random."""

import numpy as np

from rislam_rt.arrays import Integers
from rislam_rt.design import exact_code
from rislam_rt.design.beam_sweep import sweep_codes
from rislam_rt.measurement.received_paths import HORIZON_MARGIN
from rislam_rt.model import Paths, RadioConfig, RisCode
from rislam_rt.model.ris import DataSheet, join_codes
from rislam_rt.ris import rephase

RANDOM_CODES = 16
"""Number of random RIS codes over which detection is averaged: a share of one half is known to an eighth."""


def codes_of(paths: Paths, spec: DataSheet, radio: RadioConfig, *, rng: np.random.Generator) -> dict[str, Integers]:
    """RIS codes to forecast detection with, at K cycles of a room's paths, by kind: phase levels (C, K, N, M) of C
    codes that are equally likely. `aimed`, for each panel the best code for its strongest path; `swept`, the beams of
    the search for a panel that is not known yet, in turn, all panels at once; `random`."""
    count = paths.num_cycles
    beams = [sweep_codes(panel, radio.wavelength) for panel in spec.panels]
    turns = np.arange(max(map(len, beams)))
    swept = join_codes(tuple(RisCode(sweep[turns % len(sweep)], spec.levels) for sweep in beams)).index
    chance = rng.integers(spec.levels, size=(RANDOM_CODES, count, spec.rows, spec.cols))
    return {
        "aimed": aimed_codes(paths, spec, radio)[None],
        "swept": np.broadcast_to(swept[:, None], (len(swept), count, spec.rows, spec.cols)),
        "random": chance,
    }


def aimed_codes(paths: Paths, spec: DataSheet, radio: RadioConfig) -> Integers:
    """RIS codes (K, N, M) for the forecast: each panel's best for its strongest path that the array receives."""
    assert paths.ris is not None
    index = np.zeros((paths.num_cycles, spec.num_elements), dtype=np.int64)
    best = np.zeros((len(spec.panels), paths.num_cycles))
    heard = paths.valid & radio.array.receives(paths.arrival[..., 2], HORIZON_MARGIN)
    for path in np.flatnonzero(paths.ris.tx_leg >= 0):
        panel = int(paths.panel[path])
        own = spec.span(panel)
        response = paths.ris.tx[:, paths.ris.tx_leg[path]] * paths.ris.rx[:, paths.ris.rx_leg[path]]
        levels, gain = exact_code(response.reshape(len(response), -1)[:, own], spec.levels)
        better = heard[:, path] & (gain > best[panel])
        best[panel, better], index[better, own] = gain[better], levels[better]
    return index.reshape(-1, spec.rows, spec.cols)


def aimed_paths(paths: Paths, spec: DataSheet, radio: RadioConfig) -> Paths:
    """Propagation paths of a room with their gains under RIS codes aimed at the agent."""
    return rephase(paths, RisCode(aimed_codes(paths, spec, radio), spec.levels))
