"""Tracker of ranges in front of Channel-SLAM: it keeps the ranges of one path over time under one label.

In the publication a Kalman enhanced super resolution tracker (KEST) follows the paths in the signal itself. Here the
receiver's ranges are given, and a Kalman filter of range and rate a path, with one assignment a cycle, labels them.
"""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Floats, Integers, join_rows

UNLABELLED = -1
"""Label of a range that continues no track."""


class RangeTracks(NamedTuple):
    """T tracks of ranges over time, each a Kalman filter of range and range rate."""

    mean: Floats
    """Mean (T, 2) of range [m] and range rate [m/s]."""
    covariance: Floats
    """Covariance (T, 2, 2) of range and range rate."""
    label: Integers
    """Label (T,), a number for life."""
    hits: Integers
    """Number (T,) of ranges so far."""
    misses: Integers
    """Number (T,) of cycles since the last range."""


def no_tracks() -> RangeTracks:
    """Empty set of range tracks."""
    whole = np.zeros(0, dtype=np.int64)
    return RangeTracks(np.zeros((0, 2)), np.zeros((0, 2, 2)), whole, whole, whole)


def advance(tracks: RangeTracks, dt: float, acceleration: float) -> RangeTracks:
    """Predict range tracks over `dt` [s], the rate drifting by white acceleration of a standard deviation [m/s^2]."""
    transition = np.array([[1.0, dt], [0.0, 1.0]])
    noise = acceleration**2 * np.array([[dt**4 / 4.0, dt**3 / 2.0], [dt**3 / 2.0, dt**2]])
    covariance = transition @ tracks.covariance @ transition.T + noise
    return tracks._replace(mean=tracks.mean @ transition.T, covariance=covariance)


def assign(tracks: RangeTracks, length: Floats, std: Floats, gate: float) -> Integers:
    """Row (M,) of the track that each range continues, -1 for none: cheapest one-to-one assignment within the gate."""
    variance = tracks.covariance[:, 0, 0][:, None] + std**2
    square = (length - tracks.mean[:, :1]) ** 2 / variance
    gain = np.where(square < gate, gate - square, 0.0)
    row, column = scipy.optimize.linear_sum_assignment(-gain)
    taken = gain[row, column] > 0.0
    found = np.full(len(length), UNLABELLED)
    found[column[taken]] = row[taken]
    return found


def follow(
    tracks: RangeTracks, found: Integers, length: Floats, std: Floats, rate_std: float, first: int
) -> tuple[RangeTracks, Integers]:
    """Range tracks corrected by their ranges, with new ones (labels from `first`) for others, and all labels (M,)."""
    mean, covariance = tracks.mean.copy(), tracks.covariance.copy()
    hit = np.flatnonzero(found != UNLABELLED)
    rows = found[hit]
    gain = covariance[rows][:, :, 0] / (covariance[rows, 0, 0] + std[hit] ** 2)[:, None]
    mean[rows] += gain * (length[hit] - tracks.mean[rows, 0])[:, None]
    covariance[rows] -= gain[:, :, None] * tracks.covariance[rows][:, None, 0]
    seen = np.zeros(len(tracks.label), dtype=np.int64)
    seen[rows] = 1
    old = RangeTracks(mean, covariance, tracks.label, tracks.hits + seen, np.where(seen > 0, 0, tracks.misses + 1))
    spare = np.flatnonzero(found == UNLABELLED)
    spread = np.zeros((len(spare), 2, 2))
    spread[:, 0, 0], spread[:, 1, 1] = std[spare] ** 2, rate_std**2
    fresh = first + np.arange(len(spare))
    new = RangeTracks(
        np.stack([length[spare], np.zeros(len(spare))], axis=1), spread, fresh, np.ones(len(spare), dtype=np.int64),
        np.zeros(len(spare), dtype=np.int64),
    )  # fmt: skip
    label = np.empty(len(length), dtype=np.int64)
    label[hit], label[spare] = tracks.label[rows], fresh
    return join_rows([old, new]), label
