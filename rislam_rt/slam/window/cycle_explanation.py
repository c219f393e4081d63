"""What explains a cycle's components: returns of the map, or tracks; and what of these is born or taken back."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.window import tracks
from rislam_rt.slam.window.births.births import births
from rislam_rt.slam.window.births.feature_removal import condemned, release
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable, idents, image_ident
from rislam_rt.slam.window.landmarks.measurement_prediction import (
    ExpectedComponents,
    UnresolvedClusters,
    conditioned_share,
)
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.measurement_log import Log, Residuals
from rislam_rt.slam.window.numerics import REFRESH
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.state import WindowState
from rislam_rt.slam.window.tracks import WindowTracks


def explain(
    log: Log,
    expected: ExpectedComponents,
    groups: UnresolvedClusters,
    landmarks: WindowTable,
    scatter: Floats,
    row: Integers,
    pick: Integers,
    count: int,
) -> Log:
    """The log's last `count` components with what they were taken for."""
    if not len(row):
        return log
    at = len(log.cycle) - count + pick
    lead, mate = groups.leader[row], groups.partner[row]
    share, variance = conditioned_share(groups, expected, row, log.log_amplitude[at], log.log_amplitude_std[at])
    both = (mate >= 0)[:, None]
    forms = np.stack([expected.forms[lead], np.where(both, expected.forms[mate], UNKNOWN)], axis=1)
    extra = groups.disturbance[row] + variance[:, None] * groups.gap[row] ** 2
    extra += CONSTANTS.memory * (np.maximum(scatter[lead], 1.0) - 1.0)[:, None] * log.std[at] ** 2
    return log.explain(at, idents(landmarks, forms), np.where(both[:, 0], share, 0.0), extra)


def squares(left: Residuals, log: Log, rows: Integers) -> Floats:
    """Mean squares (A,) of the residuals of some explained rows of the log, in reported deviations."""
    if not len(rows):
        return np.zeros(0)
    at = np.searchsorted(left.row, rows)
    return np.asarray(np.mean(left.left[at] ** 2 * (1.0 + log.extra[rows] / log.std[rows] ** 2), axis=1))


def unexplained(state: WindowState, observed: Observations) -> float:
    """Components per metre, unit of each cosine and e-fold that nothing explained in the cycle before."""
    if not len(observed.seen):
        return 0.0
    window, sensor = np.diff(state.scene.sensor.window)[0] * SPEED_OF_LIGHT, state.scene.sensor
    loudness = 0.5 * np.log(sensor.radio.integrated_snr(np.exp(observed.log_amplitude.max())) / sensor.threshold)
    count = float((state.tracks.last == state.cycle - 1).sum())
    return count / (window * np.pi * max(float(loudness), 1.0))


class Followed(NamedTuple):
    """Tracks after a cycle, and the log that names them."""

    tracks: WindowTracks
    log: Log
    followed: int
    """Tracks of the last cycle..."""
    kept: int
    """...and those among them that go on."""


def follow(
    state: WindowState, mean: Floats, observed: Observations, free: Integers, dt: float, turn: float, bend: float
) -> Followed:
    """Tracks extended, begun and ended by the components that nothing explains."""
    speed = float(np.linalg.norm(mean[3:6]))
    length = np.maximum(state.tracks.mean[:, 0, 0], 0.5) if len(state.tracks.ident) else np.ones(1)
    drift = np.array([2.0 * bend + speed**2, 0.1, 0.1]) if len(length) else np.zeros(3)
    found = tracks.advance(state.tracks, dt, turn, drift)
    late = found.last == state.cycle - 1
    rows, picks = tracks.match(found, observed, free, state.cycle, state.config.new_density)
    found = tracks.extend(found, rows, observed, picks, state.cycle)
    spare = np.setdiff1d(free, picks)
    reach = np.maximum(observed.seen[spare, 0], 0.5)
    rate = np.stack([np.full(len(spare), 2.0), 2.0 / reach, 2.0 / reach], axis=1) * (speed + 0.05)
    if len(state.level) > 2:  # what turns without a compass turns all that it sees
        rate[:, 1:] += np.sqrt(motion.expected_variance(state.level[2]))
    found, fresh = tracks.start(found, observed, spare, rate, state.cycle)
    base = len(state.log.cycle) - len(observed.seen)
    track = state.log.track.copy()
    track[base + picks], track[base + spare] = found.ident[rows], fresh
    found = found.keep(tracks.alive(found, state.cycle))
    return Followed(found, state.log._replace(track=track), int(late.sum()), int(late[rows].sum()))


def names(landmarks: WindowTable, expected: ExpectedComponents, groups: UnresolvedClusters, row: Integers) -> Integers:
    """Ident of what each of the clusters `row` (A,) came over first: a point, its image in a wall, a wall."""
    if not len(row):
        return np.zeros(0, dtype=np.int64)
    forms = expected.forms[groups.leader[row]]
    wall = np.where(forms[:, 3] >= 0, forms[:, 3], forms[:, 1])
    own = landmarks.ident[np.where(forms[:, 0] >= 0, forms[:, 0], wall)]
    image = (forms[:, 0] >= 0) & (wall >= 0)
    return np.where(image, image_ident(own, landmarks.ident[wall]), own)


def grow(state: WindowState, left: Residuals, expected: ExpectedComponents, groups: UnresolvedClusters) -> WindowState:
    """With what the evidence has turned against taken back, or else with what is born."""
    fresh = True
    if state.cycle % REFRESH == 0 and len(state.landmarks.ident):
        gone = condemned(state.landmarks, left, state.log, expected, window_gaussian.now(state.window)[1])
        state, fresh = release(state, ~gone), not gone.any()
    return births(state, expected, groups) if fresh else state
