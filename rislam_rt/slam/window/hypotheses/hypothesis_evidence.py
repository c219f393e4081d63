"""Prior and evidence of the hypotheses of what caused a track: kind, place, amplitude, occlusion, and support by other
tracks."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.ris.path_gain import point_amplitude
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import AXES, NONE, TX
from rislam_rt.slam.window.hypotheses.hypotheses import (
    ALIGNED_TURN,
    BESIDE,
    BOTH_WAYS,
    IS_IMAGE,
    OVER_SAME,
    OVER_TX,
    POINT,
    UPRIGHT_RISE,
    WALL,
    Hypotheses,
    KnownFeatures,
)
from rislam_rt.slam.window.hypotheses.hypothesis_fits import Fits
from rislam_rt.slam.window.hypotheses.image_hypotheses import image_amplitudes
from rislam_rt.slam.window.hypotheses.path_feasibility import bounces
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.landmark_update import recall_forms
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.smoother.direction_priors import DirectionPriors
from rislam_rt.slam.window.solver_limits import CERTAIN, NEARBY
from rislam_rt.slam.window.state import WindowState

MORE_WALLS = np.array([0, 1, 1, 0, 1, 1, 2, 1, 0, 1, 1, 2, 2, 2, 2, 1])
"""Number of walls on a path of each kind beyond the one of a wall return: each takes its share of the power, and so of
the paths that are heard. Over known walls, of all walls together; of known points in walls, of all points together."""
MORE_UNKNOWN = int(MORE_WALLS.max())
"""The same of a path of none of these kinds, as many as of any of them: over walls that the map lacks. Without wall
returns most walls stay unknown: such paths are as frequent as points at least, and it counts none."""
CLOSE = 0.8
"""Gap in resolution cells below which two paths come out as one component beyond doubt."""


def log_kind(table: Hypotheses, landmarks: WindowTable) -> Floats:
    """Log prior (H,) of the kinds of hypotheses: each wall on the path costs power, and kinds over a known feature
    share their probability among all such features."""
    rivals = np.where(table.known >= 0, np.log(max(len(landmarks.walls), 1)), 0.0)
    rivals[IS_IMAGE[table.kind]] = np.log(max(len(landmarks.points), 1))
    rivals += np.where(table.over >= 0, np.log(max(len(landmarks.walls), 1)), 0.0)
    return np.asarray(2.0 * CONSTANTS.wall_ratio * MORE_WALLS[table.kind] - rivals)


def log_place(table: Hypotheses, place: Floats, middle: Floats) -> Floats:
    """Log prior density (H,) [1/m^3] of the places of hypotheses' new features: points anywhere in a ball, the shift by
    two walls in one twice as wide.

    Walls at any distance up to the ball's radius, in any direction: their places are images of the agent's, `middle`.
    """
    reach = np.maximum(np.linalg.norm(place - middle, axis=1), 2.0 * CONSTANTS.depth)
    wall = -np.log(4.0 * np.pi * reach**2 * 2.0 * CONSTANTS.size)
    return np.where(
        table.trials.is_wall, wall, -CONSTANTS.log_volume - np.where(table.trials.is_pair, np.log(8.0), 0.0)
    )


def log_beside(table: Hypotheses, summary: TrackSummary, known: KnownFeatures, context: WindowState) -> Floats:
    """Evidence (H,) of hypotheses, as log probability: a new wall's return is resolved from the return over its edge
    with a known level or upright wall, or is unresolved from it, as the hypothesis has it.

    It hangs on how far apart the two would be, and on whether that other wall is heard by itself: where it ends,
    so does its edge. To come out as one more than a cell apart takes two rare events.
    """
    landmarks, scene = context.landmarks, context.scene
    track, found = table.trials.track, np.zeros(len(table.kind))
    length, cell = summary.mean[0][track, 0], float(scene.sensor.cell_length[0])
    aligned = landmarks.walls[np.abs(known.turn[landmarks.walls, 2, 2]) > ALIGNED_TURN]
    for wall, clear in zip(aligned, _heard(context, aligned), strict=True):
        rise = float(np.linalg.norm(known.place[wall] - summary.middle))
        gap = np.hypot(length, rise) - length
        found += np.where((table.kind == WALL) & (gap < CLOSE * cell), np.log1p(-CONSTANTS.shown * clear), 0.0)
        found += np.where((table.kind == BESIDE) & (table.known == wall), np.log(clear), 0.0)
        found += np.where((table.kind == BESIDE) & (table.known == wall) & (gap > cell), CONSTANTS.log_lost, 0.0)
    return found


def _heard(context: WindowState, walls: Integers) -> Floats:
    """Probability (W,) that nothing occludes the returns of known walls, by which hypotheses are weighed."""
    forms = np.array([[TX, NONE, NONE, wall, NONE] for wall in walls], dtype=np.int64).reshape(-1, 5)
    return recall_forms(context.visibility, forms, np.ones(len(walls), dtype=np.int64), context.landmarks)[0]


def log_shared(
    table: Hypotheses, fits: Fits, evidence: Floats, none: Floats, explained: list[tuple[int, float]], middle: Floats,
    concurrent: Booleans,
) -> Floats:  # fmt: skip
    """Gain (H,) in log evidence of hypotheses whose new feature other tracks' hypotheses ask for as well.

    A second track that the same feature explains has nothing free left: instead of a density over the volume it counts
    that of one place given the other, against all else that it may be.
    """
    track, count = table.trials.track, len(none)
    total = none.copy()
    np.logaddexp.at(total, track, evidence)
    for row, value in explained:
        total[row] = np.logaddexp(total[row], value)
    best = np.full(count, -np.inf)
    np.maximum.at(best, track, evidence)
    good = np.flatnonzero(np.isfinite(evidence) & (evidence > best[track] - CERTAIN) & ~table.trials.is_pair)
    wall = table.trials.is_wall[good]
    same = (wall[:, None] == wall) & (track[good][:, None] != track[good])
    off = fits.place[good][:, None] - fits.place[good]
    same &= (np.abs(off) < NEARBY).all(axis=-1)
    way = np.stack([table.kind[good], table.known[good], table.over[good]], axis=1)
    same &= ~((way[:, None] == way).all(axis=-1) & concurrent[track[good][:, None], track[good]])
    gain = np.zeros(len(evidence))
    first, second = same.nonzero()
    if not len(first):
        return gain
    spread = fits.covariance[good[first]] + fits.covariance[good[second]]
    gap = off[first, second]
    log_same = -0.5 * np.vecdot(gap, np.linalg.solve(spread, gap[..., None])[..., 0])
    log_same -= 0.5 * np.linalg.slogdet(spread)[1] + 1.5 * np.log(2.0 * np.pi)
    log_same -= log_place(table, fits.place, middle)[good[second]]
    other = track[good[second]]
    odds = np.full((len(good), count), -np.inf)
    np.logaddexp.at(odds, (first, other), evidence[good[second]] + log_same - total[other])
    gain[good] = np.minimum(np.logaddexp(0.0, odds), CONSTANTS.max_log_ratio).sum(axis=1)
    return gain


def concurrent(context: WindowState, track_rows: list[Integers]) -> Booleans:
    """Evidence against one cause: whether each pair of T tracks (T, T), given as rows of the log, were detected in a
    common cycle."""
    cycle = context.log.cycle - context.log.cycle.min()
    heard = np.zeros((len(track_rows), cycle.max() + 1))
    for row, at in enumerate(track_rows):
        heard[row, cycle[at]] = 1.0
    return np.asarray(heard @ heard.T > 0.0)


def log_amplitudes(
    table: Hypotheses, fits: Fits, summary: TrackSummary, landmarks: WindowTable, scene: KnownEnvironment
) -> Floats:
    """Evidence of hypotheses: log density (H,) of the tracks' mean amplitudes, given walls' reflectivity and points'
    strengths."""
    radio, track = scene.radio, table.trials.track
    level, seen, rx = summary.log_amplitude[track], summary.mean[0][track], summary.mean[2][track]
    free = np.log(radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain) / (4.0 * np.pi * seen[:, 0]))
    has = (table.known >= 0) & (table.kind != BESIDE)
    ratio = np.where(has, landmarks.ratio[table.known], 0.0) if len(landmarks.ident) else np.zeros(len(track))
    variance = (
        np.where(has, landmarks.ratio_variance[table.known], 0.0) if len(landmarks.ident) else np.zeros(len(track))
    )
    mirror = free + ratio + CONSTANTS.wall_ratio
    spread = variance + CONSTANTS.wall_ratio_std**2 + CONSTANTS.fading**2
    surplus = np.maximum(level - free - 0.2, 0.0)  # a mirror does not amplify
    wall = -0.5 * (level - mirror) ** 2 / spread - 0.5 * np.log(spread) - 20.0 * surplus**2
    reach = np.linalg.norm(fits.place - rx, axis=1)
    far = np.where((table.kind == POINT) | (table.kind == OVER_TX), reach, 0.5 * seen[:, 0])
    far = np.clip(far, 0.05, np.maximum(seen[:, 0] - 0.05, 0.06))
    unit = np.log(point_amplitude(np.ones(len(far)), np.maximum(seen[:, 0] - far, 0.05), far, radio))
    bounces = np.where(table.kind == OVER_SAME, 2.0, 1.0)
    mean = unit + np.log(CONSTANTS.strength) + ratio * bounces
    spread = CONSTANTS.strength_std**2 + variance * bounces**2 + CONSTANTS.fading**2
    point = -0.5 * (level - mean) ** 2 / spread - 0.5 * np.log(spread)
    double, wide = free + 2.0 * CONSTANTS.wall_ratio, 2.0 * CONSTANTS.wall_ratio_std**2 + CONSTANTS.fading**2
    pair = -0.5 * (level - double) ** 2 / wide - 0.5 * np.log(wide) - 20.0 * surplus**2
    amplitude = np.where(table.trials.is_wall, wall, np.where(table.trials.is_pair, pair, point))
    rows, image = image_amplitudes(table, summary, landmarks, scene.radio)
    amplitude[rows] = image
    return amplitude


def log_opacity(
    table: Hypotheses, fits: Fits, summary: TrackSummary, known: KnownFeatures, context: WindowState
) -> tuple[Floats, Floats]:
    """Log priors (H,) of hypotheses by occlusion: of new features behind known walls, and of new walls that are wide
    in front of known features (`log_wide_or_small`).

    A wall that is heard hides what is behind it but for a rare event; one that is not heard may have ended. With wall
    returns a new wall that is heard over a known one stands where its path meets it.
    """
    landmarks, use_vt = context.landmarks, context.scene.use_vt
    middle, walls, wall = summary.middle, landmarks.walls, table.trials.is_wall
    pair, tx = table.trials.is_pair[:, None], summary.mean[1][table.trials.track]
    image = (table.trials.turn[:, 0] @ tx[..., None])[..., 0] + fits.place
    # the last of two walls is somewhere on the ray to the image of both: as far as a single wall would be
    foot = np.where(wall[:, None], 0.5 * (fits.place + middle), np.where(pair, 0.5 * (image + middle), fits.place))
    if use_vt:
        rows, spot = bounces(table, fits.place, summary, known)
        foot[rows] = spot
    slack = CONSTANTS.depth + 2.0 * np.sqrt(np.trace(fits.held, axis1=1, axis2=2))
    behind, before = np.zeros(len(foot)), np.zeros(len(foot), dtype=np.int64)
    span = fits.place - middle
    normal = span / np.maximum(np.linalg.norm(span, axis=1), 1e-6)[:, None]
    if len(walls):
        out = known.place[walls] - middle
        reach = np.linalg.norm(out, axis=1)
        feet = 0.5 * (known.place[walls] + middle)
        depth = foot @ (out / reach[:, None]).T - np.vecdot(feet, out) / reach
        opaque = np.log1p(-(1.0 - CONSTANTS.rare) * _heard(context, walls)) if use_vt else CONSTANTS.log_rare
        behind += (opaque * (depth > np.minimum(slack, 1.0)[:, None])).sum(axis=1)
        depth = normal @ feet.T - np.vecdot(foot, normal)[:, None]
        before = (depth > np.minimum(slack, 1.0)[:, None]).sum(axis=1)
    if len(landmarks.points):
        depth = normal @ known.place[landmarks.points].T - np.vecdot(foot, normal)[:, None]
        before = before + (depth > np.minimum(slack, 1.0)[:, None]).sum(axis=1)
    return behind, np.where(wall, CONSTANTS.log_rare, 0.0) * before


def log_wide_or_small(table: Hypotheses, log_wide: Floats) -> Floats:
    """Log probability (H,) of what new walls hide and of where they are not heard, of which `log_wide` is that of wide
    ones; of other features `log_wide` itself.

    A new wall is rarely small, a face of a piece of furniture: all else may then be beside it, and its own bounce may
    miss it for good.
    """
    small = np.logaddexp(np.log1p(-CONSTANTS.rare) + log_wide, CONSTANTS.log_rare)
    return np.where(table.trials.is_wall, small, log_wide)


LEVEL_RISE = 0.9
"""Vertical share of the way to a wall's image above which the wall may be level."""


