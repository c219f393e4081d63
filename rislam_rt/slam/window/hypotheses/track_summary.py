"""Track summaries: each track's history condensed to at most eight normal points, with the scatter that its residuals
show.

What the map lacks shares cells with what a track is, and moves its measurements about, now here, now there, as phases
turn. Their scatter about a smooth path tells by how much more than the receiver reports.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import SensorModel
from rislam_rt.slam.arrival_rays import rays
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import PANEL, free_space
from rislam_rt.slam.predicted_returns import poses_of
from rislam_rt.slam.window.smoother.marginals import pose_covariance
from rislam_rt.slam.window.smoother.motion_basis import TURN
from rislam_rt.slam.window.smoother.window_gaussian import Window, now, poses
from rislam_rt.slam.window.solver_limits import PERIODS, POINTS, STRENGTHS
from rislam_rt.slam.window.state import WindowState

TOGETHER = 10.0
"""Measurements over which the error by unresolved neighbours keeps its sign."""


class _Points(NamedTuple):
    """Condensed histories of T tracks, B normal points each; where `weight` is 0 there is none."""

    seen: Floats
    """(T, B, 3) length [m] and two cosines, these in the room's axes."""
    weight: Floats
    """(T, B, 3) one over the standard deviation, 0 for padding."""
    time: Floats
    """(T, B) [s] from the present."""
    tx: Floats
    """(T, B, 3) [m] positions of the Tx."""
    rx: Floats
    """(T, B, 3) [m] positions of the Rx."""
    uncertainty: Floats
    """(T, B, 3, 6) square root of the agent's position covariance, by the errors of present place and velocity that all
    points share."""
    log_amplitude: Floats
    """(T,) mean log amplitude."""
    scatter: Floats
    """(T, 3) factor on the reported standard deviations, by the scatter of the residuals."""
    middle: Floats
    """(3,) [m] the agent's present position: the anchor of new walls."""
    speed: float
    """[m/s] speed of the agent, and something for its uncertainty."""
    twist: Floats
    """(T, B, 3, H) square root of the covariance with which the heading's error moves what is seen; H = 0 if known."""


class TrackSummary(_Points):
    """Condensed histories of T tracks, B normal points each, with the averages that are computed once."""

    def take(self, rows: Integers) -> "TrackSummary":
        """Summaries of only some of the tracks, or of some more than once."""
        per_track = {name: field[rows] for name, field in self._asdict().items() if name not in ("middle", "speed")}
        return self._replace(**per_track)

    def farther(self, sensor: SensorModel) -> tuple["TrackSummary", Integers]:
        """Summaries with more rows for the longer paths that tracks may be, whole periods of the sounding ambiguous, as
        far as a perfect mirror would be as loud; and the track (T + E,) of each row."""
        period, count = SPEED_OF_LIGHT * sensor.period, len(self.seen)
        longest = np.exp(free_space(sensor.radio) - self.log_amplitude)
        more = np.clip(np.floor((longest - self.mean[0][:, 0]) / period), 0.0, PERIODS).astype(np.int64)
        if not more.any():
            return self, np.arange(count)
        owner = np.repeat(np.arange(count), 1 + more)
        turn = np.arange(len(owner)) - np.searchsorted(owner, owner)
        order = np.argsort(turn > 0, kind="stable")
        owner, turn = owner[order], turn[order]
        found = self.take(owner)
        found.seen[..., 0] += period * turn[:, None]
        return found, owner

    @cached_property
    def mean(self) -> tuple[Floats, Floats, Floats]:
        """Mean measurement, Tx and Rx position, (T, 3) each, in every track's summary."""
        weight = self.weight[..., :1] ** 2
        weight = weight / weight.sum(axis=1, keepdims=True)
        seen, tx, rx = ((weight * field).sum(axis=1) for field in (self.seen, self.tx, self.rx))
        return seen, tx, rx

    @cached_property
    def direction(self) -> Floats:
        """Mean directions of arrival (T, 3) in the tracks' summaries, in the room's axes."""
        return rays(self.mean[0], 0.0)


