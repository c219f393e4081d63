"""Data association of one cycle: predicted returns, clusters of unresolved ones, the best assignment of components, and
its likelihood."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.model import RisCode
from rislam_rt.slam.assignment import Candidates, cheapest, pair_costs, within_reach
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD, Observations
from rislam_rt.slam.predicted_returns import TX, Poses, poses_of
from rislam_rt.slam.window.landmarks.horizon_detection import expected_above, prior_tilts, weigh_tilts
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.landmarks.landmark_update import VisibilityObservations, recall, recall_rises, visible
from rislam_rt.slam.window.landmarks.measurement_prediction import ExpectedComponents, KnownEnvironment, predict_returns
from rislam_rt.slam.window.landmarks.unresolved_clusters import UnresolvedClusters, cluster
from rislam_rt.slam.window.smoother import attitude, window_gaussian
from rislam_rt.slam.window.smoother.attitude import LEVEL_BODY, Tilts
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.solver_limits import GATE
from rislam_rt.slam.window.tracks import Continuations


class CycleAssociation(NamedTuple):
    """Data association of one cycle under one belief: predicted returns, the components assigned to them, and the
    likelihood."""

    mean: Floats
    """(7 + 3F,) mean of the present pose, velocity, compass offset and features..."""
    covariance: Floats
    """(7 + 3F, 7 + 3F) ...and their covariance."""
    poses: Poses
    """Tx and Rx positions of the present pose."""
    expected: ExpectedComponents
    """Predicted returns, R of them."""
    groups: UnresolvedClusters
    """Their clusters, C of them."""
    clear: Floats
    """(R,) probability that nothing occludes each return..."""
    above: Floats
    """(R,) ...that it arrives above the plane of the array..."""
    rises: Floats
    """(R, Z) ...the log likelihoods of its elevation (`horizon_detection`)..."""
    tilts: Tilts
    """...under these tilts of the body..."""
    scatter: Floats
    """(R,) ...and the mean square of its past residuals, in reported deviations."""
    shows: Floats
    """(C,) detection probability of each cluster, occlusion included."""
    extra: Floats
    """(C, 3) variance of each cluster's prediction besides the belief's own and the reported one."""
    side: Integers
    """(C,) panel that each cluster's path runs over, `OTHER` or `UNTOLD` (see `slam.observations`)."""
    untold: Booleans
    """(C,) whether each cluster's path runs over a panel, and no component tells whether it did."""
    rivals: Floats
    """(C, M) log factor by which a component is likelier a stranger to each cluster as it may continue a track."""
    row: Integers
    """(A,) clusters that were detected..."""
    pick: Integers
    """(A,) ...and the components assigned to them."""
    score: float
    """Log likelihood ratio of the cycle's components under this belief against clutter alone."""
    surprise: float
    """Standard deviations by which fewer returns were detected than predicted."""


def echoes(observed: Observations, cell: Floats) -> Booleans:
    """Whether each component (M,) is an echo: what motion within the slot leaves of a strong component in the
    difference of two alternated codes.

    Two paths of one cell come out as one; a second component there comes from the difference, and if it did not run
    over the panel it is the stronger one. If neither is known to have, one is the echo of the other.
    """
    found = np.zeros(len(observed.log_amplitude), dtype=np.bool_)
    if observed.panel_odds is None:
        return found
    untold = observed.sides == UNTOLD
    found = untold | (observed.odds < 0.0)
    beside = np.where(observed.odds[found, None] < 0.0, FAR_STRONGER, np.inf)
    far = np.where(untold[found, None] & untold, 0.0, beside)
    row, other = (observed.log_amplitude > observed.log_amplitude[found, None] + far).nonzero()
    inside = (np.abs(observed.seen[found][row] - observed.seen[other]) < cell).all(axis=1)
    found[found] = np.bincount(row[inside], minlength=int(found.sum())) > 0
    return found


FAR_STRONGER = 1.0
"""Least difference in log amplitude between a component and its echo: a turn of a fifth of a radian leaves a tenth."""


