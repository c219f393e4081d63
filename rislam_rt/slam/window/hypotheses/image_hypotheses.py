"""Hypotheses of known points' images in new walls, on either leg, straight or over one known wall besides.

What makes walls known where wall returns are thrown away. On the leg to the Rx an image is a direction of its own. On
the leg to the Tx the direction stays that of the point: a longer way from where a shorter one comes. Its length alone
then tells of the wall, which for a straight motion leaves a ring of places: as many initial values stand around it.
"""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import RadioConfig
from rislam_rt.ris.path_gain import point_amplitude
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import AXES, NONE, by_wall, reflect
from rislam_rt.slam.sampling import square_roots
from rislam_rt.slam.window.hypotheses.hypotheses import (
    BOTH_LEGS,
    FAR,
    IMAGE,
    IS_FAR,
    IS_IMAGE,
    OTHER_LEG,
    THEN_WALL,
    TX_IMAGE,
    WALL_THEN,
    Hypotheses,
    KnownFeatures,
)
from rislam_rt.slam.window.hypotheses.hypothesis_fits import Trials
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.solver_limits import APART, BEARINGS, REACH


def with_images(table: Hypotheses, summary: TrackSummary, known: KnownFeatures, landmarks: WindowTable) -> Hypotheses:
    """Append hypotheses of known points' images in new walls, as far as each track's length and direction allow."""
    ways = [(point, wall) for point in landmarks.points.tolist() for wall in (NONE, *landmarks.walls.tolist())]
    more = [_in_reach(_images(summary, known, point, wall), summary, known) for point, wall in ways]
    every = [table, *more]
    trials = Trials._make(np.concatenate(fields) for fields in zip(*(each.trials for each in every), strict=True))
    kind, which, over = (np.concatenate([each[column] for each in every]) for column in range(3))
    return Hypotheses(kind, which, over, trials)


def _images(summary: TrackSummary, known: KnownFeatures, point: int, wall: int) -> Hypotheses:
    """Hypotheses that T tracks are images of one known point in a new wall, over a known wall besides, or none
    (`NONE`)."""
    (seen, _, rx), count = summary.mean, len(summary.seen)
    spot, root, still = known.place[point], known.root[point], (AXES, np.zeros(3), np.zeros((3, 3)))
    # kind; what the new wall mirrors, with its root; what stands on the other leg; the map behind the new wall
    if wall == NONE:
        ways = [(IMAGE, spot, root, spot, still), (TX_IMAGE, spot, root, spot, still)]
    else:
        turn, shift = known.turn[wall], known.shift[wall]
        mirror, around = turn @ spot + shift, (rx + seen[:, :1] * summary.direction).mean(axis=0)
        move, behind = (by_wall(at, known.place[wall], summary.middle) @ known.root[wall] for at in (spot, around))
        wide = square_roots((turn @ root @ root.T @ turn.T + move @ move.T)[None])[0]
        ways = [
            (BOTH_LEGS, spot, root, mirror, (AXES, np.zeros(3), move)),
            (THEN_WALL, mirror, wide, spot, still),
            (WALL_THEN, spot, root, spot, (turn, shift, behind)),
            (OTHER_LEG, spot, root, mirror, (turn, shift, move)),
        ]
    kinds, starts, inners, others, outers = [], [], [], [], []
    for number, inner, inner_root, other, outer in ways:
        for start in _initial_values(summary, number, inner, other, outer):
            kinds.append(number)
            starts.append(start)
            inners.append((inner, inner_root))
            others.append(other)
            outers.append(outer)
    kind, every = np.repeat(np.array(kinds), count), np.ones(len(kinds) * count, dtype=np.bool_)
    turns = [np.stack([np.zeros((3, 3)), turn]) for turn, _, _ in outers]
    shifts = [np.stack([inner, shift]) for (inner, _), (_, shift, _) in zip(inners, outers, strict=True)]
    roots = [np.stack([inner, outer]) for (_, inner), (_, _, outer) in zip(inners, outers, strict=True)]
    trials = Trials(
        np.tile(np.arange(count), len(kinds)), every, ~every, np.concatenate(starts),
        np.repeat(turns, count, axis=0), np.repeat(shifts, count, axis=0), np.repeat(roots, count, axis=0),
        ~every, ~every, np.zeros((len(every), 3, 4)), every, IS_FAR[kind], kind == BOTH_LEGS,
        np.repeat(others, count, axis=0),
    )  # fmt: skip
    return Hypotheses(kind, np.full(len(every), point), np.full(len(every), wall), trials)


