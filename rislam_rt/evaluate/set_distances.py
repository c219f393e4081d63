"""Distances between sets of points of different sizes: GOSPA, and the assignment behind them."""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Floats, Integers
from rislam_rt.errors import ConfigError


class Gospa(NamedTuple):
    """GOSPA distance [m] (alpha = 2) and its parts, `distance^p = localisation^p + c^p / 2 (missed + false)`."""

    distance: float
    """GOSPA distance [m]."""
    localisation: float
    """Part [m] of the pairs that were matched."""
    missed: int
    """Number of true points without an estimate."""
    false: int
    """Number of estimates without a true point."""


def gospa(estimate: Floats, truth: Floats, *, cutoff: float = 1.0, order: float = 2.0) -> Gospa:
    """Generalised optimal sub-pattern assignment metric (alpha = 2) between estimates (N, D) and truth (M, D).

    Rahmathullah, Garcia-Fernandez and Svensson, FUSION 2017: not divided by the number of points, and each missed or
    false one costs `c^p / 2`, so that a pair further apart than c counts as one of each.
    """
    if not (cutoff > 0.0 and order >= 1.0):
        received = f"cutoff, order: {cutoff}, {order} received"
        raise ConfigError(f"{received}; give a positive cut-off and an order of 1 or more")
    distance = np.minimum(_pairwise(estimate, truth), cutoff)
    rows, cols = scipy.optimize.linear_sum_assignment(distance**order)
    close = distance[rows, cols] < cutoff
    local = float(np.sum(distance[rows[close], cols[close]] ** order))
    missed, false = distance.shape[1] - int(close.sum()), distance.shape[0] - int(close.sum())
    total = local + cutoff**order / 2.0 * (missed + false)
    return Gospa(total ** (1.0 / order), local ** (1.0 / order), missed, false)


def match_points(estimate: Floats, truth: Floats, *, cutoff: float = np.inf) -> Integers:
    """Index (M,) of the estimate (N, D) that stands for each true point (M, D), -1 for none within the cut-off [m].

    As many pairs as can be within the cut-off are made, at the least sum of squared distances.
    """
    distance = _pairwise(estimate, truth)
    index = np.full(distance.shape[1], -1)
    if not distance.size:
        return index
    # A pair beyond the cut-off costs more than all good pairs together, but its finite cost keeps the problem feasible.
    bound = min(cutoff, float(distance.max()))
    cost = np.where(distance <= cutoff, distance**2, (bound**2 + 1.0) * (min(distance.shape) + 1))
    rows, cols = scipy.optimize.linear_sum_assignment(cost)
    close = distance[rows, cols] <= cutoff
    index[cols[close]] = rows[close]
    return index


def match_nearest(distance: Floats, limit: float) -> Integers:
    """One-to-one assignment of rows to columns of distances (N, M): column (N,) of each row, -1 for none within the
    limit.

    The pairs with the least sum of distances, where a pair beyond the limit costs as much as one at it: it counts as
    none, as in GOSPA of order 1, so that no exact pair is given up for one that is beyond the limit all the same.
    """
    partner = np.full(len(distance), -1)
    rows, columns = scipy.optimize.linear_sum_assignment(np.minimum(distance, limit))
    near = distance[rows, columns] <= limit
    partner[rows[near]] = columns[near]
    return partner


def _pairwise(estimate: Floats, truth: Floats) -> Floats:
    """Distances (N, M) between two sets of points (N, D) and (M, D); an empty set may come without its dimension."""
    first, second = (np.asarray(points, dtype=np.float64) for points in (estimate, truth))
    if not first.size or not second.size:
        return np.zeros((len(first), len(second)))
    return np.asarray(scipy.spatial.distance.cdist(np.atleast_2d(first), np.atleast_2d(second)))