def associate_cycle(
    window: Window, landmarks: WindowTable, visibility: VisibilityObservations, heading: float,
    scene: KnownEnvironment, code: RisCode | None,
    observed: Observations, strangers: Floats, sway: Floats | None, beside: Continuations | None = None,
    heave: float = 0.0,
) -> CycleAssociation:  # fmt: skip
    """Predict the returns of a belief, cluster the unresolved ones, and assign a cycle's components to the clusters.

    `strangers` (M,) is the density of clutter at each component, `sway` (C, L) the level probabilities of the attitude,
    None for a body that is known to be level. `beside` says where tracks go on, if a panel is known and no component
    tells whether it ran over it; `heave` [m^2] is the variance of the body's height above the floor that it goes along.
    """
    mean, held, excess = window_gaussian.now_with_excess(window)
    covariance = _with_height(held, excess, scene, heave)
    poses = poses_of(mean[:3], np.asarray(heading + mean[6]), scene.body)
    expected = predict_returns(
        mean[HEAD:].reshape(-1, 3), landmarks, poses, mean[:3], scene, code, covariance[HEAD:, HEAD:]
    )
    clear, scatter = recall(visibility, expected, landmarks)
    rises = recall_rises(visibility, expected, landmarks)
    tilts = LEVEL_BODY if sway is None else prior_tilts(sway)
    above = expected_above(expected.elevation, rises, tilts)
    sides = return_sides(expected.forms, landmarks) if observed.side is not None else None
    groups = cluster(
        expected, scene.sensor.cell_length, clear * above, None if sides is None else np.maximum(sides, OTHER)
    )
    lead = groups.leader
    untold = np.zeros(len(lead), dtype=np.bool_)
    if beside is not None:
        untold = np.isin(expected.forms[lead, 0], [row for row in landmarks.panels if row >= 0])
        groups = _absorbed(groups, expected, untold.nonzero()[0], beside, scene.sensor.cell_length)
    extra = groups.disturbance + groups.mean_share()[1][:, None] * groups.gap**2
    if len(observed.seen):
        extra += (np.maximum(scatter[lead], 1.0) - 1.0)[:, None] * _median(observed.std) ** 2
    if sway is not None:
        extra += attitude.spread(expected.seen[lead, 1:], np.diag(attitude.variance(sway)))
    nobody = np.zeros(0, dtype=np.int64)
    view = CycleAssociation(
        mean, held, poses, expected, groups, clear, above, rises, tilts, scatter,
        visible(expected, groups, clear * above), extra,
        np.full(len(lead), UNTOLD) if sides is None else sides[lead],
        untold, _rivals(untold, strangers, beside), nobody, nobody, 0.0, 0.0,
    )  # fmt: skip
    row, pick, score = _associate(view, expected.seen, covariance, observed, strangers)
    alone, found = groups.by_itself == 1.0, np.zeros(len(lead), dtype=np.bool_)
    found[row] = True
    due = view.shows[alone]
    surprise = (due.sum() - found[alone].sum()) / np.sqrt((due * (1.0 - due)).sum() + 0.25)
    return view._replace(row=row, pick=pick, score=score, surprise=float(surprise))


def _absorbed(
    groups: UnresolvedClusters, expected: ExpectedComponents, rows: Integers, beside: Continuations, cell: Floats
) -> UnresolvedClusters:
    """Clusters of which those in `rows`, over a panel, come out by themselves only if no louder track goes on in their
    cell: a wall's return that the map lacks."""
    lead, alone = groups.leader[rows], groups.by_itself.copy()
    inside = (np.abs(expected.seen[lead, None] - beside.seen) < cell).all(axis=-1)
    louder = inside & (beside.log_amplitude > groups.log_amplitude[rows, None])
    alone[rows] *= np.where(louder, np.maximum(1.0 - beside.share, CONSTANTS.rare), 1.0).prod(axis=1)
    return groups._replace(by_itself=alone)


def _rivals(untold: Booleans, strangers: Floats, beside: Continuations | None) -> Floats:
    """Log factor (C, M) by which components are likelier to be strangers to clusters over a panel, as they may continue
    tracks.

    The code in force changes such a path's amplitude from cycle to cycle, so that its prediction would fit much: the
    return of a wall that the map lacks, near by and louder, is known by its track.
    """
    more = np.zeros(len(strangers)) if beside is None else np.log1p(beside.density / strangers)
    return np.asarray(untold[:, None] * more)


def with_tilts(view: CycleAssociation, tilts: Tilts) -> CycleAssociation:
    """Association of a cycle whose returns are above the plane of the array as what is heard tells, by one of `tilts`
    for all.

    Returns that share a cell do not tell which of them is heard, and are not asked.
    """
    expected, groups = view.expected, view.groups
    lone = (groups.partner < 0) & (groups.by_itself == 1.0)
    asked, heard = np.zeros((2, len(expected.seen)), dtype=np.bool_)
    asked[groups.leader[lone]] = True
    heard[groups.leader[view.row]] = True
    shows = CONSTANTS.shown * expected.detection * view.clear
    found = weigh_tilts(expected.elevation, view.rises, shows, asked, heard, tilts)
    fresh = visible(expected, groups, view.clear * found.above)
    return view._replace(
        above=found.above, rises=found.log_like, shows=fresh, score=view.score + found.gain, tilts=found.tilts
    )


