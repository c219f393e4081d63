"""Unresolved clusters: which predicted returns come out as one component, where that lies, and how strong it is."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.landmarks.measurement_prediction import ExpectedComponents
from rislam_rt.slam.window.solver_limits import EDGE


class UnresolvedClusters(NamedTuple):
    """Clusters of R predicted returns that come out as C components; the strongest return of each resolution cell
    leads."""

    leader: Integers
    """(C,) row of the leading return."""
    partner: Integers
    """(C,) row of the strongest other return in the cell, -1 for none."""
    share: Floats
    """(C,) weight of the partner in the place of the merged component, before its amplitude is known: mean..."""
    share_variance: Floats
    """(C,) ...and variance."""
    disturbance: Floats
    """(C, 3) variance of length and cosines by other returns in the cell or at its edge."""
    log_amplitude: Floats
    """(C,) log amplitude of the merged component."""
    log_amplitude_std: Floats
    """(C,) its standard deviation."""
    by_itself: Floats
    """(C,) probability that it comes out by itself: 1 for leaders, less for a return that a leader should absorb."""
    gap: Floats
    """(C, 3) difference of length and cosines from the leader to its partner; 0 without one."""
    presence: Floats
    """(C,) probability that the partner is heard with the leader; 0 without one."""

    def mean_share(self) -> tuple[Floats, Floats]:
        """Mean and variance (C,) of the partner's weight in the place of the merged component, heard or not."""
        return _with_presence(self.share, self.share_variance, self.presence)


def cluster(
    expected: ExpectedComponents, cell: Floats, clear: Floats, sides: Integers | None = None
) -> UnresolvedClusters:
    """Cluster predicted returns that the receiver cannot resolve: from the strongest down, each absorbs the weaker ones
    in its cell, and those at the cell's edge add variance."""
    strength, power = expected.log_amplitude, np.exp(2.0 * expected.log_amplitude)
    first, second, gap = _neighbours(expected.seen / cell, strength, sides)
    inside = gap < 1.0
    taken, partner, by_itself, total = _taken_in(first[inside], second[inside], strength, power, clear)
    around = ~taken[first] & (partner[first] != second)
    first, second = first[around], second[around]
    ratio = 0.5 * power[second] / power[first] * clear[second]
    disturbance = np.zeros(expected.seen.shape)
    np.add.at(disturbance, first, ratio[:, None] * (expected.seen[second] - expected.seen[first]) ** 2)
    leader = np.concatenate([(~taken).nonzero()[0], taken.nonzero()[0]])
    mate = np.where(taken[leader], -1, partner[leader])
    both = mate >= 0
    ratio = np.where(both, np.exp(strength[mate] - strength[leader]), 0.0)
    uncertainty = np.where(both, np.hypot(expected.log_amplitude_std[mate], expected.log_amplitude_std[leader]), 0.0)
    twins = both & (expected.forms[leader] == reciprocal(expected.forms[mate])).all(axis=1)
    uncertainty[twins] = TWIN_STD
    # a ratio r leaves a mean share of 0 below one and 1 above, of variance r^2/2: averaged over the uncertainty about r
    lean = _above(np.log(np.maximum(ratio, 1e-9)) / np.maximum(uncertainty, 1e-3))
    share = np.where(both, lean, 0.0)
    spread = np.where(
        both,
        np.minimum(0.5 * ratio**2, 0.25) + lean * (1.0 - lean) * np.exp(-np.abs(np.log(np.maximum(ratio, 1e-9)))),
        0.0,
    )
    share[twins], spread[twins] = 0.5, TWIN_STD**2
    presence = np.where(both, clear[mate], 0.0)
    presence[twins] = 1.0  # what is in the way of the one is in the way of the other
    fade = np.where(both, 0.7 * np.minimum(ratio, 1.0), 0.0)
    return UnresolvedClusters(
        leader,
        mate,
        share,
        spread,
        disturbance[leader],
        np.where(taken[leader], strength[leader], 0.5 * np.log(total[leader])),
        np.hypot(expected.log_amplitude_std[leader], fade),
        by_itself[leader],
        np.where(both[:, None], expected.seen[mate] - expected.seen[leader], 0.0),
        presence,
    )


def _with_presence(share: Floats, variance: Floats, presence: Floats) -> tuple[Floats, Floats]:
    """Mean and variance of an unresolved partner's share: the given ones with a probability `presence`, else 0."""
    mean = presence * share
    return mean, np.maximum(presence * (variance + share**2) - mean**2, 0.0)


