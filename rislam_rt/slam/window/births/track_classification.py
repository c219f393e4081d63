"""Track classification: the posterior over all hypotheses of what caused a track, each with at most one new feature."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import AXES, NONE, TX
from rislam_rt.slam.window.hypotheses.hypotheses import (
    BESIDE,
    BOTH_WAYS,
    IS_IMAGE,
    TWO_WALLS,
    UPRIGHT_RISE,
    WALL,
    WALLS,
    Hypotheses,
    KnownFeatures,
    hypotheses,
)
from rislam_rt.slam.window.hypotheses.hypothesis_evidence import (
    LEVEL_RISE,
    MORE_UNKNOWN,
    concurrent,
    direction_beliefs,
    log_amplitudes,
    log_beside,
    log_kind,
    log_opacity,
    log_place,
    log_shared,
    log_upright,
    log_wide_or_small,
)
from rislam_rt.slam.window.hypotheses.hypothesis_fits import Fits, smooth_paths, try_all
from rislam_rt.slam.window.hypotheses.image_hypotheses import fitted_twice, with_images
from rislam_rt.slam.window.hypotheses.path_feasibility import log_possible
from rislam_rt.slam.window.hypotheses.point_identification import identify
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary
from rislam_rt.slam.window.hypotheses.unheard_returns import log_unheard
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.ris_identification import PanelIdentity, unknown
from rislam_rt.slam.window.smoother.direction_priors import DirectionPriors, no_holds
from rislam_rt.slam.window.solver_limits import CERTAIN
from rislam_rt.slam.window.state import WindowState


class TrackDecision(NamedTuple):
    """Decision on what caused a track: the best hypothesis, its probability, and the new feature that it asks for."""

    kind: int
    """Number in `hypotheses.KINDS`; -1: a path of no kind there."""
    probability: float
    """Posterior probability of the hypothesis, with all others that put the same feature in the same place."""
    known: int
    """Row of the known wall or point, -1 for none."""
    over: int
    """Row of a second known wall, on the path of a known point's image, -1 for none."""
    place: Floats
    """(3,) [m] of the new feature."""
    covariance: Floats
    """(3, 3) [m^2] of that, the poses held fixed."""
    holds: DirectionPriors
    """Direction priors of the new feature, whose row in them is 0."""
    share: float
    """Weight of the second of two unresolved returns: over the edge with a known wall, or in the other order."""
    misfit: float
    """Standard deviations by which the fit's cost exceeds what noise makes it."""
    identity: PanelIdentity
    """(1,) panel identity, if it is a point."""
    length: float
    """[m] of its path."""

    @property
    def form(self) -> tuple[int, int, int, int, int]:
        """Form of the track's path as five feature rows, with `NEW` for the new feature."""
        held = {KNOWN: self.known, OVER: self.over}
        base, *walls = (held.get(part, part) for part in _TEMPLATES[self.kind])
        return base, walls[0], walls[1], walls[2], walls[3]

    @property
    def is_wall(self) -> bool:
        """Whether the new feature of a track that was classified is a wall."""
        return self.kind in WALLS

    @property
    def is_return(self) -> bool:
        """Whether the track was classified as a wall return, a path over walls alone."""
        return self.kind >= 0 and _TEMPLATES[self.kind][0] == TX


NEW = -5
"""Stands in a form for the new feature."""
KNOWN = -6
"""Stands in a form's template for the known wall, or the known point."""
OVER = -7
"""Stands in a form's template for the second known wall, on the path of a known point's image."""
_TEMPLATES = (
    (TX, NONE, NONE, NEW, NONE), (TX, NONE, NONE, KNOWN, NEW), (TX, NONE, NONE, NEW, KNOWN),
    (NEW, NONE, NONE, NONE, NONE), (NEW, NONE, NONE, KNOWN, NONE), (NEW, KNOWN, NONE, NONE, NONE),
    (NEW, KNOWN, NONE, KNOWN, NONE), (TX, NONE, NONE, NONE, NONE),
    (TX, NONE, NONE, NEW, NONE), (KNOWN, NONE, NONE, NEW, NONE), (KNOWN, NEW, NONE, NONE, NONE),
    (KNOWN, OVER, NONE, NEW, NONE), (KNOWN, NONE, NONE, OVER, NEW), (KNOWN, NONE, NONE, NEW, OVER),
    (KNOWN, NEW, NONE, OVER, NONE), (TX, NONE, NONE, KNOWN, NEW),
)  # fmt: skip
"""Template of the form of each kind of hypothesis, in the order of `hypotheses.KINDS`."""