def direction_beliefs(place: Floats, middle: Floats, others: Floats, acute: Floats | None = None) -> DirectionPriors:
    """Direction priors of a hypothesis's wall, the image `place` (3,) [m] of `middle` (3,), whose images in known walls
    are `others` (W, 3): upright, at right angles to one of them, or level. To an upright or level wall that it is met
    with in both orders, and that lies in direction `acute` (3,), it is at no right angle. The other wall is a row of
    `others`, of no `base` as yet."""
    span = place - middle
    reach = max(float(np.linalg.norm(span)), 0.1)
    rise, std = abs(span[2]) / reach, CONSTANTS.lean * reach
    axes: list[Floats] = []
    log_odds: list[float] = []
    to = AXES[:0, 0].astype(np.int64)
    if rise > LEVEL_RISE:
        axes += [AXES[0], AXES[1]] if acute is None else _along(acute)
        log_odds += len(axes) * [CONSTANTS.log_upright + np.log(reach)]
    elif rise < UPRIGHT_RISE and (acute is None or abs(acute[2]) < UPRIGHT_RISE):
        axes.append(AXES[2])
        log_odds.append(CONSTANTS.log_upright + np.log(reach))
        if acute is None:
            _, square, to = _square_axes(span[None], others - middle)
            axes += list(square)
            log_odds += [float(_log_square(np.asarray(reach)))] * len(square)
    count = len(axes)
    other = np.append(np.full(count - len(to), -1), to)
    return DirectionPriors(
        np.zeros(count, dtype=np.int64), other, np.array(axes).reshape(count, 3), np.tile(middle, (count, 1)),
        np.zeros((count, 3)), np.full(count, std), np.array(log_odds), np.full(count, 0.5),
    )  # fmt: skip


