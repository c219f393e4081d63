"""Tracks: measurements that no landmark explains, followed over cycles until one can be made of them."""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.identity import STRENGTHS
from rislam_rt.slam.observations import PANEL, Observations

AMPLITUDE_WANDER = 1.0
"""Standard deviation of an unexplained track's log amplitude from cycle to cycle: a panel's code may change."""
PATIENT_CYCLES = 6
"""Measurements from which on gaps of a track are weighed by its own; younger ones may be chance."""
LOST = np.log(0.01)
"""Log probability of a gap below which a track has ended."""
FAINTEST = 0.1
"""Least share of cycles from which the strength of a path is reckoned."""
MAX_PANEL_ODDS = 8.0
"""Log odds of panel against scatterer that count most for a point: amplitudes alone do not make one."""


class LandmarkTracks(NamedTuple):
    """T tracks, each a Kalman filter of constant rate in length and either cosine, and its last W measurements."""

    mean: Floats
    """(T, 3, 2) value and rate of length [m] and cosines."""
    covariance: Floats
    """(T, 3, 2, 2)."""
    log_amplitude: Floats
    """(T,) of the last measurement."""
    shine: Floats
    """(T,) share of its measurements, the latest counting most, that were as strong as only a wall return is."""
    moving: Booleans
    """(T,) whether its history fits a moving image and nothing else."""
    misses: Integers
    """(T,) cycles since the last measurement."""
    seen: Floats
    """(T, W, 3), cycle k at row k % W."""
    std: Floats
    """(T, W, 3)."""
    cycle: Integers
    """(T, W) cycle of each row, -1 where empty."""
    level: Floats
    """(T, W) log amplitudes, likewise."""
    odds: Floats
    """(T,) log odds of a landmark's path, where a classifier has looked."""
    looks: Integers
    """(T,) how often it has."""
    log_grid: Floats
    """(T, G) log posterior of its strength, were it a scatterer (see `identity`)."""
    log_ris: Floats
    """(T, Q) log odds of each panel against scatterer."""
    side: Integers
    """(T,) that of its measurements."""

    @property
    def specular(self) -> Booleans:
        """(T,) whether it is taken for a wall return. What the receiver says ran over the panel is none, however it
        looks to a classifier."""
        told = (self.looks > 0) & (self.side != PANEL)
        return self.moving | np.where(told, self.odds < 0.0, self.shine > 0.3)

    @property
    def length(self) -> Integers:
        """(T,) measurements held of each track."""
        return np.sum(self.cycle >= 0, axis=1)

    def age(self, cycle: int) -> Integers:
        """(T,) cycles since the oldest measurement that is held of a track."""
        return np.asarray(cycle - np.min(np.where(self.cycle >= 0, self.cycle, cycle), axis=1))

    def earlier_misses(self, cycle: int) -> Integers:
        """(T,) cycles without a measurement between the oldest and the latest that are held."""
        return np.asarray(np.maximum(self.age(cycle) + 1 - self.length - self.misses, 0))

    def keep(self, rows: Booleans) -> "LandmarkTracks":
        """Only some of the tracks."""
        return LandmarkTracks._make(field[rows] for field in self)


def log_silence(tracks: LandmarkTracks, cycle: int) -> Floats:
    """(T,) log probability of gaps as long as the present ones, by the tracks' own past.

    What shows in every cycle has ended after a few without it; what lies near the detection threshold comes and goes.
    With a flat prior on the probability of its showing, n cycles with and m without a measurement leave
    `prod_j (m + j) / (n + m + 1 + j)`, j = 1 .. k, for a gap of k.
    """
    missed, gap = tracks.earlier_misses(cycle), tracks.misses
    total = tracks.length + missed
    return np.asarray(
        scipy.special.gammaln(missed + gap + 1)
        - scipy.special.gammaln(missed + 1)
        - scipy.special.gammaln(total + gap + 2)
        + scipy.special.gammaln(total + 2)
    )


def has_ended(tracks: LandmarkTracks, cycle: int, max_misses: int) -> Booleans:
    """(T,) tracks that were not seen for longer than `max_misses`, and than their past lets expect."""
    patient = (tracks.length >= PATIENT_CYCLES) & (log_silence(tracks, cycle) > LOST)
    return np.asarray((tracks.misses > max_misses) & ~patient)


def overstatement(tracks: LandmarkTracks, cycle: int, threshold: float) -> Floats:
    """(T,) factor by which the amplitudes of a track exceed its path's, and its reported deviations fall short.

    Of a path near the threshold only those amplitudes are measured that noise lifts above it. The share p of cycles in
    which it shows tells how far below it lies: `tau + x` with `x = Phi^-1(p)`, in standard deviations of the noise, of
    which what is measured has the mean `tau + x + phi(x) / p`.
    """
    seen, missed = tracks.length, tracks.earlier_misses(cycle)
    share = np.clip((seen + 1.0) / (seen + missed + 2.0), FAINTEST, 1.0 - 1e-9)
    quantile = scipy.special.ndtri(share)
    mean = np.sqrt(2.0 * threshold) + quantile
    return np.asarray(1.0 + np.exp(-0.5 * quantile**2) / np.sqrt(2.0 * np.pi) / share / mean)