def _weigh(
    context: WindowState, track_rows: list[Integers], summary: TrackSummary, owner: Integers, known: KnownFeatures,
    lonely: Floats,
) -> tuple[Hypotheses, Fits, Floats, Floats, Booleans]:  # fmt: skip
    """Fit all hypotheses of what caused T tracks, of which `owner` (E,) tells each summary's; returns them, fits, log
    evidences (H,), path lengths (H,) [m], as heard or whole periods of the sounding more, and which (H,) are oblique.
    """
    landmarks, scene, near = context.landmarks, context.scene, len(owner)
    if scene.use_vt:  # without wall returns a longer way is one more thing that a point's track may be, and never born
        summary, end = summary.farther(scene.sensor)
        owner = owner[end]
    table = hypotheses(summary, known, landmarks, both_ways=scene.use_vt)
    if len(owner) > near:
        table = table.take((table.trials.track < near) | table.trials.is_wall | table.trials.is_pair)
    if not scene.use_vt:  # wall returns tell no walls
        table = with_images(table, summary, known, landmarks)
    fits = try_all(table.trials, summary)
    track = table.trials.track
    evidence = fits.log_evidence + log_place(table, fits.place, summary.middle)
    evidence += log_kind(table, landmarks)
    # of what is heard too early, single returns may lie beyond the window
    evidence += np.where(table.trials.is_pair & (track < near), lonely[owner[track], table.pair], 0.0)
    behind, before = log_opacity(table, fits, summary, known, context)
    wide = log_wide_or_small(table, before)
    evidence += log_amplitudes(table, fits, summary, landmarks, scene) + behind + wide
    evidence += log_beside(table, summary, known, context)
    evidence -= np.log(np.bincount(owner[:near]))[owner[track]]
    best = np.full(len(track_rows), -np.inf)
    np.maximum.at(best, owner[track], np.where(np.isfinite(fits.cost), evidence, -np.inf))
    # so far behind nothing counts any more, whatever else speaks for it
    fits = fits._replace(cost=np.where(evidence < best[owner[track]] - 2.0 * CERTAIN, np.inf, fits.cost))
    held = log_upright(table, fits, summary, known, landmarks, scene.use_vt)
    evidence = np.where(np.isfinite(fits.cost), evidence + held.gain, -np.inf)
    oblique = _is_oblique(table, fits, summary, known)
    if scene.use_vt:
        cell = scene.sensor.cell_length[1:]
        right = held.log_odds + log_possible(table, held.place, held.covariance, summary, known, cell)
        right[oblique] = -np.inf
        free = log_possible(table, fits.place, fits.covariance, summary, known, cell)
        likely = evidence + np.logaddexp(right, free)
        heard = context, table, track_rows, owner, likely
        silent = log_unheard(*heard, held.place, held.covariance, summary, anyhow=False)
        right += log_wide_or_small(table, before + silent) - wide
        silent = log_unheard(*heard, fits.place, fits.covariance, summary, anyhow=True)
        free += log_wide_or_small(table, before + silent) - wide
        evidence += np.logaddexp(right, free) - np.logaddexp(held.log_odds, 0.0)
    evidence[fitted_twice(table, fits.place, evidence)] = -np.inf
    own = table._replace(trials=table.trials._replace(track=owner[track]))
    return own, fits, evidence, summary.mean[0][track, 0], oblique


def _is_oblique(table: Hypotheses, fits: Fits, summary: TrackSummary, known: KnownFeatures) -> Booleans:
    """Which hypotheses (H,) are of a wall that is neither upright nor level for certain: it is met in both orders with
    a known one that is, to which it is not at right angles, and one of the two is not upright."""
    found, rows = np.zeros(len(table.kind), dtype=np.bool_), (table.kind == BOTH_WAYS).nonzero()[0]
    new, old = (_directions(place - summary.middle) for place in (fits.place[rows], known.place[table.known[rows]]))
    steep = (np.abs(np.stack([new[:, 2], old[:, 2]])) > UPRIGHT_RISE).any(axis=0)
    found[rows] = steep & _is_aligned(old)
    return found


def _directions(span: Floats) -> Floats:
    """Unit vectors (N, 3) along ways (N, 3) to walls of hypotheses."""
    return np.asarray(span / np.maximum(np.linalg.norm(span, axis=-1, keepdims=True), 1e-6))


def _is_aligned(direction: Floats) -> Booleans:
    """Whether hypotheses' known walls in these directions (..., 3) are upright or level, within `dip`."""
    across = np.hypot(direction[..., 0], direction[..., 1])
    return np.asarray(np.minimum(np.abs(direction[..., 2]), across) < CONSTANTS.dip)


