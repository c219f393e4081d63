"""Tracks: components that no path of the map explains, followed from cycle to cycle by Kalman filters until a birth
explains them."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.assignment import Candidates, cheapest, pair_costs
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.window.landmarks.horizon_detection import Elevations, elevations, nothing_heard
from rislam_rt.slam.window.landmarks.measurement_prediction import PANEL_STD
from rislam_rt.slam.window.landmarks.ris_identification import PanelIdentity, unknown
from rislam_rt.slam.window.solver_limits import CERTAIN, GATE

WANDER = np.sqrt(2.0) * PANEL_STD
"""Standard deviation of an unexplained path's log amplitude from cycle to cycle: of the difference of a panel's under
two codes."""
CYCLE = 0.1
"""Time [s] assumed between two cycles whose time step is told as zero."""


class WindowTracks(NamedTuple):
    """Tracks of unexplained components, T Kalman filters of constant rate in length and both direction cosines of the
    body frame."""

    ident: Integers
    """(T,) number for life."""
    mean: Floats
    """(T, 3, 2) value and rate of length [m] and cosines; rates leave out the body's turn."""
    covariance: Floats
    """(T, 3, 2, 2) of value and rate, for each of the three."""
    log_amplitude: Floats
    """(T,) of the last measurement."""
    side: Integers
    """(T,) panel that the track runs over, `OTHER` or `UNTOLD` (see `slam.observations`)."""
    born: Integers
    """(T,) cycle of the first measurement."""
    last: Integers
    """(T,) cycle of the last one."""
    earlier: Integers
    """(T,) cycle of the one before it; of the last where it is the first."""
    earlier_log_amplitude: Floats
    """(T,) of that one."""
    hits: Integers
    """(T,) number of measurements."""
    looked: Integers
    """(T,) number of measurements at the last examination for a birth."""
    log_real: Floats
    """(T,) log odds of being a path that a code of the panel has lit, and not false components one after the other."""
    log_direct: Floats
    """(T, Q) log odds, were it over each of Q panels, that it is over no wall besides."""
    log_leak: Floats
    """(T, Q) log odds that it leaks, a path over something else that is told for each of Q panels' under any code,
    against that panel's direct path."""
    log_grid: Floats
    """(T, G) log posterior of its strength (root of a cross-section), were it a scatterer heard over no wall
    (see `panel_evidence`)."""
    log_ris: Floats
    """(T, Q) log odds of each of Q panels against scatterer."""
    hidden: Floats
    """(T, Q + 1) probability that something occludes it, were it each of the panels, and a scatterer."""
    rises: Floats
    """(T, Z) log likelihoods of its elevation, by when it was heard (see `horizon_detection`)."""
    next_ident: int
    """Number of the next track."""

    @property
    def identity(self) -> PanelIdentity:
        """Panel identities (T,) that are kept with the tracks from cycle to cycle, as of points heard over no wall."""
        return PanelIdentity(self.log_grid, self.log_ris, self.hidden)

    def keep(self, rows: Booleans) -> "WindowTracks":
        """Only the tracks that are marked in `rows` (T,)."""
        return self if rows.all() else WindowTracks._make([*(field[rows] for field in self[:-1]), self.next_ident])


def no_tracks(panels: int = 1) -> WindowTracks:
    """Empty set of tracks, for a room of so many panels."""
    none = np.zeros(0, dtype=np.int64)
    return WindowTracks(
        none, np.zeros((0, 3, 2)), np.zeros((0, 3, 2, 2)), np.zeros(0), none, none, none, none, np.zeros(0), none, none,
        np.zeros(0), *unlike(0, panels), *unknown(0, panels), nothing_heard(0), 0,
    )  # fmt: skip


def unlike(count: int, panels: int = 1) -> tuple[Floats, Floats]:
    """Log odds (T, Q) of so many new tracks of being a panel's direct path, and of being a leak: the first is as likely
    as not, and a leak is rare."""
    return np.zeros((count, panels)), np.full((count, panels), CONSTANTS.log_rare)


