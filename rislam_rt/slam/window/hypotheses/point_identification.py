"""Point identification: each point that a track may be, weighed as scatterer and as RIS panel by its whole history."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import RisCode
from rislam_rt.ris.path_gain import point_amplitude
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD
from rislam_rt.slam.predicted_returns import AXES, NONE, Poses, poses_of
from rislam_rt.slam.sampling import even_draws
from rislam_rt.slam.window.hypotheses.hypotheses import IS_POINT, OVER_SAME, POINT, Hypotheses
from rislam_rt.slam.window.hypotheses.hypothesis_fits import Fits
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.ris_identification import (
    PanelIdentity,
    PanelObservation,
    gains,
    spread_places,
    unknown,
    weigh,
)
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.smoother.window_gaussian import now, poses
from rislam_rt.slam.window.solver_limits import CERTAIN
from rislam_rt.slam.window.state import WindowState


class Identified(NamedTuple):
    """Panel identities of the points of H hypotheses, and what they add to the evidence of T tracks."""

    gain: Floats
    """(H,) gain in log evidence, of points that may be a panel instead of a scatterer."""
    identity: PanelIdentity
    """(H,) panel identity of each point."""
    elsewhere: Floats
    """(T, Q) log odds that a track runs over each panel by a path that is none of these hypotheses, against over none:
    one that is shorter than the direct path over the point that is held for the panel needs another point for it."""


def identify(
    context: WindowState, track_rows: list[Integers], table: Hypotheses, fits: Fits, evidence: Floats
) -> Identified:
    """Weigh every point that a track may be as RIS panel and as scatterer, by each track's components (`track_rows` of
    the log), and return the gain in evidence."""
    scene, landmarks, panels = context.scene, context.landmarks, context.scene.num_panels
    elsewhere = np.full((len(track_rows), panels), -CERTAIN)
    found = Identified(np.zeros(len(evidence)), unknown(len(evidence), panels), elsewhere)
    if scene.ris is None:
        found.identity.log_ris[:] = -np.inf
        return found
    point = IS_POINT[table.kind]
    # a point that is not there is no panel: odds that it is both
    exists, is_panel = -landmarks.log_odds[landmarks.points, None], -landmarks.log_ris[landmarks.points]
    held = -np.logaddexp(np.logaddexp(exists, is_panel), exists + is_panel)
    taken = -np.logaddexp.reduce(np.append(held, np.zeros((1, panels)), axis=0), axis=0)  # but one
    margin = longer(context, track_rows)
    for track, at in enumerate(track_rows):
        rows = (point & (table.trials.track == track)).nonzero()[0]
        if (context.log.side[at] == OTHER).all():
            found.identity.log_ris[rows] = -CERTAIN
            continue
        near = rows[evidence[rows] > evidence[rows].max() - CERTAIN]
        fresh = _history(context, at, table, fits, np.append(near, rows[0]))
        fresh.log_ris[:-1] += taken + log_none_shorter(context, at, fits.place[near], fits.covariance[near])
        found.gain[near] = np.logaddexp.reduce(np.pad(fresh.log_ris[:-1], ((0, 0), (1, 0))), axis=1)
        found.gain[near] -= np.log1p(panels * CONSTANTS.panels)
        found.elsewhere[track] = fresh.log_ris[-1] + np.logaddexp(
            scipy.special.log_ndtr(margin[track]), scipy.special.log_ndtr(-margin[track]) + taken
        )
        found = found._replace(identity=found.identity.put(near, fresh.take(np.arange(len(near)))))
    # what is heard over walls alone may well be hidden straight ahead: silence there tells nothing
    found.identity.hidden[table.kind != POINT] = 1.0
    return found._replace(identity=found.identity.clipped())


def longer(context: WindowState, track_rows: list[Integers]) -> Floats:
    """By how many standard deviations (T, Q) each track, whose point is to be identified, is longer than the direct
    path over the point that is held for each panel: over walls, no path is shorter. Infinite where none is held."""
    window, held = context.window, np.array(context.landmarks.panels)
    found = np.full((len(track_rows), len(held)), np.inf)
    if (held < 0).all():
        return found
    last = np.array([at[-1] for at in track_rows])
    slot = context.log.cycle[last] - (context.cycle - window.num_poses + 1)
    place = poses(window)[slot]
    ends = poses_of(place[:, :3], context.heading[slot] + place[:, 3], context.scene.body)
    covariance = now(window)[1]
    for panel in (held >= 0).nonzero()[0]:
        row = int(held[panel])
        far, slope = _direct(window.features[row], ends)
        apart = np.eye(3, len(covariance), HEAD + 3 * row) - np.eye(3, len(covariance))
        variance = np.vecdot(slope, slope @ (apart @ covariance @ apart.T)) + context.log.std[last, 0] ** 2
        found[:, panel] = (context.log.seen[last, 0] - far[0] - far[1]) / np.sqrt(variance)
    return found


def log_none_shorter(context: WindowState, at: Integers, place: Floats, spread: Floats) -> Floats:
    """Log probability (N, Q) that points at `place` (N, 3) [m], within covariances `spread` (N, 3, 3) [m^2], are each
    panel, by what was heard straight over the point that is held for it, besides a track (rows `at` of the log): no
    path over a panel is shorter than its direct one, but for a resolution cell in which neighbours move it. 0 where
    none is held, or was heard for `memory` cycles."""
    log, window, scene, held = context.log, context.window, context.scene, context.landmarks.panels
    found, first = np.zeros((len(place), len(held))), context.cycle - window.num_poses + 1
    others = ~np.isin(np.arange(len(log.cycle)), at)
    for panel, point in enumerate(held):
        if point < 0:
            continue
        direct = np.array([context.landmarks.ident[point], NONE, NONE, NONE, NONE])
        rows = (others & (log.side == PANEL + panel) & (log.form[:, 0] == direct).all(axis=1)).nonzero()[0]
        if len(rows) < CONSTANTS.memory:
            continue
        slots = log.cycle[rows] - first
        pose = poses(window)[slots]
        ends = poses_of(pose[:, :3], context.heading[slots] + pose[:, 3], scene.body)
        far, slopes = _direct(np.concatenate([window.features[[point]], place]), ends)
        length, slope = far[0] + far[1], slopes[1:].mean(axis=1)
        gap = length[0] + scene.sensor.nearest(log.seen[rows, 0] - length[0]) - length[1:]
        std = np.sqrt(np.vecdot(slope, (spread @ slope[..., None])[..., 0]) + np.median(log.std[rows, 0]) ** 2)
        found[:, panel] = scipy.special.log_ndtr((np.median(gap, axis=1) + float(scene.sensor.cell_length[0])) / std)
    return found


def _direct(place: Floats, ends: Poses) -> tuple[list[Floats], Floats]:
    """Direct paths over points to be identified at `place` (..., 3) [m], from K poses: lengths (..., K) [m] of the legs
    to Tx and Rx, and the slopes (..., K, 3) of their sum by the place."""
    legs = [place[..., None, :] - end for end in (ends.tx, ends.rx)]
    far = [np.maximum(np.linalg.norm(leg, axis=-1), 1e-3) for leg in legs]
    return far, np.asarray(legs[0] / far[0][..., None] + legs[1] / far[1][..., None])


def _history(context: WindowState, at: Integers, table: Hypotheses, fits: Fits, rows: Integers) -> PanelIdentity:
    """Panel identities (scatterer or RIS panel) of the points of a track's hypotheses `rows` (R,) after its whole
    history, its components being the log's rows `at`.

    The last row stands for a panel anywhere else: amplitudes scatter as they do.
    """
    scene, window, log, count = context.scene, context.window, context.log, len(rows)
    place = poses(window)
    ends = poses_of(place[:, :3], context.heading + place[:, 3], scene.body)
    turn, shift = np.swapaxes(table.trials.turn[rows], 2, 3), table.trials.shift[rows]
    spots, ratio = spread_places(fits.place[rows], fits.held[rows]), _ratio(table, context.landmarks, rows)
    level = log.log_amplitude[at]
    anywhere = np.exp(level.mean() + max(float(level.std()), CONSTANTS.fading) * even_draws(spots.shape[1], 1)[:, 0])
    # over no panel the path has one amplitude, unknown: a point's prior, as far off as makes it as loud
    unit = float(point_amplitude(np.array(CONSTANTS.strength), np.ones(()), np.ones(()), scene.radio))
    far = np.sqrt(unit / np.exp(level.mean()))
    first = context.cycle - window.num_poses + 1
    heard = {int(log.cycle[row] - first): row for row in at}
    found = unknown(count, scene.num_panels)
    told = [code is not None for code in context.codes]
    for slots in _blocks(min(heard), told, max(1, LOOKS // count)):
        row = np.array([heard.get(slot, -1) for slot in slots])
        amplitude, side = np.exp(log.log_amplitude[row]), np.where(row >= 0, log.side[row], UNTOLD)
        tx, rx = (
            (end[slots, None, None] @ turn[:, leg]).reshape(len(slots), count, 3) + shift[:, leg]
            for leg, end in enumerate((ends.tx, ends.rx))
        )
        sight = PanelObservation(
            np.tile(spots, (len(slots), 1, 1)), tx.reshape(-1, 3), rx.reshape(-1, 3), np.tile(ratio, len(slots)),
            np.repeat(amplitude, count), np.repeat(side, count), np.repeat(row >= 0, count),
        )  # fmt: skip
        gain = gains(sight, scene.ris, _codes([context.codes[slot] for slot in slots], count), scene.radio)
        last = slice(count - 1, None, count)
        sight.tx[last] = sight.rx[last] = sight.place[last].mean(axis=1) + far * AXES[0]
        sight.ratio[last] = 1.0
        if gain is not None:
            gain[:, last] = anywhere
        found = weigh(found, sight, gain, scene.sensor)
    return found


LOOKS = 24
"""Observations weighed at a time: numpy's calls cost no more than the numbers then, which stay in the cache."""