def _initial_values(
    summary: TrackSummary, kind: int, inner: Floats, other: Floats, outer: tuple[Floats, Floats, Floats]
) -> list[Floats]:
    """Initial values (T, 3) of the new wall of an image hypothesis: one on the Rx leg; on the Tx leg level walls below
    and above, and upright ones all around."""
    seen, tx, rx = summary.mean
    if kind not in FAR:
        reach = np.maximum(seen[:, 0] - np.linalg.norm(other - tx, axis=1), 0.1)
        return [_mirror_of(summary, inner, (rx + reach[:, None] * summary.direction) @ outer[0].T + outer[1])]
    span = inner - tx
    reach = np.maximum(seen[:, 0] - np.linalg.norm(other - rx, axis=1), 0.1)
    rise = np.sqrt(np.maximum(reach**2 - np.vecdot(span[:, :2], span[:, :2]), 1e-4))
    across = np.sqrt(np.maximum(reach**2 - span[:, 2] ** 2, 1e-4))
    ends = [tx + np.stack([span[:, 0], span[:, 1], sign * rise], axis=1) for sign in (-1.0, 1.0)]
    for angle in np.arange(BEARINGS) * 2.0 * np.pi / BEARINGS:
        ends.append(tx + np.stack([across * np.cos(angle), across * np.sin(angle), span[:, 2]], axis=1))
    return [_mirror_of(summary, inner, end) for end in ends]


def _mirror_of(summary: TrackSummary, spot: Floats, image: Floats) -> Floats:
    """Walls (T, 3), as images of the agent's position, that mirror a point (3,) to the places (T, 3)."""
    return reflect(np.broadcast_to(summary.middle, image.shape), image, np.broadcast_to(spot, image.shape))


def _in_reach(table: Hypotheses, summary: TrackSummary, known: KnownFeatures) -> Hypotheses:
    """Drop image hypotheses whose path is longer than the track, and those on the Tx leg whose point lies in another
    direction."""
    (seen, tx, rx), track, other = summary.mean, table.trials.track, table.trials.other
    out = other[:, None] - summary.rx[track]
    reach = np.linalg.norm(out, axis=2)
    weight = summary.weight[track, :, 1:] ** 2
    total = weight.sum(axis=1)
    gap = (weight * (summary.seen[track, :, 1:] - out[..., :2] / reach[..., None])).sum(axis=1) / total
    reach = np.linalg.norm(other - rx[track], axis=1)
    spread = np.hypot(*np.linalg.norm(table.trials.uncertainty, axis=(2, 3)).T)
    spread = spread + np.linalg.norm(summary.uncertainty[track, 0], axis=(1, 2))
    std = np.sqrt(1.0 / total + (spread / reach)[:, None] ** 2)
    straight = np.linalg.norm(known.place[table.known] - tx[track], axis=1)
    leg = np.linalg.norm(other - tx[track], axis=1)
    aligned = (np.abs(gap) < REACH * std).all(axis=1) & (seen[track, 0] > reach + straight)
    keep = np.where(table.trials.far, aligned, seen[track, 0] > leg + straight)
    return table.take(keep)


def fitted_twice(table: Hypotheses, place: Floats, evidence: Floats) -> Integers:
    """Rows of image hypotheses on the Tx leg whose fit ended where that of another initial value did, with more
    evidence (H,)."""
    rows = (table.trials.far & np.isfinite(evidence)).nonzero()[0]
    rows = rows[np.argsort(-evidence[rows])]
    same = np.linalg.norm(place[rows][:, None] - place[rows], axis=-1) < APART
    for field in (table.trials.track, table.known, table.over):
        same &= field[rows][:, None] == field[rows]
    return rows[np.tril(same, -1).any(axis=1)]


def image_amplitudes(
    table: Hypotheses, summary: TrackSummary, landmarks: WindowTable, radio: RadioConfig
) -> tuple[Integers, Floats]:
    """Rows (R,) of image hypotheses, and the log density (R,) of their tracks' amplitudes; of a panel, whose amplitude
    hangs on codes, without the misfit."""
    rows = IS_IMAGE[table.kind].nonzero()[0]
    if not len(rows):
        return rows, np.zeros(0)
    track, point, over = table.trials.track[rows], table.known[rows], table.over[rows]
    first = np.maximum(np.linalg.norm(table.trials.other[rows] - summary.mean[1][track], axis=1), 0.05)
    unit = point_amplitude(np.ones(len(rows)), first, np.maximum(summary.mean[0][track, 0] - first, 0.05), radio)
    strength, uncertainty = (field[point] for field in landmarks.log_strength)
    besides = [np.where(over >= 0, field[over], 0.0) for field in (landmarks.ratio, landmarks.ratio_variance)]
    mean = np.log(unit) + strength + CONSTANTS.wall_ratio + besides[0]
    variance = uncertainty**2 + CONSTANTS.wall_ratio_std**2 + CONSTANTS.fading**2 + besides[1]
    off = np.where(np.isin(point, landmarks.panels), 0.0, summary.log_amplitude[track] - mean)
    return rows, np.asarray(-0.5 * off**2 / variance - 0.5 * np.log(variance))
