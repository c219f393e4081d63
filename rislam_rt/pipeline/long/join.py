"""Joining the slices of a long run: path and landmark columns by identity, cycles one after the other."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rislam_rt.arrays import Integers
from rislam_rt.model import NOTHING, Paths, SchemeResult

Identity = tuple[int, int, tuple[int, ...], tuple[int, ...]]
"""Identity of a path: kind, landmark, walls on the Tx leg, walls on the Rx leg."""


def join_paths(parts: Sequence[Paths]) -> Paths:
    """Join the true paths of consecutive slices of a long run; a path that a slice lacks is not valid there."""
    columns = path_columns(parts)
    count = max((int(c.max(initial=-1)) for c in columns), default=-1) + 1
    first: dict[str, Any] = {}
    for name, empty in (("kind", -1), ("landmark", -1), ("num_vertices", 0)):
        first[name] = np.full(count, empty)
    for name in ("tx_walls", "rx_walls"):
        first[name] = np.full((count, max(getattr(p, name).shape[1] for p in parts)), -1)
    for part, column in zip(parts, columns, strict=True):
        for name, value in first.items():
            own = getattr(part, name)
            value[(column, *(slice(0, int(n)) for n in own.shape[1:]))] = own
    names = ("valid", "tau", "departure", "arrival", "gain", "vertices")
    course = {name: _spread([getattr(p, name) for p in parts], columns, count) for name in names}
    return replace(parts[0], **first, **course, ris=None)


def join_schemes(parts: Sequence[SchemeResult], paths: Sequence[Paths]) -> SchemeResult:
    """Join the results of one scheme over consecutive slices, gains in columns by path identity as in `paths`."""
    columns = path_columns(paths)
    count = max((int(c.max(initial=-1)) for c in columns), default=-1) + 1
    ident = np.unique(np.concatenate([part.ident for part in parts]))
    places = [np.searchsorted(ident, part.ident) for part in parts]
    parent = np.full(len(ident), -1)
    for part, place in zip(parts, places, strict=True):
        parent[place] = np.where(part.parent >= 0, part.parent, parent[place])
    plain = ("time", "position", "velocity", "heading", "covariance", "sent", "applied", "seconds")
    held = ["held", "landmark_position", "ris_probability"]
    if any(part.panel is not None for part in parts):
        parts = [replace(p, panel=np.zeros(p.held.shape, int)) if p.panel is None else p for p in parts]
        held.append("panel")
    course: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in plain}
    course |= {name: _spread([getattr(part, name) for part in parts], places, len(ident)) for name in held}
    return replace(
        parts[-1],
        **course,
        gain=_spread([part.gain for part in parts], columns, count),
        component_path=_stacked([_renamed(p.component_path, c) for p, c in zip(parts, columns, strict=True)]),
        component_landmark=_stacked([part.component_landmark for part in parts]),
        ident=ident,
        parent=parent,
        info={name: np.concatenate([part.info[name] for part in parts]) for name in parts[0].info},
        outcome=tuple(outcome for part in parts for outcome in part.outcome),
        smoothed=None,  # a part looks no further back than its own beginning
        given=None,
    )


def subsampled_paths(paths: Paths, rows: Integers) -> Paths:
    """Paths of the cycles in `rows` alone."""
    names = ("valid", "tau", "departure", "arrival", "gain", "vertices")
    return replace(paths, **{name: getattr(paths, name)[rows] for name in names}, ris=None)


def subsampled_scheme(scheme: SchemeResult, rows: Integers) -> SchemeResult:
    """Result of a scheme for the cycles in `rows` alone."""
    names = ("time", "position", "velocity", "heading", "covariance", "sent", "applied", "gain", "component_path",
             "component_landmark", "held", "landmark_position", "ris_probability", "seconds", "panel")  # fmt: skip
    return replace(
        scheme,
        **{name: getattr(scheme, name)[rows] for name in names if getattr(scheme, name) is not None},
        info={name: values[rows] for name, values in scheme.info.items()},
        smoothed=None if scheme.smoothed is None else scheme.smoothed[rows],
        outcome=tuple(scheme.outcome[row] for row in rows),
        given=None,
    )


def path_columns(parts: Sequence[Paths]) -> list[Integers]:
    """For each slice of a long run, the joined column (P,) of each of its paths, by order of first appearance."""
    numbers: dict[Identity, int] = {}
    return [
        np.array([numbers.setdefault(p.identity(i), len(numbers)) for i in range(p.num_paths)], dtype=np.int64)
        for p in parts
    ]


def _spread(parts: Sequence[Any], columns: Sequence[Integers], count: int) -> Any:
    """Array (K, count, ...) of arrays (K_i, P_i, ...) under each other, each at its `columns`; zero elsewhere."""
    tail = tuple(max(sizes) for sizes in zip(*(part.shape[2:] for part in parts), strict=True))
    table = np.zeros((sum(map(len, parts)), count, *tail), dtype=parts[0].dtype)
    row = 0
    for part, column in zip(parts, columns, strict=True):
        block = np.zeros((len(part), count, *tail), dtype=part.dtype)
        where: Any = (slice(None), column, *(slice(0, n) for n in part.shape[2:]))
        block[where] = part
        table[row : row + len(part)] = block
        row += len(part)
    return table


def _renamed(path: Integers, column: Integers) -> Integers:
    """Path numbers of a slice's components as numbers of the joined paths; negative ones (clutter, none) stay."""
    return np.where(path >= 0, column[np.maximum(path, 0)] if len(column) else path, path)


def _stacked(parts: Sequence[Integers]) -> Integers:
    """Arrays of different width under each other, rows filled up with `NOTHING`."""
    width = max(part.shape[1] for part in parts)
    return np.concatenate([np.pad(p, ((0, 0), (0, width - p.shape[1])), constant_values=NOTHING) for p in parts])