def decide_tracks(
    context: WindowState, track_rows: list[Integers], summary: TrackSummary, owner: Integers, known: KnownFeatures,
    told: list[tuple[int, float, int]], lonely: Floats, beside: Floats,
) -> tuple[list[TrackDecision], Floats]:  # fmt: skip
    """Decide what caused each of T tracks, and return the decisions with the posteriors (E,) of the explanations by the
    map.

    Of these `told` gives track, log evidence, and the number of the panel that they run over, -1 for none.

    `track_rows` are the tracks' rows of the log, `owner` (E,) the track of each summary; `lonely` (T, 4) is the log
    probability that so few single-bounce returns are heard beside a return over two unknown walls of each kind of pair,
    `beside` (T,) the log odds that its direction speaks for a path over unknown walls.
    """
    landmarks, scene = context.landmarks, context.scene
    table, fits, evidence, length, oblique = _weigh(context, track_rows, summary, owner, known, lonely)
    track = table.trials.track
    over = identify(context, track_rows, table, fits, evidence)
    evidence += over.gain
    for number, panel in enumerate(landmarks.panels):
        if panel >= 0:
            evidence += np.where(IS_IMAGE[table.kind] & (table.known == panel), over.elsewhere[track, number], 0.0)
    summary = summary.take(np.arange(len(track_rows)))
    smooth, _ = smooth_paths(summary)
    none = smooth + log_no_kind(summary.mean[0], scene.use_vt) + beside
    over_panels = np.logaddexp.reduce(over.elsewhere, axis=1) - np.log(scene.num_panels)
    none += np.logaddexp(np.log1p(-CONSTANTS.panels), np.log(CONSTANTS.panels) + over_panels)
    explained = [(row, value + (over.elsewhere[row, panel] if panel >= 0 else 0.0)) for row, value, panel in told]
    evidence += log_shared(table, fits, evidence, none, explained, summary.middle, concurrent(context, track_rows))
    echo = log_echo_over_floor(table, fits, evidence, summary.middle, lonely)
    decisions, shares, nobody = [], np.zeros(len(explained)), unknown(1, scene.num_panels)
    for row in range(len(summary.seen)):
        own = (track == row).nonzero()[0]
        own_told = [i for i, (which, _) in enumerate(explained) if which == row]
        weight = np.concatenate([[none[row]], evidence[own], [explained[i][1] for i in own_told]])
        total = np.logaddexp(np.logaddexp.reduce(weight), echo[row])
        shares[own_told] = np.exp(weight[1 + len(own) :] - total)
        best = int(np.argmax(weight[: 1 + len(own)]))
        same = _alike(table, fits, own, own[best - 1]) if best else np.zeros(0, dtype=np.bool_)
        weighed = np.append(weight[best], weight[1 : 1 + len(own)][same])
        probability = float(np.exp(np.logaddexp.reduce(weighed) - total))
        if best == 0:
            decisions.append(
                TrackDecision(-1, probability, -1, -1, np.zeros(3), AXES, no_holds(), 0.0, 0.0, nobody, 0.0)
            )
            continue
        at = _cautious(oblique, own, evidence, same, own[best - 1])
        count = int((summary.weight[row, :, 0] > 0.0).sum())
        mean, std = cost_under_noise(CONSTANTS.tail)
        misfit = (fits.cost[at] - mean * (count - 1.0)) / (std * np.sqrt(count))
        decisions.append(
            TrackDecision(
                int(table.kind[at]), probability, int(table.known[at]), int(table.over[at]), fits.place[at],
                fits.held[at],
                _holds(table, fits.place[at], summary.middle, known, landmarks, at),
                float(fits.share[at]), float(misfit), over.identity.take(np.array([at])), float(length[at]),
            )
        )  # fmt: skip
    return decisions, shares


def log_echo_over_floor(table: Hypotheses, fits: Fits, evidence: Floats, middle: Floats, lonely: Floats) -> Floats:
    """Log evidence (T,), to classify tracks, of what comes over the floor and a lower ceiling, which changes its length
    nearly as the single return of a wall nearly overhead does: of a wall on the path more, beside which the ceiling's
    own return should be heard (`lonely`).

    Of level ceilings `TWO_WALLS` says so; where the ceiling slopes, the two walls are neither opposite nor at right
    angles.
    """
    span = fits.place - middle
    above = np.isin(table.kind, (WALL, BESIDE)) & (span[:, 2] > LEVEL_RISE * np.linalg.norm(span, axis=1))
    found = np.full(len(lonely), -np.inf)
    np.logaddexp.at(found, table.trials.track[above], evidence[above])
    return np.asarray(found + 2.0 * CONSTANTS.wall_ratio + lonely[:, 3])


