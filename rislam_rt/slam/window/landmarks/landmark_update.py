"""Landmark update by a cycle: existence, reflectivity of walls, strength and panel identity of points, occlusion of
paths."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.model import RisCode
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import UNTOLD, Observations
from rislam_rt.slam.predicted_returns import TX, Poses
from rislam_rt.slam.window.landmarks.horizon_detection import nothing_heard
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable, idents, learn_ratios
from rislam_rt.slam.window.landmarks.measurement_prediction import ExpectedComponents, KnownEnvironment
from rislam_rt.slam.window.landmarks.ris_identification import PanelObservation, gains, spread_places, weigh
from rislam_rt.slam.window.landmarks.unresolved_clusters import UnresolvedClusters
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.smoother.window_gaussian import Window


class VisibilityObservations(NamedTuple):
    """Occlusion and scatter of the V paths that were looked for so far."""

    code: Integers
    """(V,) form of each path by idents, packed into one number, sorted."""
    clear: Floats
    """(V,) probability that nothing occludes it."""
    scatter: Floats
    """(V,) running mean square of its residuals in reported deviations: what paths that the map lacks do in its
    cell."""
    rises: Floats
    """(V, Z) log likelihoods of its elevation, by when it was heard (`horizon_detection`)."""


def no_observations() -> VisibilityObservations:
    """Empty record of paths' occlusion and scatter, before any landmark update."""
    return VisibilityObservations(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0), nothing_heard(0))


def pack(forms: Integers, landmarks: WindowTable) -> Integers:
    """One integer (R,) that encodes each of the forms (R, 5) of feature rows, by idents, in the record that landmark
    updates keep."""
    return np.asarray((idents(landmarks, forms) + 1) @ DIGITS)


DIGITS = 4096 ** np.arange(4, -1, -1)
"""Place values of the five idents of a form in its packed number."""


def recall(
    visibility: VisibilityObservations, expected: ExpectedComponents, landmarks: WindowTable
) -> tuple[Floats, Floats]:
    """Record of landmark updates: probability (R,) that nothing occludes each predicted return in this cycle, and the
    mean square (R,) of its past residuals in reported deviations."""
    return recall_forms(visibility, expected.forms, expected.bounces, landmarks)


def recall_forms(
    visibility: VisibilityObservations, forms: Integers, bounces: Integers, landmarks: WindowTable
) -> tuple[Floats, Floats]:
    """Probability (R,) that nothing occludes each path of forms (R, 5) over so many walls (R,) in this cycle, and the
    mean square (R,) of its past residuals in reported deviations."""
    first, scatter = CONSTANTS.steady ** (1.0 + bounces), np.full(len(forms), CONSTANTS.crowd)
    if len(visibility.code):
        code = pack(forms, landmarks)
        place = np.minimum(np.searchsorted(visibility.code, code), len(visibility.code) - 1)
        known = visibility.code[place] == code
        first = np.where(known, visibility.clear[place], first)
        scatter = np.where(known, visibility.scatter[place], scatter)
    return np.asarray(first * (1.0 - CONSTANTS.rare) + (1.0 - first) * CONSTANTS.cleared), scatter


def recall_rises(visibility: VisibilityObservations, expected: ExpectedComponents, landmarks: WindowTable) -> Floats:
    """Record of landmark updates: log likelihoods (R, Z) of the predicted returns' elevations, by what was heard of
    them so far."""
    found = nothing_heard(len(expected.forms))
    if len(visibility.code):
        code = pack(expected.forms, landmarks)
        place = np.minimum(np.searchsorted(visibility.code, code), len(visibility.code) - 1)
        known = visibility.code[place] == code
        found[known] = visibility.rises[place[known]]
    return found


