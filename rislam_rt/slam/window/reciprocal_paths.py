"""Reciprocal paths: what goes over two things is heard both ways round, and leaves as its reciprocal arrives."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, distinct_rows
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.measurement_log import ArrayEnds, Log

BETWEEN = 4
"""How far apart reciprocal paths' components are looked for, in the order of lengths of a cycle."""


class PathDirections(NamedTuple):
    """Components of T tracks or paths, once for each pair of directions in which their paths may arrive and leave: E
    pairs, N components in all."""

    row: Integers
    """(N,) row of each component in the log."""
    which: Integers
    """(N,) pair of directions that it belongs to."""
    cosines: Floats
    """(N, 2) direction cosines of its arrival."""
    std: Floats
    """(N, 2) their standard deviations."""
    owner: Integers
    """(E,) track or path of each pair of directions: 0 to T - 1, and the further pairs of some."""
    legs: Integers
    """(E, 2) of which pairs the arrivals are each one's arrival and departure: its own twice, where the path comes back
    the way that it went, else its own and that of the reciprocal path."""


def with_reciprocal(log: Log, ends: ArrayEnds, apart: Floats) -> PathDirections:
    """Components of tracks or paths by their directions (see `Log.both_ends`), those of reciprocal ones once more.

    Most paths come back to the agent the way that they went: over one thing, or over two walls at right angles. Over
    two others there are two paths, one each way round, and each arrives by the direction in which the other leaves.
    They are as loud, and as long but for `(a - b) d`, where a and b are the directions of arrival and d (3,) [m] leads
    from Rx to Tx (`apart`), in the body's axes.
    """
    count = len(ends.owner)
    back = PathDirections(*ends, np.repeat(np.arange(count)[:, None], 2, axis=1))
    pairs = _reciprocal(log, ends, apart)
    if not len(pairs):
        return back
    pair, member = (ends.which == pairs[:, :1]).nonzero()
    return PathDirections(
        np.append(ends.row, ends.row[member]), np.append(ends.which, count + pair),
        np.concatenate([ends.cosines, ends.cosines[member]]), np.concatenate([ends.std, ends.std[member]]),
        np.append(ends.owner, ends.owner[pairs[:, 0]]), np.concatenate([back.legs, pairs]),
    )  # fmt: skip


def spread_by_legs(variance: Floats, legs: Integers) -> Floats:
    """Variances (E,) of sums of directions of arrival and departure, from those (E,) of single directions, by the pairs
    (E, 2) of which they are: a path that comes back as it went errs by twice the same."""
    return np.asarray(np.where(legs[:, 0] == legs[:, 1], 2.0, 1.0) * variance[legs].sum(axis=1))


def _reciprocal(log: Log, ends: ArrayEnds, apart: Floats) -> Integers:
    """Pairs (P, 2) of tracks that are alike in most cycles as reciprocal paths are, either way round."""
    up = np.sqrt(np.maximum(1.0 - np.vecdot(ends.cosines, ends.cosines), 0.0))
    length = log.seen[ends.row, 0] - ends.cosines @ apart[:2] - up * apart[2]
    variance = log.std[ends.row, 0] ** 2 + ends.std**2 @ apart[:2] ** 2
    loud, cycle = log.log_amplitude[ends.row], log.cycle[ends.row]

    def alike(one: Integers, two: Integers) -> Booleans:
        fits = (length[two] - length[one]) ** 2 < CONSTANTS.against * (variance[one] + variance[two])
        fits &= np.abs(loud[two] - loud[one]) < CONSTANTS.fit * CONSTANTS.fading
        fits &= ends.owner[ends.which[one]] != ends.owner[ends.which[two]]
        return np.asarray(fits & (cycle[one] == cycle[two]))

    order = np.lexsort((length, cycle))
    near = [np.stack([order[:-step], order[step:]]) for step in range(1, 1 + BETWEEN)]
    found = np.concatenate([ends.which[both[:, alike(*both)]].T for both in near])
    pairs = np.sort(found, axis=1)
    first, _, times = distinct_rows(pairs)
    pairs = pairs[first]
    most = np.bincount(ends.which, minlength=len(ends.owner))[pairs].max(axis=1)
    pairs = pairs[2 * times > most]
    return np.concatenate([pairs, pairs[:, ::-1]])