def log_no_kind(seen: Floats, use_vt: bool) -> Floats:
    """Log prior density (T,), to classify tracks, that they are paths of none of the listed kinds, from length [m] and
    two cosines (T, 3).

    They seem to come from anywhere in the ball of places, half as far off as they are long. With wall returns they run
    over walls that the map lacks; without, where most walls stay unknown, they are as frequent as points.
    """
    up = np.sqrt(np.maximum(1.0 - seen[:, 1] ** 2 - seen[:, 2] ** 2, 0.01))
    share = 2.0 * CONSTANTS.wall_ratio * (MORE_UNKNOWN if use_vt else 0)
    return np.asarray(np.log(seen[:, 0] ** 2 / (8.0 * up)) - CONSTANTS.log_volume + share)


def _alike(table: Hypotheses, fits: Fits, own: Integers, at: int) -> Booleans:
    """Which of a track's other hypotheses `own` put the same kind of feature where hypothesis `at` has it, so that only
    the known wall on the path is in question (before or after, where two stand at right angles)."""
    wall, pair = table.trials.is_wall, table.trials.is_pair | table.trials.far
    if pair[at]:
        return np.zeros(len(own), dtype=np.bool_)
    gap, spread = fits.place[own] - fits.place[at], fits.covariance[own] + fits.covariance[at]
    near = np.vecdot(gap, np.linalg.solve(spread, gap[..., None])[..., 0]) < 1.0
    return np.asarray(near & (wall[own] == wall[at]) & ~pair[own] & np.isfinite(fits.cost[own]) & (own != at))


def _holds(
    table: Hypotheses, place: Floats, middle: Floats, known: KnownFeatures, landmarks: WindowTable, at: int
) -> DirectionPriors:
    """Direction priors of a new wall at `place` (3,) by hypothesis `at`: where it is met in both orders with an upright
    or level wall, none that it is at right angles to that or any other."""
    if not table.trials.is_wall[at]:
        return no_holds()
    out = _directions(known.place[table.known[at]] - middle) if table.kind[at] == BOTH_WAYS else None
    acute = out if out is not None and _is_aligned(out) else None
    found, walls = direction_beliefs(place, middle, known.place[landmarks.walls], acute), landmarks.walls
    other = np.append(walls, -1)[found.other]
    return found._replace(other=other, base=np.concatenate([landmarks.anchor, np.zeros((1, 3))])[other])


def _cautious(oblique: Booleans, own: Integers, evidence: Floats, same: Booleans, at: int) -> int:
    """Hypothesis by which a track's feature enters the map: `at`, the likeliest, or, of others that are the `same`, the
    likeliest `oblique` one (H,), if its share among these is more than `born` leaves for all that is not held for true.
    """
    slopes = own[same & oblique[own]]
    if oblique[at] or not len(slopes):
        return at
    log_all = np.logaddexp.reduce(np.append(evidence[own[same]], evidence[at]))
    best = slopes[np.argmax(evidence[slopes])]
    return int(best if evidence[best] - log_all > np.log1p(-CONSTANTS.born) else at)


@lru_cache(maxsize=4)
def cost_under_noise(tail: float) -> tuple[float, float]:
    """Mean and standard deviation of a fit's cost per measurement under noise alone, by which tracks are classified:
    `(tail + 3) log(1 + chi^2 / tail)` for chi^2 with 3 degrees of freedom, by Gauss-Laguerre quadrature."""
    half, weight = scipy.special.roots_genlaguerre(64, 0.5)
    cost, weight = (tail + 3.0) * np.log1p(2.0 * half / tail), weight / weight.sum()
    mean = float(weight @ cost)
    return mean, float(np.sqrt(weight @ (cost - mean) ** 2))


def is_clear(decision: TrackDecision, log_ratio: float = 0.0) -> bool:
    """Whether a decision is clear enough for its feature to enter the map: likely, a fit, and located well enough to be
    linearised; `log_ratio` is a log likelihood ratio of further evidence for it."""
    if decision.kind < 0 or decision.kind == TWO_WALLS:
        return False
    holds = decision.holds
    information = np.linalg.inv(decision.covariance) + (holds.axis.T / holds.std**2) @ holds.axis
    worst = np.sqrt(1.0 / np.linalg.eigvalsh(information)[0])
    odds = decision.probability / max(1.0 - decision.probability, 1e-12)
    return bool(
        np.log(odds) + log_ratio > CONSTANTS.log_born
        and decision.misfit < CONSTANTS.fit
        and worst < 0.1 * decision.length
    )