def add_clear_paths(
    visibility: VisibilityObservations, forms: Integers, landmarks: WindowTable, scatter: float
) -> VisibilityObservations:
    """Record of paths' occlusion and scatter with the forms (N, 5) by which a new feature was found: not occluded, and
    of mean squared residual `scatter`."""
    count = len(forms)
    return _joined(
        visibility, (pack(forms, landmarks), np.full(count, 0.99), np.full(count, scatter), nothing_heard(count))
    )


def with_scatter(visibility: VisibilityObservations, idents: Integers, scatter: Floats) -> VisibilityObservations:
    """Record of paths' occlusion and scatter with the mean squared residuals `scatter` (N,) of known paths of forms
    (N, 5) by idents, of which the last of each form counts."""
    code, found = (idents + 1) @ DIGITS, visibility.scatter.copy()
    place = np.searchsorted(visibility.code, code)
    known = np.append(visibility.code, -1)[place] == code
    found[place[known]] = scatter[known]
    return visibility._replace(scatter=found)


def _joined(
    visibility: VisibilityObservations, fresh: tuple[Integers, Floats, Floats, Floats]
) -> VisibilityObservations:
    """Two records of paths' occlusion and scatter, as landmark updates keep them, as one, sorted by code."""
    every = [np.concatenate(pair) for pair in zip(visibility, fresh, strict=True)]
    order = np.argsort(every[0], kind="stable")
    return VisibilityObservations._make(field[order] for field in every)


def visible(expected: ExpectedComponents, groups: UnresolvedClusters, clear: Floats) -> Floats:
    """Probability (C,) that each cluster of unresolved returns is detected, with occlusion, for the landmark update."""
    return np.asarray(CONSTANTS.shown * (expected.detection * clear)[groups.leader] * groups.by_itself).clip(
        1e-4, CONSTANTS.shown
    )


def update_landmarks(
    visibility: VisibilityObservations, landmarks: WindowTable, window: Window, expected: ExpectedComponents,
    groups: UnresolvedClusters, clear: Floats, partner_clear: Floats, above: Floats, rises: Floats, scatter: Floats,
    shows: Floats, row: Integers, pick: Integers, raw: Floats, observed: Observations, poses: Poses,
    scene: KnownEnvironment, code: RisCode | None,
) -> tuple[VisibilityObservations, WindowTable]:  # fmt: skip
    """Update of occlusion, existence, strengths and panel identities after clusters `row` (A,) were detected as
    components `pick` (A,) with residuals of mean square `raw` (A,), and the other clusters missed.

    `clear` (R,) and `scatter` (R,) are what was recalled of the returns, `above` (R,) the probability that they arrive
    above the plane of the array, `rises` (R, Z) the log likelihoods of their elevations; `partner_clear` (A,) is the
    probability that the detected clusters' partners are not occluded, as their components tell (`unresolved_partner`).
    """
    if not len(expected.seen):
        return visibility, landmarks
    hit = np.zeros(len(groups.leader), dtype=np.bool_)
    hit[row] = True
    detection = CONSTANTS.shown * expected.detection * above
    missed = clear * (1.0 - detection) / (1.0 - clear * detection)
    after, scatter = clear.copy(), scatter.copy()
    told = hit | (groups.by_itself == 1.0)
    mate = groups.partner[row]
    after[mate[mate >= 0]] = np.minimum(partner_clear[mate >= 0], 0.995)
    after[groups.leader[told]] = np.where(hit, 0.995, missed[groups.leader])[told]
    lead = groups.leader[row]
    scatter[lead] += CONSTANTS.memory / CONSTANTS.window * (np.minimum(raw, 30.0 * scatter[lead]) - scatter[lead])
    alone = (groups.partner < 0) & (groups.by_itself == 1.0)
    landmarks = _existence(landmarks, expected, groups, hit & alone, ~hit & alone, shows)
    landmarks = _strengths(landmarks, window, expected, groups, row, pick, observed, poses, scene, code)
    fresh = pack(expected.forms, landmarks)
    place, keep = np.searchsorted(visibility.code, fresh), np.ones(len(visibility.code) + 1, dtype=np.bool_)
    keep[place[np.append(visibility.code, -1)[place] == fresh]] = False
    kept = VisibilityObservations._make(field[keep[:-1]] for field in visibility)
    return _joined(kept, (fresh, after, scatter, rises)), landmarks


