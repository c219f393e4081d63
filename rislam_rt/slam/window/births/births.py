"""Births: tracks whose cause is clear become new features of the map, or measurements of the features that there
are."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import PANEL
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.window import tracks
from rislam_rt.slam.window.births.feature_removal import remove_from_map, resolve
from rislam_rt.slam.window.births.track_classification import NEW, TrackDecision, decide_tracks, is_clear
from rislam_rt.slam.window.cycle_association import CycleAssociation
from rislam_rt.slam.window.hypotheses.hypotheses import BESIDE, BOTH_WAYS, known_features
from rislam_rt.slam.window.hypotheses.map_explanations import explanations
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary, summarise_tracks
from rislam_rt.slam.window.hypotheses.unheard_returns import bearings, missing_legs
from rislam_rt.slam.window.landmarks.landmark_table import enter, idents
from rislam_rt.slam.window.landmarks.landmark_update import add_clear_paths
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.landmarks.ris_identification import PanelIdentity
from rislam_rt.slam.window.motion import motion_agreement
from rislam_rt.slam.window.smoother import window_features, window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.solver_limits import ALIGNED, STRIDE
from rislam_rt.slam.window.state import WindowState


def births(context: WindowState, view: CycleAssociation) -> WindowState:
    """Examine the tracks that are due for a birth: those that known features explain are associated with these, and of
    the others the shortest with a clear decision adds a feature to the map."""
    rows = tracks.due(context.tracks, context.cycle)
    if not len(rows) or (context.cycle % STRIDE and context.cycle > 12):
        return context
    names = context.tracks.ident[rows]
    track_rows = [((context.log.track == name) & ~context.log.explained).nonzero()[0] for name in names]
    full = [place for place, at in enumerate(track_rows) if len(at) >= 5]
    if not full:
        return context
    rows, track_rows = rows[full], [track_rows[place] for place in full]
    mean, covariance = window_gaussian.now(context.window)
    known = known_features(mean[HEAD:].reshape(-1, 3), covariance[HEAD:, HEAD:], context.landmarks, mean[:3])
    histories, owner = summarise_tracks(context, track_rows)
    told = explanations(context, rows, histories, owner, view, mean, covariance)
    panels = context.landmarks.panels
    lonely = missing_legs(context, rows, mean)
    beside = (
        np.zeros(len(rows)) if context.scene.use_vt else _log_same_direction(context, rows, track_rows, histories, mean)
    )
    bases = [int(one.forms[0, 0]) for one in told]
    over = [(one.track, one.log_evidence, panels.index(base) if base >= 0 and base in panels else -1)
            for one, base in zip(told, bases, strict=True)]  # fmt: skip
    decisions, shares = decide_tracks(context, track_rows, histories, owner, known, over, lonely, beside)
    gone = np.zeros(len(context.tracks.ident), dtype=np.bool_)
    looked, returns = context.tracks.looked.copy(), context.scene.use_vt
    for (row, _, forms, part), share in zip(told, shares, strict=True):
        if share > CONSTANTS.born:
            if not returns and forms[0, 0] == TX:  # what it is is known, and that is all it is asked for
                gone[rows[row]] = True
                continue
            named = idents(context.landmarks, forms)
            if not _taken(context, track_rows[row], named[0]):
                context = _assign(context, track_rows[row], named, histories.scatter[row], part)
                gone[rows[row]] = True
    born = -1
    for row, decision in enumerate(decisions):
        if gone[rows[row]]:
            continue
        if not returns and decision.is_return:
            looked[rows[row]] = context.tracks.hits[rows[row]]
            continue
        if born < 0 and is_clear(decision):
            context, fine = _enter(context, track_rows[row], decision, histories, row)
            if fine:
                born, gone[rows[row]] = row, True
                continue
        elif born >= 0 and is_clear(decision):
            continue  # its turn comes in the next cycle, with the new feature known
        looked[rows[row]] = context.tracks.hits[rows[row]]
    context = context._replace(tracks=context.tracks._replace(looked=looked).keep(~gone))
    return context if born < 0 else _without_rival(context, decisions[born].identity, panels)


def _log_same_direction(
    context: WindowState, rows: Integers, track_rows: list[Integers], histories: TrackSummary, mean: Floats
) -> Floats:
    """Log odds (T,) that tracks are paths over unknown walls on the Tx leg, against all else, as a shorter path arrives
    from the same direction.

    A wall on the Tx leg alone changes the length and not the direction: the point itself is heard there as well.
    """
    old = (context.tracks.hits >= 3).nonzero()[0]
    away, reach, owner = bearings(context, old, mean)
    points, panels = context.landmarks.points, np.array(context.landmarks.panels)
    span = mean[HEAD:].reshape(-1, 3)[points] - mean[:3]
    far = np.linalg.norm(span, axis=1)
    away, reach = np.concatenate([away, span / np.maximum(far, 0.05)[:, None]]), np.append(reach, 2.0 * far)
    panel = np.append(context.tracks.side[old[owner]] >= PANEL, np.isin(points, panels[panels >= 0]))
    ray, length = (field[: len(rows)] for field in bearings(context, rows, mean)[:2])
    variance = (histories.weight[: len(rows), :, 1:] ** 2).sum(axis=1) ** -1.0 + CONSTANTS.lean**2
    gap = ray[:, None, :2] - away[None, :, :2]
    log_odds = -0.5 * (gap**2 / variance[:, None]).sum(axis=-1) - 0.5 * np.log(variance).sum(axis=1)[:, None]
    log_odds += np.log(np.maximum(ray[:, 2], 0.1))[:, None]  # against any direction of the half sphere
    over_panel = np.array([bool((context.log.side[at] >= PANEL).all()) for at in track_rows])
    shorter = (reach < length[:, None] - CONSTANTS.depth) & (panel | ~over_panel[:, None])
    odds = np.where(shorter, np.exp(np.minimum(log_odds, 20.0)), 0.0).sum(axis=1)
    return np.asarray(np.log1p(ALIGNED * (odds - 1.0)))


def _taken(context: WindowState, at: Integers, form: Integers) -> bool:
    """Whether, in most cycles of a track (rows of the log), another component is already associated with the path of
    form (5,)."""
    log = context.log
    same = (log.form[:, 0] == form).all(axis=1) & log.explained
    return bool(np.isin(log.cycle[at], log.cycle[same]).mean() > 0.5)


def _assign(context: WindowState, at: Integers, forms: Integers, scatter: Floats, part: float) -> WindowState:
    """For a birth: associate the track's rows of the log with the paths of forms (2, 5) of idents, with extra variance
    by the track's scatter."""
    extra = CONSTANTS.memory * context.log.std[at] ** 2 * (scatter**2 - 1.0)
    return context._replace(log=context.log.explain(at, forms, part if forms[1, 0] != UNKNOWN else 0.0, 0.0, extra))