def advance(tracks: WindowTracks, dt: float, turn: float, bend: Floats, velocity: Floats) -> WindowTracks:
    """Kalman prediction of the tracks over `dt` [s] while the body turns by `turn` [rad]; `bend` (3,) is the root of
    the rates' variance per second. A body that goes where it faces keeps a `velocity` (2,) [m/s] in its own
    axes, which turns with it: lengths shrink by twice the way towards where a path comes from."""
    move = np.array([[1.0, dt], [0.0, 1.0]])
    noise = np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]]) * (bend**2)[:, None, None]
    if dt <= 0.0:  # time passes from cycle to cycle, whatever a coarse clock says
        noise = np.zeros((len(tracks.ident), 3, 2, 2))
        noise[..., 0, 0] = CYCLE**2 * (tracks.mean[..., 1] ** 2 + tracks.covariance[..., 1, 1])
    mean = tracks.mean @ move.T
    cos, sin, before = np.cos(turn), np.sin(turn), mean[:, 1:, 0].copy()
    mean[:, 1], mean[:, 2] = cos * mean[:, 1] + sin * mean[:, 2], cos * mean[:, 2] - sin * mean[:, 1]
    mean[:, 0, 1] -= 2.0 * (mean[:, 1:, 0] - before) @ velocity
    return tracks._replace(mean=mean, covariance=move @ tracks.covariance @ move.T + noise)


def match(
    tracks: WindowTracks, observed: Observations, free: Integers, cycle: int, strangers: float
) -> tuple[Integers, Integers, float]:
    """Assign components `free` of a cycle to the tracks that they continue: rows of the tracks, their components, and
    the log likelihood ratio of that against all being new; `strangers` is the density of new paths."""
    count = len(tracks.ident)
    if not count or not len(free):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), 0.0
    spread = np.zeros((count, 3, 3))
    spread[:, [0, 1, 2], [0, 1, 2]] = tracks.covariance[..., 0, 0]
    heard = share(tracks, cycle)
    odds = np.log(heard / (1.0 + CONSTANTS.rare - heard))
    steady = np.zeros(count, dtype=np.bool_)
    candidates = Candidates(
        tracks.mean[..., 0], spread, tracks.log_amplitude, np.full(count, WANDER), odds, tracks.side, steady
    )
    costs = pair_costs(candidates, observed.take(free), GATE, strangers)
    rows, columns = cheapest(costs)
    return rows, free[columns], -0.5 * float(costs[rows, columns].sum())


def match_over_motions(
    calm: WindowTracks, manoeuvred: Callable[[], tuple[WindowTracks, float]], observed: Observations, free: Integers,
    cycle: int, strangers: float,
) -> tuple[WindowTracks, Integers, Integers]:  # fmt: skip
    """Assign components to tracks as predicted by the motion as believed, `calm`, or as they are `manoeuvred`, with
    the prior log odds of that, whichever is likelier for all of them together: the tracks, and as in `match`.

    One track alone that would go on only in a manoeuvre has reasons of its own, as a neighbour's pull.
    """
    rows, picks, score = match(calm, observed, free, cycle, strangers)
    late = calm.last == cycle - 1
    kept = int(late[rows].sum())
    if kept + 1 >= int(late.sum()):
        return calm, rows, picks
    lively, log_odds = manoeuvred()
    other_rows, other_picks, other = match(lively, observed, free, cycle, strangers)
    likelier = other + log_odds > score and late[other_rows].sum() > kept + 1
    return (lively, other_rows, other_picks) if likelier else (calm, rows, picks)


def share(tracks: WindowTracks, cycle: int) -> Floats:
    """Share (T,) of the cycles since a track began, and so the probability, in which it is detected."""
    return np.minimum((tracks.hits + 1.0) / (cycle - tracks.born + 2.0), 1.0)


class Continuations(NamedTuple):
    """Components with which T tracks are expected to go on in a cycle of M components, if they are not a panel's."""

    density: Floats
    """(M,) their density at each component, per metre, unit of each cosine and e-fold of amplitude."""
    seen: Floats
    """(T, 3) predicted length [m] and cosines."""
    log_amplitude: Floats
    """(T,) log amplitude of the last measurement."""
    share: Floats
    """(T,) probability that the track is detected, and not a panel's."""


