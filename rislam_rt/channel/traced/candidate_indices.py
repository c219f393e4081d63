"""Candidates as rows of a table: which far end, which device, which wall sequence."""

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
        """Candidate indices of the rows chosen."""
        return CandidateIndices(self.far[keep], self.device[keep], self.sequence[keep])


def in_blocks(parts: Iterable[CandidateIndices], size: int) -> Iterator[CandidateIndices]:
    """Candidate indices in blocks of `size`, the last one shorter."""
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
    """Candidate indices of several parts, one after the other."""
    return CandidateIndices(*(np.concatenate(column) for column in zip(*parts, strict=True)))
