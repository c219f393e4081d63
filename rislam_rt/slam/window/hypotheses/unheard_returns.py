"""Evidence against returns over two walls, from single-bounce returns that are not heard: a new wall's own where it is
heard over a known one, or one of two unknown walls'."""

import math
from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.slam.arrival_rays import rays
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import free_space
from rislam_rt.slam.predicted_returns import poses_of, reflect
from rislam_rt.slam.window.hypotheses.hypotheses import Hypotheses
from rislam_rt.slam.window.hypotheses.hypothesis_evidence import LEVEL_RISE
from rislam_rt.slam.window.hypotheses.path_feasibility import over_known
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary
from rislam_rt.slam.window.landmarks.horizon_detection import above_within, elevations
from rislam_rt.slam.window.landmarks.measurement_prediction import detection_probability
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.smoother.window_gaussian import poses
from rislam_rt.slam.window.solver_limits import CERTAIN, STEP
from rislam_rt.slam.window.state import WindowState

LEG = 0.04
"""Difference of cosines up to which a single-bounce return may be a leg of a track's right angle, or lie along its
line."""


def log_unheard(
    context: WindowState, table: Hypotheses, track_rows: list[Integers], owner: Integers, evidence: Floats,
    place: Floats, spread: Floats, summary: TrackSummary, *, anyhow: bool,
) -> Floats:  # fmt: skip
    """Log probability (H,) that the single-bounce returns of new walls at `place` (H, 3) [m], within covariances
    `spread` (H, 3, 3) [m^2], are detected no oftener than they are; 0 for hypotheses not over a known wall.

    The return of a wall that stands `anyhow`, not upright or level, may as well arrive below the horizon, in all cycles
    or in none, as far as its place is uncertain.

    `track_rows` are the tracks' rows of the log, `owner` the track of each row of the summary, `evidence` (H,) without
    this.
    """
    found, track = np.zeros(len(table.kind)), owner[table.trials.track]
    best = np.full(len(track_rows), -np.inf)
    np.maximum.at(best, track, evidence)
    rows = (over_known(table) & (evidence > best[track] - CERTAIN)).nonzero()[0]
    if not len(rows):
        return found
    log, scene, where = context.log, context.scene, poses(context.window)
    ends = poses_of(where[:, :3], context.heading + where[:, 3], scene.body)
    slot = log.cycle - (context.cycle - len(where) + 1)
    out = reflect(ends.tx, place[rows, None], summary.middle) - ends.rx
    length = np.linalg.norm(out, axis=2)
    ray = (rotation_z(-ends.heading) @ (out / length[..., None])[..., None])[..., 0]
    doubt = 2.0 * np.sqrt(np.linalg.eigvalsh(spread[rows])[:, -1:])
    exact = doubt / np.concatenate([np.ones(doubt.shape), length[:, [-1, -1]]], axis=1)
    near = scene.sensor.cell_length + exact
    gap = scene.sensor.nearest(log.seen[:, 0] - length[:, slot])
    wall, heard = (np.abs(gap) < near[:, :1]).nonzero()
    off = log.nearest(heard, log.seen[heard, 1:] - ray[wall, slot[heard], :2], scene.radio.array.spacing)
    (cos, sin), (x, y) = (side(ends.heading)[slot[heard]] for side in (np.cos, np.sin)), off.T
    off = np.abs(np.stack([cos * x - sin * y, sin * x + cos * y], axis=1))
    inside = (off[:, 0] < near[wall, 1]) & (off[:, 1] < near[wall, 2])
    wall, heard, off = wall[inside], heard[inside], off[inside]
    present, itself = np.zeros((2, *length.shape), dtype=np.bool_)
    present[wall, slot[heard]] = True
    left = np.concatenate([np.abs(gap[wall, heard])[:, None], off], axis=1)
    fits = (left < exact[wall] + CONSTANTS.fit * log.std[heard]).all(axis=1)
    itself[wall[fits], slot[heard[fits]]] = True
    # no elevation is known to less than `STEP`
    rise, std = out[..., 2] / length, np.sqrt(spread[rows, 2, 2])[:, None] / length + STEP
    shows, deep = _shows(context, table, rows, length, summary), (-CONSTANTS.dip - rise) / std
    if not anyhow:
        shows *= deep < 0.0
    shows *= _above(context, rise, std, ray)
    for number, row in enumerate(rows.tolist()):
        mine = slot[track_rows[track[row]]]
        span = slice(mine.min(), mine.max() + 1)
        found[row] = log_missed(shows[number, span], present[number, span], itself[number, span])
        if anyhow:
            low = deep[number, span].mean()
            found[row] = np.logaddexp(scipy.special.log_ndtr(low), scipy.special.log_ndtr(-low) + found[row])
    return found


