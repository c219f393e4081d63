"""The result of a scheme: the records of its cycles stacked as arrays over all cycles."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import NOTHING, RisCode, SchemeResult
from rislam_rt.pipeline.cycle import Cycle
from rislam_rt.pipeline.recordings.inputs import RecordedInputs
from rislam_rt.storage.netcdf import padded


def gather(scheme: str, time: Floats, cycles: Sequence[Cycle], levels: int, given: RecordedInputs) -> SchemeResult:
    """Stack the records of a scheme's cycles at `time` (K,) [s] as one result, landmarks in columns by number."""
    estimates = [cycle.estimate for cycle in cycles]
    maps = [estimate.map for estimate in estimates]
    ident = np.unique(np.concatenate([m.ident for m in maps]))
    parent = np.full(len(ident), -1)
    held = np.zeros((len(cycles), len(ident)), dtype=np.bool_)
    landmark = np.zeros((len(cycles), len(ident), 3))
    ris_probability = np.zeros((len(cycles), len(ident)))
    several = any(m.panel is not None for m in maps)
    panel = np.zeros(held.shape, dtype=np.int64) if several else None
    for row, m in enumerate(maps):
        column = np.searchsorted(ident, m.ident)
        held[row, column], landmark[row, column] = True, m.position
        image = np.flatnonzero(m.parent >= 0)
        parent[column[image]] = m.ident[m.parent[image]]
        ris_probability[row, column] = m.ris_probability
        if panel is not None and m.panel is not None:  # an empty map has none
            panel[row, column] = m.panel
    return SchemeResult(
        scheme=scheme,
        time=time,
        position=np.array([estimate.position for estimate in estimates]),
        velocity=np.array([estimate.velocity for estimate in estimates]),
        heading=np.array([estimate.heading for estimate in estimates]),
        covariance=np.array([estimate.covariance for estimate in estimates]),
        sent=_codes([cycle.sent for cycle in cycles]),
        applied=_codes([cycle.applied for cycle in cycles]),
        levels=levels,
        gain=np.array([cycle.gain for cycle in cycles]),
        component_path=padded([cycle.truth.path for cycle in cycles], NOTHING, np.int64),
        component_landmark=padded([cycle.info.landmark for cycle in cycles], NOTHING, np.int64),
        ident=ident,
        parent=parent,
        held=held,
        landmark_position=landmark,
        ris_probability=ris_probability,
        seconds=np.array([cycle.seconds for cycle in cycles]),
        info=_diagnostics([cycle.info for cycle in cycles]),
        outcome=tuple(str(cycle.info.outcome) for cycle in cycles),
        map=maps[-1],
        panel=panel,
        given=given,
    )


def _codes(codes: Sequence[RisCode | None]) -> Integers:
    """Phase levels (K, N, M) of one code a cycle; (K, 0, 0) without a RIS panel."""
    if any(code is None for code in codes):
        return np.zeros((len(codes), 0, 0), dtype=np.int64)
    return np.array([code.index for code in codes if code is not None], dtype=np.int64)


def _diagnostics(infos: Sequence[Any]) -> dict[str, Any]:
    """Filter diagnostics of all cycles, (K,) each: the fields of `infos` that are scalar numbers, by name."""
    names = [name for name, value in infos[0]._asdict().items() if isinstance(value, bool | int | float | np.number)]
    return {name: np.array([float(getattr(info, name)) for info in infos]) for name in names}