def continuations(tracks: WindowTracks, observed: Observations, sway: Floats, cycle: int) -> Continuations:
    """Where tracks, predicted to the cycle of some components, are expected to go on; `sway` (M, 3) is the variance
    that the body's attitude gives to length and cosines."""
    heard = share(tracks, cycle) / (1.0 + np.exp(tracks.log_ris).sum(axis=1))
    density = np.exp(
        _log_density(tracks.mean[:, None], tracks.covariance[:, None], tracks.log_amplitude[:, None], observed, sway)
    )
    return Continuations(heard @ density, tracks.mean[..., 0], tracks.log_amplitude, heard)


def _log_density(
    mean: Floats, covariance: Floats, log_amplitude: Floats, observed: Observations, sway: Floats | float = 0.0
) -> Floats:
    """Log densities (..., M) of components as continuations of tracks (..., M or 1), per metre, unit of each cosine and
    e-fold of amplitude; `sway` (M, 3) is what the body's attitude adds to the variance."""
    variance = covariance[..., 0, 0] + observed.std**2 + sway
    square = ((observed.seen - mean[..., 0]) ** 2 / variance).sum(axis=-1)
    wander = WANDER**2 + observed.log_amplitude_std**2
    square += (observed.log_amplitude - log_amplitude) ** 2 / wander
    log_norm = 0.5 * (np.log(variance).sum(axis=-1) + np.log(wander)) + 2.0 * np.log(2.0 * np.pi)
    return np.asarray(-0.5 * square - log_norm)


def with_evidence(
    tracks: WindowTracks, rows: Integers, observed: Observations, picks: Integers, cycle: int, false: Floats
) -> WindowTracks:
    """Tracks whose odds of being real have the evidence that tracks `rows` (A,), as predicted, go on with components
    `picks` (A,) of a cycle; `false` (M,) is the density of false ones where its M components are."""
    real = tracks.log_real.copy()
    log_density = _log_density(
        tracks.mean[rows], tracks.covariance[rows], tracks.log_amplitude[rows], observed.take(picks)
    )
    log_ratio = np.log(share(tracks, cycle)[rows]) + log_density - np.log(false[picks])
    real[rows] += np.clip(log_ratio, -CONSTANTS.max_log_ratio, CONSTANTS.max_log_ratio)
    return tracks._replace(log_real=np.clip(real, -CERTAIN, CERTAIN))


def extend(tracks: WindowTracks, rows: Integers, observed: Observations, picks: Integers, cycle: int) -> WindowTracks:
    """Kalman update of tracks `rows` (A,) of what the map lacks by components `picks` (A,) of a cycle."""
    mean, covariance = tracks.mean.copy(), tracks.covariance.copy()
    prior, spread = mean[rows], covariance[rows]
    gain = spread[..., 0] / (spread[..., 0, 0] + observed.std[picks] ** 2)[..., None]
    mean[rows] = prior + gain * (observed.seen[picks] - prior[..., 0])[..., None]
    covariance[rows] = spread - gain[..., :, None] * spread[..., None, 0, :]
    level, last, hits = tracks.log_amplitude.copy(), tracks.last.copy(), tracks.hits.copy()
    earlier, before = tracks.earlier.copy(), tracks.earlier_log_amplitude.copy()
    earlier[rows], before[rows] = last[rows], level[rows]
    level[rows], last[rows] = observed.log_amplitude[picks], cycle
    hits[rows] += 1
    return tracks._replace(
        mean=mean,
        covariance=covariance,
        log_amplitude=level,
        last=last,
        earlier=earlier,
        earlier_log_amplitude=before,
        hits=hits,
    )