def _median(values: Floats) -> Floats:
    """Median (A,) of each column of values (M, A) for association; numpy's own takes ten times as long for so few."""
    values, middle = np.sort(values, axis=0), len(values) // 2
    return np.asarray(0.5 * (values[middle] + values[-1 - middle]))


def _with_height(covariance: Floats, excess: Floats, scene: KnownEnvironment, heave: float) -> Floats:
    """Covariance of the present with the height's variance widened by the variance of its `heave` [m^2] and by what the
    motion model may be off by, where wall returns are used.

    A livelier motion is looked at beside the one that is held (`filter._associate_over_motions`), but a slow climb is
    none. Without wall returns next to nothing measures the height: a gate as wide as it may be off holds anything.
    """
    if not scene.use_vt:
        return covariance
    wide = covariance.copy()
    wide[2, 2] += excess[2, 2] + heave
    return wide


def score_again(
    view: CycleAssociation, mean: Floats, covariance: Floats, observed: Observations, strangers: Floats
) -> float:
    """Log likelihood ratio of an associated cycle under another mean and covariance: predictions move to first order,
    clusters stay."""
    seen = view.expected.seen + view.expected.jacobian @ (mean - view.mean)
    return _associate(view, seen, covariance, observed, strangers)[2]


def return_sides(forms: Integers, landmarks: WindowTable) -> Integers:
    """Panel that each form (R, 5) runs over: `PANEL` + q, `OTHER` for none, or `UNTOLD` for a point that may yet prove
    a panel."""
    held = [panel for panel in enumerate(landmarks.panels) if panel[1] >= 0]
    if not held:
        return np.full(len(forms), UNTOLD)
    sides = np.where((len(held) == landmarks.log_ris.shape[1]) | (forms[:, 0] == TX), OTHER, UNTOLD)
    for number, row in held:
        sides[forms[:, 0] == row] = PANEL + number
    return sides


def _associate(
    view: CycleAssociation, places: Floats, covariance: Floats, observed: Observations, strangers: Floats
) -> tuple[Integers, Integers, float]:
    """Best assignment of components to clusters with returns at `places` (R, 3): rows of the clusters detected, their
    components, and the log likelihood ratio of the cycle against clutter alone."""
    (expected, groups), shows = (view.expected, view.groups), view.shows
    missed = groups.by_itself == 1.0
    if not len(groups.leader) or not len(observed.seen):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), float(np.log1p(-shows[missed]).sum())
    lead, mate = groups.leader, groups.partner
    share, extra, side = groups.mean_share()[0][:, None], view.extra, view.side
    seen = places[lead] + share * groups.gap
    most = np.abs(expected.jacobian) @ np.sqrt(np.diagonal(covariance))  # no correlation makes a deviation larger
    most = (most[lead] + share * (most[mate] - most[lead])) ** 2 + extra
    doubt = np.hypot(groups.log_amplitude_std, 0.5 * CONSTANTS.fading)
    odds = np.log(shows / (1.0 - np.minimum(shows, 1.0 - 1e-3)))
    candidates = Candidates(seen, np.zeros((len(lead), 3, 3)), groups.log_amplitude, doubt, odds, side, view.untold)
    row, column = within_reach(seen, most, candidates, observed, GATE)
    near = np.flatnonzero(np.bincount(row, minlength=len(lead)))
    lead, mate, share = lead[near], mate[near], share[near]
    jacobian = expected.jacobian[lead] + share[..., None] * (expected.jacobian[mate] - expected.jacobian[lead])
    spread = (jacobian.reshape(-1, jacobian.shape[-1]) @ covariance).reshape(jacobian.shape)
    spread = spread @ np.swapaxes(jacobian, 1, 2)
    spread[:, [0, 1, 2], [0, 1, 2]] += extra[near]
    some = Candidates._make(field[near] for field in candidates)._replace(covariance=spread)
    cost = pair_costs(some, observed, GATE, strangers, (np.searchsorted(near, row), column))
    cost = np.minimum(cost + 2.0 * view.rivals[near], 0.0)
    rows, columns = cheapest(cost)
    # the cost counts what is missed: seen against missed, both against strangers
    gain = -0.5 * float(cost[rows, columns].sum()) + float(np.log1p(-shows[near[rows]]).sum())
    rows = near[rows]
    missed[rows] = False
    return rows, columns, gain + float(np.log1p(-shows[missed]).sum())
