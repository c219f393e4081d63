"""Candidates as rows of a table: which far end, which device, which wall sequence."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers


class Rows(NamedTuple):
    """N candidates or legs, as indices into tables of far ends, devices and sequences, (N,) each."""

    far: Integers
    device: Integers
    sequence: Integers

    def only(self, keep: Integers | slice) -> "Rows":
        """The rows chosen."""
        return Rows(self.far[keep], self.device[keep], self.sequence[keep])


class Found(NamedTuple):
    """N legs that the tracer confirmed, in float32 precision."""

    rows: Rows
    vertices: Floats
    """(N, D, 3) [m] bounce points from device to far end, zero beyond the last."""
    length: Floats
    """(N,) [m]."""
    coefficient: Complexes
    """(N,) field without spreading loss and carrier phase: the product of the reflections."""

    def only(self, keep: Integers) -> "Found":
        """The legs chosen."""
        return Found(self.rows.only(keep), self.vertices[keep], self.length[keep], self.coefficient[keep])


def in_blocks(parts: Iterable[Rows], size: int) -> Iterator[Rows]:
    """The same rows in blocks of `size`, the last one shorter."""
    waiting: list[Rows] = []
    for part in parts:
        waiting.append(part)
        while (count := sum(len(rows.far) for rows in waiting)) >= size:
            joined = _joined(waiting)
            yield joined.only(slice(0, size))
            waiting = [joined.only(slice(size, count))]
    if waiting:
        yield _joined(waiting)


def joined(parts: list[Found]) -> Found:
    """All legs together."""
    columns = list(zip(*parts, strict=True))
    return Found(_joined(list(columns[0])), *(np.concatenate(column) for column in columns[1:]))


def _joined(parts: list[Rows]) -> Rows:
    return Rows(*(np.concatenate(column) for column in zip(*parts, strict=True)))