def _along(acute: Floats) -> list[Floats]:
    """Level axis along an upright wall in direction `acute` (3,), along which what meets it at an acute angle may be
    level; none along a level one."""
    flat = float(np.hypot(acute[0], acute[1]))
    return [np.array([-acute[1], acute[0], 0.0]) / flat] if flat > UPRIGHT_RISE else []


def _square_axes(span: Floats, others: Floats) -> tuple[Integers, Floats, Integers]:
    """Upright walls, of N with images at `span` (N, 3), that are nearly parallel or at right angles to one of `others`
    (W, 3): rows (A,), the axes (A, 3) along which their images do not lie if they exactly are, and rows (A,) of these
    others."""
    upright = (np.linalg.norm(others[:, :2], axis=1) > 0.95 * np.linalg.norm(others, axis=1)).nonzero()[0]
    flat = others[upright]
    if not len(flat):
        return upright, np.zeros((0, 3)), upright
    own = np.arctan2(span[:, 1], span[:, 0])
    off = np.arctan2(flat[:, 1], flat[:, 0]) - own[:, None]
    off = (off + np.pi / 4.0) % (np.pi / 2.0) - np.pi / 4.0
    best = np.argmin(np.abs(off), axis=1)
    off = off[np.arange(len(own)), best]
    rows = (np.abs(off) < 0.15).nonzero()[0]
    aim = own[rows] + off[rows]
    return rows, np.stack([-np.sin(aim), np.cos(aim), np.zeros(len(aim))], axis=1), upright[best[rows]]


