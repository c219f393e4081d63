"""Schedule of births: which tracks to examine in a cycle, and which have to wait for another."""

import numpy as np

from rislam_rt.arrays import Booleans, Integers
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.nested.candidates import PredictedMeasurements, hidden_tracks
from rislam_rt.slam.nested.tracks import LandmarkTracks, log_silence
from rislam_rt.slam.observations import OTHER, same_side

STRIDE = 4
"""Tracks are examined every so many measurements, and four times less often once their history is full."""
ELDER_CYCLES = 6
"""Cycles of history from which on a track keeps longer and weaker ones waiting."""
ASLEEP = np.log(0.05)
"""Log probability of its present gap down to which a faint track does so in its silence."""
FEWEST = 2.0 / 3.0
"""Share of the cycles of a history that need a measurement: the way made meanwhile counts as well."""
PARALLEL = 4.0
"""Standard deviations (and 0.02) within which a track's direction is that of a known leg."""


def due_tracks(tracks: LandmarkTracks, predicted: PredictedMeasurements, cycle: int, config: SlamConfig) -> Integers:
    """Tracks whose birth is due to be examined, the shortest first: an image lies behind its point, and is weaker.

    So a track has to wait while another that is shorter and stronger is still unexplained.
    """
    age = tracks.age(cycle)
    fewest = np.where(tracks.side == OTHER, FEWEST, 1.0) * config.nested.birth_cycles
    long = (age + 1 >= config.nested.birth_cycles) & (tracks.length >= fewest)
    ready = (~tracks.specular | config.use_vt) & long & (tracks.misses == 0)
    growing = age < config.nested.window - 1
    turn = np.where(growing, tracks.length % STRIDE == 0, (np.arange(len(ready)) + cycle) % (4 * STRIDE) == 0)
    if not (ready & turn).any():
        return np.zeros(0, dtype=np.int64)
    hidden = hidden_tracks(predicted, tracks, config.nested.gate)
    alive = ~tracks.specular & ~hidden & (tracks.length >= ELDER_CYCLES)
    alive &= (tracks.misses <= 2) | (log_silence(tracks, cycle) > ASLEEP)
    length = tracks.mean[:, 0, 0]
    stronger = tracks.log_amplitude[None] > tracks.log_amplitude[:, None] + 0.1
    elder = (length[None] < length[:, None] - 0.05) & (stronger | _aligned(tracks))
    elder &= same_side(tracks.side, tracks.side)
    waits = (elder & alive[None]).any(axis=1) & growing & ~tracks.specular
    rows = (ready & turn & ~waits).nonzero()[0]
    return rows[np.argsort(tracks.mean[rows, 0, 0])]


def _aligned(tracks: LandmarkTracks) -> Booleans:
    """(T, T) whether the birth of one track waits for another's from the same direction: the longer is likely the
    shorter over a wall on the Tx leg."""
    gap = np.abs(tracks.mean[None, :, 1:, 0] - tracks.mean[:, None, 1:, 0])
    variance = tracks.covariance[..., 1:, 0, 0]
    return np.asarray((gap < PARALLEL * np.sqrt(variance[None] + variance[:, None] + 0.02**2)).all(axis=-1))
