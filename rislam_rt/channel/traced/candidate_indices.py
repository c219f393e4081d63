"""Candidates for legs as indices: which far end, which device, which wall sequence."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Integers


class CandidateIndices(NamedTuple):
    """N candidates or legs, as indices into tables of far ends, devices and sequences, (N,) each."""

    far: Integers
    device: Integers
    sequence: Integers

    def only(self, keep: Integers | slice) -> "CandidateIndices":
        """Select candidates by row."""
        return CandidateIndices(self.far[keep], self.device[keep], self.sequence[keep])


def in_blocks(parts: Iterable[CandidateIndices], size: int) -> Iterator[CandidateIndices]:
    """Yield candidates regrouped into blocks of `size` rows, the last one shorter."""
    waiting: list[CandidateIndices] = []
    for part in parts:
        waiting.append(part)
        while (count := sum(len(rows.far) for rows in waiting)) >= size:
            together = join_indices(waiting)
            yield together.only(slice(0, size))
            waiting = [together.only(slice(size, count))]
    if waiting:
        yield join_indices(waiting)


def join_indices(parts: list[CandidateIndices]) -> CandidateIndices:
    """Concatenate candidates of several parts."""
    return CandidateIndices(*(np.concatenate(column) for column in zip(*parts, strict=True)))