def _above(context: WindowState, rise: Floats, std: Floats, ray: Floats) -> Floats:
    """Probability (N, K) that N returns arrive above the plane of the array in each of the window's cycles, with sines
    of elevation (N, K) within deviations (N, K), along rays (N, K, 3) in the body's axes."""
    if context.scene.radio.array.pattern != "upper":
        return np.ones(rise.shape)
    returns = elevations(rise.ravel(), std.ravel(), ray[..., :2].reshape(-1, 2))
    slopes = returns.slopes.reshape(*rise.shape, 2)
    lift = np.vecdot(slopes, context.attitude[:, :2])
    variance = (slopes[..., None, :] @ context.attitude_covariance[:, :2, :2] @ slopes[..., None])[..., 0, 0]
    return above_within(returns, lift.ravel(), variance.ravel()).reshape(rise.shape)


def _shows(context: WindowState, table: Hypotheses, rows: Integers, length: Floats, summary: TrackSummary) -> Floats:
    """Detection probability (N, K) of single-bounce returns of lengths (N, K) [m] over the walls of hypotheses `rows`
    (N,), whose reflectivity follows from their tracks' amplitudes."""
    radio, track, wall = context.scene.radio, table.trials.track[rows], table.known[rows]
    told = summary.log_amplitude[track] - free_space(radio) + np.log(summary.mean[0][track, 0])
    noise = context.landmarks.ratio_variance[wall] + CONSTANTS.fading**2
    gain = CONSTANTS.wall_ratio_std**2 / (CONSTANTS.wall_ratio_std**2 + noise)
    ratio = CONSTANTS.wall_ratio + gain * (told - context.landmarks.ratio[wall] - CONSTANTS.wall_ratio)
    std = np.sqrt(gain * noise + CONSTANTS.fading**2)[:, None]
    sensor, level = context.scene.sensor, free_space(radio) - np.log(length) + ratio[:, None]
    reported = sensor.in_window(sensor.heard_as(length) / SPEED_OF_LIGHT)
    return np.asarray(CONSTANTS.shown * detection_probability(level, std, sensor) * reported)


def log_missed(shows: Floats, present: Booleans, itself: Booleans) -> float:
    """Log probability that a return with detection probabilities (K,) is missed in all cycles in which no component is
    `itself` (K,) where it would be. With probability `company` it is hidden instead in whatever is `present` (K,) in
    its cell."""
    merged, apart = log_silence(shows, present), log_silence(shows, itself)
    return float(np.logaddexp(np.log(CONSTANTS.company) + merged, np.log1p(-CONSTANTS.company) + apart))


def log_silence(shows: Floats, present: Booleans) -> float:
    """Log probability that a return with detection probabilities (K,), were nothing in its way, is missed in all cycles
    in which no component is `present` (K,) at its place; one that is there may be it, and tells nothing.

    Occlusion comes and goes as it does for every return (`landmark_update.recall_forms`).
    """
    found, clear = 0.0, CONSTANTS.steady**2
    for show, heard in zip(shows.tolist(), present.tolist(), strict=True):
        if heard:
            clear = 1.0
        else:
            found += math.log1p(-clear * show)
            clear *= (1.0 - show) / (1.0 - clear * show)
        clear = clear * (1.0 - CONSTANTS.rare) + (1.0 - clear) * CONSTANTS.cleared
    return found