def _log_square(reach: Floats) -> Floats:
    """Prior log odds that a hypothesis's wall at distance `reach` [m] is at right angles to another, times the width
    [m] of the prior if it is not."""
    return np.asarray(np.log(CONSTANTS.square / (1.0 - CONSTANTS.square)) + np.log(np.pi / 2.0 * reach))


class HeldWalls(NamedTuple):
    """Effect of direction priors on H hypotheses: gain in evidence, and new walls' places if they are upright or
    level."""

    gain: Floats
    """(H,) gain in log evidence."""
    place: Floats
    """(H, 3) [m] of new walls, given that they are upright or level..."""
    covariance: Floats
    """(H, 3, 3) [m^2] ...the covariances then..."""
    log_odds: Floats
    """(H,) ...and the log odds that they are."""


def log_upright(
    table: Hypotheses, fits: Fits, summary: TrackSummary, known: KnownFeatures, landmarks: WindowTable, use_vt: bool
) -> HeldWalls:
    """Gain in log evidence of new walls by the directions that walls have beforehand (upright, level, at right angles
    to another, or any), and their places given these.

    Without wall returns, where single walls are never born, what slants counts as the rest does, and level is asked
    along each axis: rivals that are rarer let ghosts of points through.
    """
    trials, pair, spread = table.trials, table.trials.is_pair, fits.covariance
    held = HeldWalls(np.zeros(len(pair)), fits.place.copy(), spread.copy(), np.full(len(pair), -np.inf))
    turn, tx = trials.turn[:, 0], summary.mean[1][trials.track]
    # what two walls do together goes across them both; an edge under the ceiling: any elevation
    mirror = (turn @ tx[..., None])[..., 0] - tx
    span = fits.place - summary.middle + np.where(pair[:, None], summary.middle + mirror, 0.0)
    asked = np.isfinite(fits.cost) & np.where(pair, turn[:, 2, 2] >= 0.0, trials.is_wall)
    reach = np.maximum(np.sqrt(np.vecdot(span, span)), 0.1)
    rise, width = np.abs(span[:, 2]) / reach, np.log(reach)
    noise, sure = (CONSTANTS.lean * reach) ** 2, float(np.logaddexp(0.0, CONSTANTS.log_upright))
    level, upright = asked & (rise > LEVEL_RISE), asked & (rise < UPRIGHT_RISE)
    free = np.zeros(len(pair))
    if use_vt:
        free[asked] = _log_pitch(span[asked], reach[asked], spread[asked])
        held.gain[asked & ~level & ~upright] = free[asked & ~level & ~upright] - sure
    # odds hold the width: right against a density of one over it
    for rows, told in ((level.nonzero()[0], slice(2)), (upright.nonzero()[0], slice(2, 3))):
        off, across = span[rows, told], spread[rows, told]
        inside = across[..., told] + noise[rows, None, None] * AXES[told, told]
        if use_vt:  # along both axes at once
            weight = np.linalg.solve(inside, off[..., None])[..., 0]
            each = CONSTANTS.log_upright + off.shape[1] * width[rows] - 0.5 * np.vecdot(off, weight)
            each = (each - 0.5 * np.linalg.slogdet(2.0 * np.pi * inside)[1])[:, None]
        else:
            each = log_right(CONSTANTS.log_upright + width[rows, None], off, np.diagonal(inside, axis1=1, axis2=2))
        held.gain[rows] = (np.logaddexp(free[rows, None], each) - sure).sum(axis=1)
        own = ~pair[rows]
        rows, across, off = rows[own], across[own], off[own]
        pull = np.swapaxes(np.linalg.solve(inside[own], across), 1, 2)
        held.place[rows] -= (pull @ off[..., None])[..., 0]
        held.covariance[rows] -= pull @ across
        held.log_odds[rows] = each[own, 0] - free[rows]
    rows = (upright & ~(pair & (turn[:, 0, 0] < 0.0))).nonzero()[0]
    square, axis, _ = _square_axes(span[rows], known.place[landmarks.walls] - summary.middle)
    rows = rows[square]
    variance = np.vecdot(axis, (spread[rows] @ axis[..., None])[..., 0]) + noise[rows]
    each = log_right(_log_square(reach[rows]), np.vecdot(axis, span[rows]), variance)
    each[table.kind[rows] == BOTH_WAYS] = -np.inf  # an acute angle
    held.gain[rows] += np.logaddexp(0.0, each) - sure
    return held


def _log_pitch(span: Floats, reach: Floats, spread: Floats) -> Floats:
    """Log prior (N,) of walls that are neither upright nor level, with images at `span` (N, 3) [m] and so far off,
    within covariances (N, 3, 3), against one by which all directions are alike: all pitches are, from level to upright.
    Gentle slopes are no rarer than steep ones, though there are fewer directions of them."""
    flat = np.vecdot(span[:, :2], span[:, :2]) + np.trace(spread[:, :2, :2], axis1=1, axis2=2)
    return np.asarray(-np.log(0.5 * np.pi * np.clip(np.sqrt(flat) / reach, CONSTANTS.lean, 1.0)))


def log_right(log_odds: Floats, off: Floats, variance: Floats) -> Floats:
    """Posterior log odds that a direction prior holds of a hypothesis's wall, from the prior ones and the offset [m] of
    the wall's image with its variance [m^2]."""
    return np.asarray(log_odds - 0.5 * off**2 / variance - 0.5 * np.log(2.0 * np.pi * variance))
