"""Tracking of multipath components across cycles: each gets a label that it keeps while its path lives, crossings
included.

One small Kalman filter a track over path length and both cosines with their rates; optimal assignment of predicted
tracks to components within a gate. The amplitude takes part, so that a strong and a weak path keep their labels where
they cross. Nothing here knows what a path is: associating landmarks is the filter's business.
"""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Measurement

LENGTH_ACCELERATION = 0.05
"""Standard deviation of the white acceleration of a path's length [m/s^2]."""
COSINE_ACCELERATION = 0.05
"""Standard deviation of the white acceleration of a direction cosine [1/s^2]."""
LENGTH_RATE = 0.5
"""Standard deviation of a new track's rate of length [m/s]."""
COSINE_RATE = 0.2
"""Standard deviation of a new track's rate of a cosine [1/s]."""
STD_SCALE = 1.5
"""Factor of true errors over the reported standard deviations: unresolved neighbours pull at a component."""
LOUDNESS_STD = 0.35
"""Standard deviation of the change of the log amplitude (natural) from cycle to cycle; 0.35 is 3 dB."""
GATE = 20.0
"""Largest squared distance of length, cosines and log amplitude together (chi^2, 4 dof: 0.9995)."""
CONFIRM_HITS = 3
"""Number of components after which a track is confirmed as a path; before, one miss ends it."""
MAX_MISSES = 10
"""Number of cycles without a component that a confirmed track survives."""


class TrackState(NamedTuple):
    """T living tracks of multipath components."""

    label: Integers
    """(T,) label of each track."""
    mean: Floats
    """(T, 3, 2) length [m] and cosines, each with its rate [1/s]."""
    covariance: Floats
    """(T, 3, 2, 2) covariance of each value and its rate."""
    loudness: Floats
    """(T,) log amplitude."""
    hits: Integers
    """(T,) number of components so far."""
    misses: Integers
    """(T,) number of cycles since the last one."""
    next_label: int
    """Label of the next new track."""


def init_tracks() -> TrackState:
    """Empty set of tracks of multipath components, with which tracking begins."""
    none = np.zeros(0, dtype=np.int64)
    return TrackState(none, np.zeros((0, 3, 2)), np.zeros((0, 3, 2, 2)), np.zeros(0), none, none, 0)


def step_tracks(state: TrackState, measurement: Measurement, dt: float) -> tuple[TrackState, Integers]:
    """Track multipath components over a cycle: predict tracks over `dt` [s], assign components to them, update, start
    and end tracks; also the label (M,) of each component's track, a new one if it fits none."""
    seen = np.column_stack([SPEED_OF_LIGHT * measurement.tau, measurement.cosines])
    noise = STD_SCALE**2 * np.column_stack([SPEED_OF_LIGHT * measurement.tau_std, measurement.cosines_std]) ** 2
    loudness = np.log(np.maximum(measurement.amplitude, 1e-300))
    state = _predict(state, dt)
    rows, cols = _assign(state, seen, noise, loudness)

    mean, covariance = state.mean.copy(), state.covariance.copy()
    mean[rows], covariance[rows] = _update(mean[rows], covariance[rows], seen[cols], noise[cols])
    hit = np.zeros(len(state.label), dtype=bool)
    hit[rows] = True
    level = state.loudness.copy()
    level[rows] += 0.5 * (loudness[cols] - level[rows])
    hits, misses = state.hits + hit, np.where(hit, 0, state.misses + 1)
    alive = hit | ((state.hits >= CONFIRM_HITS) & (misses <= MAX_MISSES))

    fresh = np.setdiff1d(np.arange(len(seen)), cols)
    label = np.full(len(seen), -1)
    label[cols] = state.label[rows]
    label[fresh] = state.next_label + np.arange(len(fresh))
    new_mean, new_covariance = _start(seen[fresh], noise[fresh])
    tracks = TrackState(
        np.concatenate([state.label[alive], label[fresh]]),
        np.concatenate([mean[alive], new_mean]),
        np.concatenate([covariance[alive], new_covariance]),
        np.concatenate([level[alive], loudness[fresh]]),
        np.concatenate([hits[alive], np.ones(len(fresh), dtype=np.int64)]),
        np.concatenate([misses[alive], np.zeros(len(fresh), dtype=np.int64)]),
        state.next_label + len(fresh),
    )
    return tracks, label


def _predict(state: TrackState, dt: float) -> TrackState:
    """Kalman prediction of tracks of multipath components over `dt` [s] by discrete white-noise acceleration."""
    transition = np.array([[1.0, dt], [0.0, 1.0]])
    shape = np.array([[dt**4 / 4.0, dt**3 / 2.0], [dt**3 / 2.0, dt**2]])
    strength = np.array([LENGTH_ACCELERATION, COSINE_ACCELERATION, COSINE_ACCELERATION]) ** 2
    covariance = transition @ state.covariance @ transition.T + strength[:, None, None] * shape
    return state._replace(mean=state.mean @ transition.T, covariance=covariance)


def _assign(state: TrackState, seen: Floats, noise: Floats, loudness: Floats) -> tuple[Integers, Integers]:
    """Optimal assignment of tracks to multipath components within the gate: rows of tracks, rows of components."""
    innovation = seen - state.mean[:, None, :, 0]
    spread = state.covariance[:, None, :, 0, 0] + noise
    distance = np.sum(innovation**2 / spread, axis=-1)
    distance += ((loudness - state.loudness[:, None]) / LOUDNESS_STD) ** 2
    # The normaliser keeps an uncertain track from taking every component: it fits all of them badly.
    cost = distance + np.sum(np.log(spread), axis=-1)
    barred = distance > GATE
    ceiling = np.abs(np.where(barred, 0.0, cost)).max(initial=0.0) * 2.0 * (min(cost.shape) + 1) + 1.0
    rows, cols = scipy.optimize.linear_sum_assignment(np.where(barred, ceiling, cost))
    good = ~barred[rows, cols]
    return rows[good], cols[good]


def _update(mean: Floats, covariance: Floats, seen: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Kalman update of tracks of multipath components by their components, (N, 3) pairs of value and rate."""
    gain = covariance[..., :, 0] / (covariance[..., 0, 0] + noise)[..., None]
    mean = mean + gain * (seen - mean[..., 0])[..., None]
    return mean, covariance - gain[..., :, None] * covariance[..., None, 0, :]


def _start(seen: Floats, noise: Floats) -> tuple[Floats, Floats]:
    """Mean and covariance of new tracks of multipath components, one component each: its value, a rate about 0."""
    mean = np.stack([seen, np.zeros_like(seen)], axis=-1)
    covariance = np.zeros((*seen.shape, 2, 2))
    covariance[..., 0, 0] = noise
    covariance[..., 1, 1] = np.array([LENGTH_RATE, COSINE_RATE, COSINE_RATE]) ** 2
    return mean, covariance