def no_tracks(window: int, panels: int = 1) -> LandmarkTracks:
    """No tracks yet of possible landmarks, in a room of so many panels."""
    return LandmarkTracks(
        np.zeros((0, 3, 2)),
        np.zeros((0, 3, 2, 2)),
        np.zeros(0),
        np.zeros(0),
        np.zeros(0, dtype=np.bool_),
        np.zeros(0, dtype=np.int64),
        np.zeros((0, window, 3)),
        np.zeros((0, window, 3)),
        np.full((0, window), -1),
        np.zeros((0, window)),
        np.zeros(0),
        np.zeros(0, dtype=np.int64),
        np.zeros((0, len(STRENGTHS))),
        np.zeros((0, panels)),
        np.zeros(0, dtype=np.int64),
    )


def advance(tracks: LandmarkTracks, dt: float, cycle: int, bend: Floats) -> LandmarkTracks:
    """Predict every track over `dt` and forget what lies more than a window back; `bend` (3,) is the rate's drift."""
    transition = np.array([[1.0, dt], [0.0, 1.0]])
    noise = np.array([[dt**4 / 4.0, dt**3 / 2.0], [dt**3 / 2.0, dt**2]]) * (bend**2)[:, None, None]
    covariance = transition @ tracks.covariance @ transition.T + noise
    kept = np.where(tracks.cycle > cycle - tracks.cycle.shape[1], tracks.cycle, -1)
    return tracks._replace(mean=tracks.mean @ transition.T, covariance=covariance, misses=tracks.misses + 1, cycle=kept)


def extend(
    tracks: LandmarkTracks, rows: Integers, observations: Observations, picks: Integers, bright: Booleans, cycle: int
) -> LandmarkTracks:
    """Tracks `rows` (A,) updated by measurements `picks` (A,); `bright` (M,) tells those as strong as wall returns."""
    if not len(rows):
        return tracks
    mean, covariance = tracks.mean.copy(), tracks.covariance.copy()
    prior, spread = mean[rows], covariance[rows]
    gain = spread[..., 0] / (spread[..., 0, 0] + observations.std[picks] ** 2)[..., None]
    mean[rows] = prior + gain * (observations.seen[picks] - prior[..., 0])[..., None]
    covariance[rows] = spread - gain[..., :, None] * spread[..., None, 0, :]
    log_amplitude, misses, shine = tracks.log_amplitude.copy(), tracks.misses.copy(), tracks.shine.copy()
    log_amplitude[rows], misses[rows] = observations.log_amplitude[picks], 0
    shine[rows] += 0.2 * (bright[picks] - shine[rows])
    seen, std, cycles, level = tracks.seen.copy(), tracks.std.copy(), tracks.cycle.copy(), tracks.level.copy()
    slot = cycle % cycles.shape[1]
    seen[rows, slot], std[rows, slot], cycles[rows, slot] = observations.seen[picks], observations.std[picks], cycle
    level[rows, slot] = observations.log_amplitude[picks]
    side = tracks.side.copy()
    side[rows] = observations.sides[picks]
    return tracks._replace(
        mean=mean,
        covariance=covariance,
        log_amplitude=log_amplitude,
        misses=misses,
        shine=shine,
        seen=seen,
        std=std,
        cycle=cycles,
        level=level,
        side=side,
    )


def begin(
    tracks: LandmarkTracks, observations: Observations, picks: Integers, bright: Booleans, rate: Floats, cycle: int
) -> LandmarkTracks:
    """One new track for each of the measurements `picks` (A,); `rate` (3,) is the spread of rates to expect."""
    if not len(picks):
        return tracks
    window, count = tracks.cycle.shape[1], len(picks)
    fresh = no_tracks(window)
    mean = np.stack([observations.seen[picks], np.zeros((count, 3))], axis=-1)
    covariance = np.zeros((count, 3, 2, 2))
    covariance[..., 0, 0] = observations.std[picks] ** 2
    covariance[..., 1, 1] = rate**2
    seen, std, level = np.zeros((count, window, 3)), np.zeros((count, window, 3)), np.zeros((count, window))
    cycles = np.full((count, window), -1)
    slot = cycle % window
    seen[:, slot], std[:, slot], cycles[:, slot] = observations.seen[picks], observations.std[picks], cycle
    level[:, slot] = observations.log_amplitude[picks]
    fresh = LandmarkTracks(
        mean,
        covariance,
        observations.log_amplitude[picks],
        bright[picks].astype(np.float64),
        np.zeros(count, dtype=np.bool_),
        np.zeros(count, dtype=np.int64),
        seen,
        std,
        cycles,
        level,
        np.zeros(count),
        np.zeros(count, dtype=np.int64),
        np.full((count, len(STRENGTHS)), -np.log(len(STRENGTHS))),
        np.zeros((count, tracks.log_ris.shape[1])),
        observations.sides[picks],
    )
    return LandmarkTracks._make(np.concatenate([old, new]) for old, new in zip(tracks, fresh, strict=True))


def panel_surplus(log_ris: float) -> float:
    """What a track's amplitudes tell for a point, as chi^2: panel or scatterer; an image is the latter alone.

    Before a panel is known, that is: its own images change with the code as well.
    """
    return 2.0 * float(np.logaddexp(0.0, min(log_ris, MAX_PANEL_ODDS)) - np.log(2.0))
