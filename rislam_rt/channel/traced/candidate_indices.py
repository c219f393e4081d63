"""Candidates as rows of a table: which far end, which device, which wall sequence."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Integers


class Rows(NamedTuple):
    """N candidates or legs, as indices into tables of far ends, devices and sequences, (N,) each."""

    far: Integers
    device: Integers
    sequence: Integers

    def only(self, keep: Integers | slice) -> "Rows":
        """The rows chosen."""
        return Rows(self.far[keep], self.device[keep], self.sequence[keep])


def in_blocks(parts: Iterable[Rows], size: int) -> Iterator[Rows]:
    """The same rows in blocks of `size`, the last one shorter."""
    waiting: list[Rows] = []
    for part in parts:
        waiting.append(part)
        while (count := sum(len(rows.far) for rows in waiting)) >= size:
            together = join_rows(waiting)
            yield together.only(slice(0, size))
            waiting = [together.only(slice(size, count))]
    if waiting:
        yield join_rows(waiting)


def join_rows(parts: list[Rows]) -> Rows:
    """All rows, one part after the other."""
    return Rows(*(np.concatenate(column) for column in zip(*parts, strict=True)))