def summarise_tracks(state: WindowState, rows: list[Integers]) -> tuple[TrackSummary, Integers]:
    """Condense the histories of T tracks, each given as rows of the log in time, to normal points with weights and pose
    errors; also returns the track (E,) of each summary: what the array hears alike from two directions has two, the
    second behind all others."""
    log, window = state.log, state.window
    which = np.repeat(np.arange(len(rows)), [len(at) for at in rows])
    alike = log.both_ends(np.concatenate(rows), which, state.scene.radio.array.spacing)
    if len(alike.owner) > len(rows):
        log = log.at_ends(alike)
        rows = [(alike.which == end).nonzero()[0] for end in range(len(alike.owner))]
    mean, covariance = now(window)
    place, time = poses(window), np.concatenate([[0.0], np.cumsum(window.step)])
    ends = poses_of(place[:, :3], state.heading + place[:, 3], state.scene.body)
    slots = [log.cycle[at] - (state.cycle - window.num_poses + 1) for at in rows]
    seen = [_turned(log.seen[at], ends.heading[slot]) for at, slot in zip(rows, slots, strict=True)]
    scatter = np.array([
        scatter_of(track, log.std[at], time[slot]) for track, at, slot in zip(seen, rows, slots, strict=True)
    ])  # fmt: skip
    # the difference of two alternated codes holds the panel's paths and nothing of the others
    pure = np.array([bool((log.side[at] >= PANEL).all()) for at in rows])[:, None]
    number, count = np.array([len(at) for at in rows])[:, None], len(rows)
    shown = scatter**2
    if state.scene.use_vt:  # what the others show is what a short history has yet to show
        around = max(CONSTANTS.crowd, float(np.mean(np.minimum(scatter, 10.0) ** 2)))
        expected = (CONSTANTS.memory * around + number * shown) / (CONSTANTS.memory + number)
    else:
        amplitude_std = np.array([np.median(log.log_amplitude_std[at]) for at in rows])[:, None]
        snr = 0.5 / np.maximum(amplitude_std, 1e-6) ** 2
        expected = expected_scatter(shown, np.maximum(number - _terms(number), 0) / TOGETHER, snr)
    alone = (CONSTANTS.memory + number * shown) / (CONSTANTS.memory + number)
    scatter = np.sqrt(np.where(pure, alone, expected))
    found = TrackSummary(
        np.zeros((count, POINTS, 3)), np.zeros((count, POINTS, 3)), np.zeros((count, POINTS)),
        np.zeros((count, POINTS, 3)) + ends.tx[-1], np.zeros((count, POINTS, 3)) + ends.rx[-1],
        np.zeros((count, POINTS, 3, 6)), np.array([log.log_amplitude[at].mean() for at in rows]), scatter,
        mean[:3].copy(), float(np.linalg.norm(mean[3:6])) + 0.05, np.zeros((count, POINTS, 3, 0)),
    )  # fmt: skip
    heads = heading_roots(window)
    turned = np.zeros((count, POINTS, heads.shape[1]))
    for row, (at, slot) in enumerate(zip(rows, slots, strict=True)):
        bins = np.arange(len(at)) * min(POINTS, len(at)) // len(at)
        start = np.searchsorted(bins, np.arange(bins[-1] + 1))
        used, many = len(start), np.diff(start, append=len(at)).astype(np.float64)[:, None]
        alone = max(len(at) / TOGETHER, 1.0) / used  # how many of a point's errors are its own
        inside = log.std[at] ** -2.0
        own = np.add.reduceat(log.std[at] ** 2, start) / many
        found.seen[row, :used] = np.add.reduceat(inside * seen[row], start) / np.add.reduceat(inside, start)
        found.weight[row, :used] = (own / many + own * (scatter[row] ** 2 - 1.0) / alone) ** -0.5
        found.time[row, :used] = np.add.reduceat(time[slot] - time[-1], start) / many[:, 0]
        found.tx[row, :used] = np.add.reduceat(ends.tx[slot], start) / many
        found.rx[row, :used] = np.add.reduceat(ends.rx[slot], start) / many
        turned[row, :used] = np.add.reduceat(heads[slot], start) / many
    scale = np.maximum(np.diag(covariance)[:6], 1e-14)
    root = np.linalg.cholesky(covariance[:6, :6] + np.diag(1e-6 * scale + 1e-14))
    across = np.stack([0.0 * found.seen[..., 0], found.seen[..., 2], -found.seen[..., 1]], axis=-1)
    found = found._replace(twist=across[..., None] * turned[:, :, None])
    uncertainty = np.asarray(root[:3] + found.time[..., None, None] * root[3:6], dtype=np.float64)
    return found._replace(uncertainty=uncertainty), alike.owner