def start(
    tracks: WindowTracks, observed: Observations, picks: Integers, rate: Floats, cycle: int,
    log_real: Floats | float = 0.0,
) -> tuple[WindowTracks, Integers]:  # fmt: skip
    """Begin a track for each of the components `picks` (A,) of a cycle, with rates of standard deviation `rate` (A, 3)
    and log odds `log_real` (A,) of being real; also returns the new idents (A,)."""
    count = len(picks)
    ident = tracks.next_ident + np.arange(count)
    if not count:
        return tracks, ident
    covariance = np.zeros((count, 3, 2, 2))
    covariance[..., 0, 0], covariance[..., 1, 1] = observed.std[picks] ** 2, rate**2
    fresh = (
        ident, np.stack([observed.seen[picks], np.zeros((count, 3))], axis=-1), covariance,
        observed.log_amplitude[picks], observed.sides[picks], *np.full((3, count), cycle),
        observed.log_amplitude[picks], np.ones(count, dtype=np.int64), np.zeros(count, dtype=np.int64),
        np.zeros(count) + log_real, *unlike(count, tracks.log_ris.shape[1]),
        *unknown(count, tracks.log_ris.shape[1]), nothing_heard(count),
    )  # fmt: skip
    joined = (np.concatenate(pair) for pair in zip(tracks[:-1], fresh, strict=True))
    return WindowTracks._make([*joined, tracks.next_ident + count]), ident


def recognisable(tracks: WindowTracks, cycle: int, strangers: float) -> Booleans:
    """Whether a component where each track (T,) is predicted, measured without error, would be held for its
    continuation rather than for a new path, of which `strangers` are to be expected per metre, unit of each cosine and
    e-fold of amplitude."""
    heard, variance = share(tracks, cycle), tracks.covariance[..., 0, 0].prod(axis=1) * WANDER**2
    log_odds = np.log(heard / (1.0 + CONSTANTS.rare - heard))
    return np.asarray(log_odds - 0.5 * np.log((2.0 * np.pi) ** 4 * variance) > np.log(strangers))


def alive(tracks: WindowTracks, cycle: int, above: Floats, level: Floats) -> Booleans:
    """Whether each track (T,) has been missed for no longer than its share of detections lets expect: 3 cycles, or more
    for what comes and goes.

    A body that sways turns it below the plane of the array: it is above that with probabilities `above` (L, T) under
    the levels of the tilt's deviation, of probabilities `level` (L,). What is likelier the panel than not may be silent
    for long: its codes make it so.
    """
    usual = 1.0 - CONSTANTS.rare ** (1.0 / 3.0)
    share = np.minimum((tracks.hits + 1.0) / (tracks.last - tracks.born + 3.0) / (level @ above), 1.0)
    share = np.where(tracks.hits >= 4, np.clip(share, 1e-6, usual), usual)
    silent = level @ (1.0 - share * above) ** np.maximum(cycle - tracks.last - 1e-6, 0.0)
    coded = (tracks.log_ris > 0.0).any(axis=1) & (tracks.hits >= 2)
    found = (silent >= CONSTANTS.rare) & (cycle - tracks.last <= CONSTANTS.window)
    return np.asarray(found | (coded & (cycle - tracks.last <= CONSTANTS.window)))


def nearly_level(tracks: WindowTracks) -> Elevations:
    """Elevations of the tracks that nothing explains: those at the rim of the unit disc, within a deviation, are level
    as far as upright walls are."""
    seen, std = tracks.mean[..., 0], np.sqrt(tracks.covariance[:, 1, 0, 0])
    radius = np.hypot(seen[:, 1], seen[:, 2]) + std
    rise = np.sqrt(np.maximum(1.0 - radius**2, 0.0))
    return elevations(rise, np.full(len(rise), CONSTANTS.lean), seen[:, 1:])


def due(tracks: WindowTracks, cycle: int) -> Integers:
    """Rows of the tracks to examine for a birth, the shortest first: after 6 measurements, and whenever their number
    has grown by a half."""
    grown = tracks.hits >= np.maximum(6, np.minimum(3 * tracks.looked // 2, tracks.looked + CONSTANTS.window // 2))
    rows = (grown & (cycle - tracks.last <= 1)).nonzero()[0]
    return rows[np.argsort(tracks.mean[rows, 0, 0])]


def looked_as_before(tracks: WindowTracks, before: WindowTracks) -> WindowTracks:
    """Tracks after a trial in which others than they were due: examined for a birth when they were `before`."""
    looked = tracks.looked.copy()
    looked[np.isin(tracks.ident, before.ident)] = before.looked[np.isin(before.ident, tracks.ident)]
    return tracks._replace(looked=looked)