def _neighbours(place: Floats, strength: Floats, sides: Integers | None) -> tuple[Integers, Integers, Floats]:
    """Pairs (P,) of unresolved returns at places (R, 3) [cells], the second weaker and in the cell of the first or at
    its edge, sorted by row, and the largest gap (P,) of each pair along an axis."""
    # along the first axis a return's neighbours behind it are the next ones, up to the first beyond its edge
    order = np.argsort(place[:, 0], kind="stable")
    axes = place[order].T
    after = np.arange(len(place)) + 1
    many = np.searchsorted(axes[0], axes[0] + EDGE, side="right") - after
    first = np.repeat(after - 1, many)
    second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(many) - many, many)
    close = (np.abs(axes[1][first] - axes[1][second]) <= EDGE) & (np.abs(axes[2][first] - axes[2][second]) <= EDGE)
    first, second = order[first[close]], order[second[close]]
    if sides is not None:
        same = sides[first] == sides[second]
        first, second = first[same], second[same]
    ahead, count = strength[first] - strength[second], len(place)
    pairs = np.concatenate([(first * count + second)[ahead >= 0.0], (second * count + first)[ahead <= 0.0]])
    pairs.sort()
    first, second = np.divmod(pairs, count)
    gap = np.abs(place[first, 0] - place[second, 0])
    for axis in place.T[1:]:
        np.maximum(gap, np.abs(axis[first] - axis[second]), out=gap)
    return first, second, gap


def _taken_in(
    first: Integers, second: Integers, strength: Floats, power: Floats, clear: Floats
) -> tuple[Booleans, Integers, Floats, Floats]:
    """Predicted measurements that are unresolved: which of R expected returns, the weaker ones `second`, stronger ones
    `first` of the same cell absorb, the strongest that each absorbed, the probability that each comes out by itself,
    and its power with what it absorbed."""
    count, level, weaker = len(strength), strength.tolist(), second.tolist()
    owner, partner = [-1] * count, np.full(count, -1)
    crowded = np.flatnonzero(np.bincount(first, minlength=count))
    begin, end = (np.searchsorted(first, crowded, side) for side in ("left", "right"))
    order = np.argsort(-strength[crowded], kind="stable")
    for leader, low, high in zip(crowded[order].tolist(), begin[order].tolist(), end[order].tolist(), strict=True):
        members = [] if owner[leader] >= 0 else [member for member in weaker[low:high] if owner[member] < 0]
        for member in members:
            owner[member] = leader
        if members:
            partner[leader] = max(members, key=level.__getitem__)
    of = np.array(owner, dtype=np.int64)
    taken = of >= 0
    by_itself = np.where(taken, np.maximum(1.0 - clear[of], CONSTANTS.rare), 1.0)
    return taken, partner, by_itself, power + np.bincount(of[taken], power[taken], count)


TWIN_STD = 0.03
"""Relative difference of a return and its reciprocal in amplitude: a baseline of 0.1 m at some metres."""


def reciprocal(forms: Integers) -> Integers:
    """Forms (R, 5) of the reciprocal paths, predicted with Tx and Rx legs exchanged."""
    return forms[:, [0, 3, 4, 1, 2]]


def _above(z: Floats) -> Floats:
    """Probability that a standard normal variable is below z, for predicted measurements, by a logistic curve."""
    return np.asarray(1.0 / (1.0 + np.exp(-1.7 * np.clip(z, -20.0, 20.0))))


def conditioned_share(
    clusters: UnresolvedClusters,
    expected: ExpectedComponents,
    row: Integers,
    log_amplitude: Floats,
    log_amplitude_std: Floats,
    presence: Floats,
) -> tuple[Floats, Floats]:
    """Mean and variance (A,) of the unresolved partner's share in clusters `row` (A,), given the measured amplitudes,
    and the probabilities `presence` (A,) that it is heard.

    Two paths of amplitudes a, b with the sum A come out at the share `(A^2 + b^2 - a^2) / (2 A^2)` from the first to
    the second: exact to first order in the gap, whatever the phase.
    """
    share, variance = clusters.share[row].copy(), clusters.share_variance[row].copy()
    both = (clusters.partner[row] >= 0).nonzero()[0]
    lead, mate = clusters.leader[row[both]], clusters.partner[row[both]]
    whole = np.exp(2.0 * log_amplitude[both])
    first, second = np.exp(2.0 * expected.log_amplitude[lead]), np.exp(2.0 * expected.log_amplitude[mate])
    told = 0.5 * (whole + second - first) / whole
    uncertainty = (first * expected.log_amplitude_std[lead]) ** 2 + (second * expected.log_amplitude_std[mate]) ** 2
    uncertainty = uncertainty / whole**2 + (0.5 * (1.0 - 2.0 * told) * 2.0 * log_amplitude_std[both]) ** 2 + 1e-4
    prior = variance[both]
    twins = prior <= TWIN_STD**2
    gain = np.where(twins, 0.0, prior / (prior + uncertainty))
    share[both] = np.clip(share[both] + gain * (told - share[both]), 0.0, 1.0)
    variance[both] = (1.0 - gain) * prior
    return _with_presence(share, variance, presence)