def heading_roots(window: Window) -> Floats:
    """Square root (K, H) of the covariance of the window's headings for track summaries, in its three strongest
    directions; H = 0 if they are known."""
    if not window.turns:
        return np.zeros((window.num_poses, 0))
    value, vector = np.linalg.eigh(pose_covariance(window, TURN))
    return np.asarray(vector[:, -3:] * np.sqrt(np.maximum(value[-3:], 0.0)))


def _turned(seen: Floats, heading: Floats) -> Floats:
    """Lengths and cosines (K, 3) to summarise, the cosines rotated into the room's axes by headings (K,): a body that
    turns does not bend the history."""
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack([seen[:, 0], cos * seen[:, 1] - sin * seen[:, 2], sin * seen[:, 1] + cos * seen[:, 2]], axis=1)


def expected_scatter(shown: Floats, free: Floats, snr: Floats) -> Floats:
    """Mean square (T, 3) to expect of tracks' residuals, in reported deviations, given what they have shown and their
    linear SNR (T, 1).

    `shown` (T, 3) is the mean square that the tracks have shown over so many independent residuals `free` (T, 1).

    A neighbour in its cell of r times its amplitude moves a component by about r cells, of which the reported deviation
    is one over the root of the SNR: the mean square is 1 + r^2 SNR. Most tracks have none, and 1; some (`company`) have
    one, of any strength alike up to the track's own. The logarithm is averaged: a deviation, a variance and a weight
    then come out alike.
    """
    share = np.linspace(0.0, 1.0, STRENGTHS)
    log_square = np.log1p(snr)[..., None] * share
    prior = np.where(share == 0.0, 1.0 - CONSTANTS.company, 0.0) + CONSTANTS.company / STRENGTHS
    fit = np.log(prior) - 0.5 * free[..., None] * (log_square + shown[..., None] * np.exp(-log_square))
    weight = np.exp(fit - fit.max(axis=-1, keepdims=True))
    return np.asarray(np.exp((weight * log_square).sum(axis=-1) / weight.sum(axis=-1)))


def _terms(number: Integers | int) -> Integers:
    """Number of polynomial terms in a track's summary of so many measurements: a line, a quadratic from nine on."""
    return np.where(np.asarray(number) >= 9, 3, 2)


def scatter_of(seen: Floats, std: Floats, time: Floats) -> Floats:
    """Root mean square (3,) of a track's residuals about a quadratic in time (a line, for short ones), in reported
    deviations; 1 at least.

    Weights of Student's t keep single outliers from speaking for all.
    """
    order = int(_terms(len(time)))
    x = time - time.mean()
    rows = np.stack([x**power for power in range(order)], axis=1)
    trust = np.ones(len(time))
    for _ in range(2):
        heavy = rows * (trust[:, None] / std**2).T[:, :, None]
        normal = np.swapaxes(heavy, 1, 2) @ rows + 1e-12 * np.eye(order)
        best = np.linalg.solve(normal, np.swapaxes(heavy, 1, 2) @ seen.T[:, :, None])
        squared = ((seen - (rows @ best)[..., 0].T) / std) ** 2
        chi = (trust[:, None] * squared).sum(axis=0) / max(len(time) - order, 1)
        trust = (CONSTANTS.tail + 3.0) / (CONSTANTS.tail + (squared / np.maximum(chi, 1.0)).sum(axis=1))
    return np.sqrt(np.maximum(chi, 1.0))