def _enter(
    context: WindowState, at: Integers, decision: TrackDecision, histories: TrackSummary, row: int
) -> tuple[WindowState, bool]:
    """Add a new feature with its track's history to the map and solve the window again; if they do not fit, or the
    other tracks speak against the motion that follows, return the state as it was, and False."""
    new = len(context.landmarks.ident)
    other = decision.holds.other if context.window.turns else np.full(len(decision.holds.std), -1)
    holds = decision.holds._replace(feature=np.full(len(decision.holds.std), new), other=other)
    window = window_features.add_feature(context.window, decision.place, holds)
    landmarks = enter(context.landmarks, decision.is_wall, histories.middle, len(at), 5.0, decision.identity)
    forms = np.full((2, 5), UNKNOWN)
    forms[0] = [new if part == NEW else part for part in decision.form]
    forms[1] = _partner(decision, forms[0])
    grown = context._replace(window=window, landmarks=landmarks)
    share = min(max(decision.share, 0.0), 1.0)
    grown = _assign(grown, at, idents(landmarks, forms), histories.scatter[row], share)
    grown, left = resolve(grown, 3)
    if not np.isfinite(grown.window.head).all():
        return context, False
    fresh = np.isin(left.row, at)
    if float(np.mean(np.vecdot(left.left[fresh], left.left[fresh]))) > 3.0 * CONSTANTS.fit:
        return context, False
    if not is_clear(decision, motion_agreement.log_agreement(context, grown.window)):
        return context, False
    square = float(np.mean(histories.scatter[row] ** 2))
    grown = grown._replace(visibility=add_clear_paths(context.visibility, forms[:1], landmarks, square))
    return grown, True


def _partner(decision: TrackDecision, form: Integers) -> Integers:
    """Form (5,) of the path from which the new feature's, of form (5,), is unresolved; `UNKNOWN` for none."""
    if decision.kind == BESIDE:
        return np.append(form[:4], decision.known)
    return form[[0, 1, 2, 4, 3]] if decision.kind == BOTH_WAYS else np.full(5, UNKNOWN)


def _without_rival(context: WindowState, born: PanelIdentity, held: tuple[int, ...]) -> WindowState:
    """The map after the birth of a point, without the one that was held until now for the panel that it is, by the rows
    `held` (Q,) for each panel, -1 for none: there is one of each."""
    panel = int(np.argmax(born.log_ris[0]))
    keep = np.ones(len(context.landmarks.ident), dtype=np.bool_)
    if born.log_ris[0, panel] > 0.0 and held[panel] >= 0:
        keep[held[panel]] = False
    return remove_from_map(context, keep)