def missing_legs(context: WindowState, rows: Integers, mean: Floats) -> Floats:
    """Log probability (T, 4) that so few single-bounce returns are heard beside each track, were it a return over two
    unknown walls: opposite ones, two upright ones, an upright and a level one (as `hypotheses` has them), or the floor
    and a ceiling that may slope.

    Two walls shift the Tx by the sum of what each does. At right angles, a single return of theirs is one leg of a
    right angle; something may stand in its way. Of opposite walls both come along the same line, over the very ways
    that the track goes: nothing blocks one alone, and their lengths add up to the track's. All are brighter than the
    track, the floor's is never heard, and they are compared as they are now: near a corner they change fast. Beside an
    echo over the floor the ceiling's own return is asked for by length and direction alone, however faint.
    """
    every, looked = context.tracks, bearings(context, rows, mean)
    shine = every.log_amplitude[rows[looked.track]] + np.log(looked.length)
    old = (every.hits >= 3).nonzero()[0]
    away, reach, owner = bearings(context, old, mean)
    tracks = len(away)
    shines, walls = every.log_amplitude[old[owner]] + np.log(reach), context.landmarks.walls
    if len(walls):
        place, anchor = mean[HEAD:].reshape(-1, 3)[walls], context.landmarks.anchor[walls]
        span = place - anchor
        normal = span / np.linalg.norm(span, axis=1)[:, None]
        depth = np.vecdot(0.5 * (place + anchor) - mean[:3], normal)
        away = np.concatenate([away, np.sign(depth)[:, None] * normal])
        reach = np.concatenate([reach, 2.0 * np.abs(depth)])
        shines = np.concatenate([shines, np.full(len(walls), np.inf)])
        owner = np.concatenate([owner, len(old) + np.arange(len(walls))])
    along, share = looked.ray @ away.T, reach / looked.length[:, None]
    heard = (share < 0.995) & (shines > shine[:, None] - 0.3)
    legs = np.zeros((len(rows), len(old) + len(walls)), dtype=np.bool_)
    np.logical_or.at(legs, (looked.track[:, None], owner), heard & (np.abs(along - share) < LEG))
    square = np.array([CONSTANTS.log_rare, np.log1p(-CONSTANTS.steady), 0.0])[np.minimum(legs.sum(axis=1), 2)]
    on_line, rest = heard & (np.abs(along) > 1.0 - LEG), np.abs(share[:, :, None] + share[:, None] - 1.0)
    both = (on_line[:, :, None] & on_line[:, None] & (rest < LEG) & (owner[:, None] != owner)).any(axis=(1, 2))
    opposite = np.zeros(len(rows), dtype=np.int64)
    np.maximum.at(opposite, looked.track, on_line.any(axis=1).astype(np.int64) + both)
    if context.scene.radio.array.pattern == "upper":
        opposite += looked.ray[: len(rows), 2] > 1.0 - LEG
    along_one = np.log1p(-CONSTANTS.shown) * (2 - np.minimum(opposite, 2))
    # whose own return, nearly along the track's line, may be pulled and fade: so it was not born before, or aslant
    lower = (reach < looked.length[:, None] - 2.0 * CONSTANTS.depth) & (along > 1.0 - LEG)
    ceiling = np.zeros(len(rows), dtype=np.bool_)
    np.logical_or.at(ceiling, looked.track, lower.any(axis=1))
    echo = np.where(ceiling, 0.0, np.log1p(-CONSTANTS.shown))
    scene, floor = context.scene, (away[tracks:, 2] < -LEVEL_RISE).any()
    # the floor is known or heard itself, and the map says what comes over it; or nothing is asked
    if floor or not scene.use_vt or scene.radio.array.pattern != "upper":
        echo[:] = -np.inf
    return np.stack([along_one, square, square, echo], axis=1)


class Bearings(NamedTuple):
    """Directions and lengths of some of T tracks: one of each, and a second one, behind all others, of those that the
    array hears alike from both its ends."""

    ray: Floats
    """(E, 3) directions of arrival in the room's axes."""
    length: Floats
    """(E,) [m]."""
    track: Integers
    """(E,) which of the tracks each is of."""


def bearings(context: WindowState, rows: Integers, mean: Floats) -> Bearings:
    """Directions of arrival and lengths of tracks `rows` (T,) as single-bounce returns. What is heard now from one end
    of the array, now from the other, has no mean direction: it lies on the rim, at either end."""
    tracks, log = context.tracks, context.log
    seen, count = tracks.mean[rows, :, 0], len(rows)
    at = np.isin(log.track, tracks.ident[rows]).nonzero()[0]
    order = np.argsort(tracks.ident[rows])
    which = order[np.searchsorted(tracks.ident[rows], log.track[at], sorter=order)]
    twofold = log.mostly_mirrored(at, which, count, context.scene.radio.array.spacing)
    owner = np.flatnonzero(twofold.any(axis=1))
    rim = np.sqrt(np.maximum(1.0 - seen[:, :0:-1] ** 2, 0.0))
    seen[:, 1:] = np.where(twofold, rim, seen[:, 1:])
    other = seen[owner]
    other[:, 1:] = np.where(twofold[owner], -rim[owner], other[:, 1:])
    seen = np.concatenate([seen, other])
    ray = rays(seen, float(context.heading[-1] + mean[6]))
    return Bearings(ray, np.maximum(seen[:, 0], 0.1), np.append(np.arange(count), owner))