def _existence(
    landmarks: WindowTable,
    expected: ExpectedComponents,
    groups: UnresolvedClusters,
    hit: Booleans,
    missed: Booleans,
    shows: Floats,
) -> WindowTable:
    """Update of features' existence odds: any detection of a resolved return speaks for its features, a missed one only
    against the feature of a path over that feature alone."""
    odds, hits = landmarks.log_odds.copy(), landmarks.hits.copy()
    forms, bounces = expected.forms[groups.leader], expected.bounces[groups.leader]
    direct = bounces == (forms[:, 0] == TX)
    row, part = ((forms >= 0) & hit[:, None]).nonzero()
    np.add.at(odds, forms[row, part], np.where(direct, 1.0, 0.3)[row])
    np.add.at(hits, forms[row, part], 1)
    np.minimum(odds, 12.0, out=odds)
    missed = missed & direct
    np.add.at(odds, forms[missed].max(axis=1), np.log1p(-shows[missed]))
    return landmarks._replace(log_odds=odds, hits=hits)


def _strengths(
    landmarks: WindowTable, window: Window, expected: ExpectedComponents, groups: UnresolvedClusters, row: Integers,
    pick: Integers,
    observed: Observations, poses: Poses, scene: KnownEnvironment, code: RisCode | None,
) -> WindowTable:  # fmt: skip
    """Update of walls' reflection coefficients and of points' strengths and panel identities, from components that are
    resolved from all others."""
    lead, alone = groups.leader[row], groups.partner[row] < 0
    quiet = (groups.disturbance[row] < 0.25 * scene.sensor.cell_length**2).all(axis=1)
    sure = (expected.forms[lead, 0] == TX) | (expected.log_amplitude_std[lead] < 0.5)
    told = alone & quiet & sure & (expected.bounces[lead] == 1)
    surplus = observed.log_amplitude[pick[told]] - expected.log_amplitude[lead[told]]
    landmarks = learn_ratios(landmarks, expected.forms[lead[told], 1:].max(axis=1), surplus)
    return _identities(landmarks, window, expected, groups, row, pick, observed, poses, scene, code)


def _identities(
    landmarks: WindowTable, window: Window, expected: ExpectedComponents, groups: UnresolvedClusters, row: Integers,
    pick: Integers,
    observed: Observations, poses: Poses, scene: KnownEnvironment, code: RisCode | None,
) -> WindowTable:  # fmt: skip
    """Update of points' strengths and panel identities by amplitudes and missed detections of their resolved paths over
    no wall."""
    component = np.full(len(groups.leader), -1)
    component[row] = pick
    lead = groups.leader
    alone = (groups.partner < 0) & (groups.by_itself == 1.0) & (expected.bounces[lead] == 0)
    points, heard = expected.forms[lead[alone], 0], component[alone]
    if not len(points):
        return landmarks
    rows = HEAD + 3 * points[:, None] + np.arange(3)
    blocks = window.covariance[rows[:, :, None], rows[:, None, :]]
    count = len(points)
    amplitude, side = np.append(np.exp(observed.log_amplitude), 1.0), np.append(observed.sides, UNTOLD)
    sight = PanelObservation(
        spread_places(window.features[points], blocks), poses.tx[None].repeat(count, axis=0),
        poses.rx[None].repeat(count, axis=0), np.ones(count), amplitude[heard], side[heard], heard >= 0,
    )  # fmt: skip
    gain = gains(sight, scene.ris, code, scene.radio)
    fresh = weigh(landmarks.identity.take(points), sight, gain, scene.sensor).clipped()
    return landmarks._replace(**landmarks.identity.put(points, fresh)._asdict())