def _blocks(first: int, told: list[bool], most: int) -> Iterator[list[int]]:
    """Cycles for the identification of points from `first` on, in blocks of at most `most` within which a phase code is
    told for all or for none."""
    slots = list(range(first, len(told)))
    while slots:
        count = next((at for at, slot in enumerate(slots) if told[slot] != told[slots[0]]), len(slots))
        yield slots[: min(count, most)]
        slots = slots[min(count, most) :]


def _codes(codes: list[RisCode | None], count: int) -> RisCode | None:
    """Phase codes of some cycles for the identification of points as one `RisCode`, each repeated for so many places;
    None where none is told."""
    index = [code.index for code in codes if code is not None]
    levels = next((code.levels for code in codes if code is not None), 0)
    return RisCode(np.repeat(np.stack(index), count, axis=0)[:, None], levels) if index else None


def _ratio(table: Hypotheses, landmarks: WindowTable, rows: Integers) -> Floats:
    """Share (R,) of the amplitude that known walls leave on the paths of hypotheses `rows`, to identify points."""
    if not len(landmarks.ident):
        return np.ones(len(rows))
    known, bounces = table.known[rows], np.where(table.kind[rows] == OVER_SAME, 2.0, 1.0)
    return np.asarray(np.exp(np.where(known >= 0, landmarks.ratio[known] * bounces, 0.0)))
