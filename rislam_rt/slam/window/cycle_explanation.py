"""Explanation of a cycle's components by paths of the map or by tracks, and the landmark updates, births and removals
that follow."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import Measurement, RisCode
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations, is_los, observations_of
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.step_info import REMOVED, UNUSED, StepOutcome
from rislam_rt.slam.window import tracks
from rislam_rt.slam.window.births.births import births
from rislam_rt.slam.window.births.doubted_returns import with_other_cause
from rislam_rt.slam.window.births.explained_walls import explained_walls
from rislam_rt.slam.window.births.feature_removal import features_to_remove, remove_from_map
from rislam_rt.slam.window.births.reclassification import reclassified
from rislam_rt.slam.window.births.track_fragments import with_fragments
from rislam_rt.slam.window.cycle_association import CycleAssociation, echoes
from rislam_rt.slam.window.divergence import divergence_monitor
from rislam_rt.slam.window.landmarks.horizon_bias import correct_horizon_bias
from rislam_rt.slam.window.landmarks.horizon_detection import HorizonEvidence, level_above, prior_tilts, weigh_tilts
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable, idents, image_ident
from rislam_rt.slam.window.landmarks.landmark_update import update_landmarks
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.landmarks.unresolved_clusters import conditioned_share
from rislam_rt.slam.window.measurement_log import Log, Residuals, append, scatter_variance
from rislam_rt.slam.window.motion.motion_learning import log_manoeuvre
from rislam_rt.slam.window.ris_candidate import false_density, weigh_tracks
from rislam_rt.slam.window.smoother import attitude, motion, window_gaussian
from rislam_rt.slam.window.smoother.attitude import Tilts
from rislam_rt.slam.window.smoother.motion_basis import rotation
from rislam_rt.slam.window.solver_limits import REFRESH, STRIDE
from rislam_rt.slam.window.state import WindowState
from rislam_rt.slam.window.tracks import WindowTracks
from rislam_rt.slam.window.unresolved_partner import partner_clear, partner_presence


class HeardCycle(NamedTuple):
    """Components of one cycle, M of them, that association has to explain: all but the direct path and echoes of
    alternated codes."""

    observed: Observations
    """These components in the filter's units."""
    free: Integers
    """(M,) index of each in the measurement."""
    landmark: Integers
    """(N,) label of every component of the measurement: `REMOVED` for the direct path, else `UNUSED`."""


def components_to_explain(measurement: Measurement, scene: KnownEnvironment) -> HeardCycle:
    """Select a measurement's components that need an explanation, without direct path and echoes, sorted by delay and
    direction so that nothing hangs on their order."""
    observed = observations_of(measurement, scene.radio, scene.body)
    landmark = np.where(is_los(observed, scene.body), REMOVED, UNUSED)
    order = np.lexsort(observed.seen.T[::-1])
    free = order[landmark[order] == UNUSED]
    free = free[~echoes(observed.take(free), scene.sensor.cell_length)]
    return HeardCycle(observed.take(free), free, landmark)


def log_associations(
    state: WindowState, observed: Observations, view: CycleAssociation
) -> tuple[WindowState, Booleans]:
    """Write a cycle's explanation into the log: append its components with the paths that they were associated with,
    and mark which of the associated ones (A,) update the Gaussian.

    With `use_vt = false` wall returns are recognised, but update nothing.
    """
    forms, row, pick = view.expected.forms, view.row, view.pick
    used = np.ones(len(row), dtype=np.bool_) if state.scene.use_vt else forms[view.groups.leader[row], 0] != TX
    log = append(state.log, observed, state.cycle, state.cycle - state.window.num_poses + 1)
    at = len(log.cycle) - len(observed.seen) + pick[used]
    presence = partner_presence(view, observed)[used]
    return state._replace(log=_explain(log, view, state.landmarks, row[used], at, presence)), used


def innovations(
    view: CycleAssociation, log: Log, used: Booleans, cycle: int, axes: int, spacing: float
) -> tuple[Floats, Floats, Floats]:
    """Innovations (N, 3) of a cycle's associated components, measured less predicted, and the predictions' jacobians
    (N, 3, 7 + 3F) by the present and (N, 3, A + 1) by the attitude about so many `axes` and by the heave, all in
    standard deviations; the log already holds the associations, and `spacing` [wavelengths] is that of the antennas."""
    row, at = view.row[used], int(np.searchsorted(log.cycle, cycle)) + view.pick[used]
    lead, mate, share = view.groups.leader[row], view.groups.partner[row], log.share[at, None]
    seen = view.expected.seen[lead] + share * view.groups.gap[row]
    slope = view.expected.jacobian[lead]
    slope = slope + share[..., None] * (view.expected.jacobian[mate] - slope)
    left = log.seen[at] - seen
    left[:, 1:] = log.nearest(at, left[:, 1:], spacing)
    correct_horizon_bias(seen, log.std[at], left, slope)
    std = np.sqrt(log.std[at] ** 2 + log.extra[at])
    turned = np.concatenate([attitude.jacobian(log.seen[at, 1:], axes), slope[..., 2:3]], axis=2)
    return left / std, slope / std[..., None], turned / std[..., None]


def levelled_observations(observed: Observations, log: Log, covariance: Floats) -> Observations:
    """A cycle's components as the log has levelled them, with deviations that include the attitude's `covariance`
    (A, A) [rad^2]."""
    seen = log.seen[len(log.cycle) - len(observed.seen) :]
    return observed._replace(seen=seen, std=np.sqrt(observed.std**2 + attitude.spread(seen[:, 1:], covariance)))


def learn_cycle(
    state: WindowState, heard: HeardCycle, view: CycleAssociation, used: Booleans, left: Residuals, dt: float,
    turn: float, bend: float, code: RisCode | None,
) -> tuple[WindowState, Integers]:  # fmt: skip
    """Update all but poses and places after a cycle: tracks, odds of being lost, occlusion, strengths, panel
    identities; also returns the landmark labels (N,) of the measurement.

    `left` are the components' residuals after the update, `turn` [rad] the turn that the compass told, `bend` [m/s^2]
    how much a step's velocity may change.
    """
    observed, expected, groups, row, pick = heard.observed, view.expected, view.groups, view.row, view.pick
    landmarks, log = state.landmarks, state.log
    raw = view.scatter[groups.leader[row]]
    raw[used] = _squares(left, log, len(log.cycle) - len(observed.seen) + pick[used])
    taken = np.zeros(len(observed.seen), dtype=np.bool_)
    taken[pick] = True
    if state.window.turns:
        turn += float(np.diff(window_gaussian.poses(state.window)[-2:, 3]).sum())
    followed = _follow(state, view, observed, (~taken).nonzero()[0], dt, turn, bend)
    sway = np.concatenate([followed.level[None], state.sway[1:]])
    state = state._replace(tracks=followed.tracks, log=followed.log, sway=sway)
    if len(expected.seen) and len(observed.seen):
        odds = divergence_monitor.advance(state.lost_log_odds, view.score, followed.silent, followed.kept)
        state = state._replace(lost_log_odds=odds)
    if min(landmarks.panels) < 0:  # once all are known, no track needs to be one
        state = state._replace(tracks=weigh_tracks(state.tracks, state.cycle, view.poses, state.scene, state.codes))
    beside = partner_clear(view, observed)
    visibility, landmarks = update_landmarks(
        state.visibility, landmarks, state.window, expected, groups, view.clear, beside, view.above, view.rises,
        view.scatter, view.shows, row, pick, raw, observed, view.poses,
        state.scene, code,
    )  # fmt: skip
    landmark = heard.landmark.copy()
    landmark[heard.free[pick]] = np.where(used, _names(landmarks, expected.forms[groups.leader[row]]), REMOVED)
    return state._replace(visibility=visibility, landmarks=landmarks), landmark


def _explain(
    log: Log, view: CycleAssociation, landmarks: WindowTable, row: Integers, at: Integers, presence: Floats
) -> Log:
    """Record in the log that its components `at` (A,) were associated with clusters `row` (A,) of predicted returns, in
    which partners are heard with probabilities `presence` (A,)."""
    if not len(row):
        return log
    expected, groups = view.expected, view.groups
    lead, mate = groups.leader[row], groups.partner[row]
    share, variance = conditioned_share(
        groups, expected, row, log.log_amplitude[at], log.log_amplitude_std[at], presence
    )
    both = ((mate >= 0) & (presence > 0.5))[:, None]
    forms = np.stack([expected.forms[lead], np.where(both, expected.forms[mate], UNKNOWN)], axis=1)
    variance += np.where(both[:, 0], 0.0, share**2)
    shared = groups.disturbance[row] + variance[:, None] * groups.gap[row] ** 2
    scatter = scatter_variance(view.scatter[lead], log.std[at])
    return log.explain(at, idents(landmarks, forms), np.where(both[:, 0], share, 0.0), shared, scatter)


def _squares(left: Residuals, log: Log, rows: Integers) -> Floats:
    """Mean squared residuals (A,) of explained components, as rows of the log, in reported standard deviations."""
    if not len(rows):
        return np.zeros(0)
    at = np.searchsorted(left.row, rows)
    return left.square[at]


def unexplained(state: WindowState, observed: Observations) -> float:
    """Density of components that nothing explained in the last cycle, per metre of length, unit of each cosine and
    e-fold of amplitude."""
    if not len(observed.seen):
        return 0.0
    sensor = state.scene.sensor
    window = (sensor.window[1] - sensor.window[0]) * SPEED_OF_LIGHT
    loudness = 0.5 * np.log(sensor.radio.integrated_snr(np.exp(observed.log_amplitude.max())) / sensor.threshold)
    count = float((state.tracks.last == state.cycle - 1).sum())
    return count / (window * np.pi * max(float(loudness), 1.0))


class _Followed(NamedTuple):
    """Tracks after a cycle, the log that names them, and which of the last cycle's tracks went on."""

    tracks: WindowTracks
    log: Log
    silent: Floats
    """(S,) probabilities with which tracks that were detected in the last cycle, and are not in this one, were due: by
    the share of cycles in which they are heard, above the plane of the array..."""
    kept: int
    """...and the number of those that are detected in this one."""
    level: Floats
    """(L,) probabilities of the levels of the tilt's deviation, by what the tracks tell as well."""


def _predicted(state: WindowState, velocity: Floats, dt: float, turn: float, bend: float) -> WindowTracks:
    """Tracks predicted over a step `dt` [s] in which the body turns by `turn` [rad]; `velocity` (3,) [m/s] and `bend`
    [m/s^2] are those of the agent."""
    agent, angle = state.heading[-1], state.window.velocity_turn[-1:]
    kept = (rotation(agent).T @ velocity)[:2] if angle.any() else np.zeros(2)
    return tracks.advance(state.tracks, dt, turn, np.array([2.0 * bend + velocity @ velocity, 0.1, 0.1]), kept)


def beside_panels(
    state: WindowState, observed: Observations, dt: float, turn: float, bend: float
) -> tracks.Continuations | None:
    """Where tracks are expected to go on in a cycle that is about to be associated; None where components tell whether
    they ran over a panel, or none is known."""
    if observed.side is not None or max(state.landmarks.panels) < 0:
        return None
    velocity = window_gaussian.mean_now(state.window)[3:6]
    sway = attitude.spread(observed.seen[:, 1:], np.diag(state.attitude_variance))
    return tracks.continuations(_predicted(state, velocity, dt, turn, bend), observed, sway, state.cycle)


def _follow(
    state: WindowState, view: CycleAssociation, observed: Observations, free: Integers, dt: float, turn: float,
    bend: float,
) -> _Followed:  # fmt: skip
    """Continue, begin and end tracks with the components of a cycle that no path of the map explains."""
    speed = float(np.linalg.norm(view.mean[3:6]))
    found = _predicted(state, view.mean[3:6], dt, turn, bend)
    late, learnt = found.last == state.cycle - 1, state.config.motion == "learnt"
    if learnt and state.window.covariance[-1, -1] > 0.0:
        found, rows, picks = tracks.match_over_motions(
            found, lambda: (_predicted(state, view.mean[3:6], dt, turn, CONSTANTS.liveliest), log_manoeuvre(state)),
            observed, free, state.cycle, state.config.new_density,
        )  # fmt: skip
    else:  # who is told the motion, or knows it particle by particle, looks for none
        rows, picks, _ = tracks.match(found, observed, free, state.cycle, state.config.new_density)
    horizon = _weigh_tracks(found, rows, view.tilts)
    silent = late.copy()
    silent[rows] = False
    due = tracks.share(found, state.cycle)[silent] * horizon.above[silent]
    found = found._replace(rises=horizon.log_like)
    false, log_real = false_density(observed, state.scene)
    found = tracks.with_evidence(found, rows, observed, picks, state.cycle, false)
    found = tracks.extend(found, rows, observed, picks, state.cycle)
    left = np.zeros(len(observed.seen), dtype=np.bool_)
    left[free], left[picks] = True, False
    spare = left.nonzero()[0]
    reach = np.maximum(observed.seen[spare, 0], 0.5)
    # tracks are witnesses of the motion: none is presumed to know the one that is believed in, unless it is told
    doubt = CONSTANTS.walk if learnt else float(np.sqrt(np.trace(view.covariance[3:6, 3:6])))
    rate = np.stack([np.full(len(spare), 2.0), 2.0 / reach, 2.0 / reach], axis=1) * np.hypot(speed, doubt)
    if len(state.level) > 2:  # what turns without a compass turns all that it sees
        rate[:, 1:] += np.sqrt(motion.expected_variance(state.level[2]))
    found, fresh = tracks.start(found, observed, spare, rate, state.cycle, log_real[spare])
    base = len(state.log.cycle) - len(observed.seen)
    track = state.log.track.copy()
    track[base + picks], track[base + spare] = found.ident[rows], fresh
    level = horizon.tilts.weight.sum(axis=1)
    above = level_above(tracks.nearly_level(found), found.rises, prior_tilts(state.sway))
    keep = tracks.alive(found, state.cycle, above, level)
    if not learnt:
        recent = state.cycle - found.last <= CONSTANTS.window
        keep |= recent & tracks.recognisable(found, state.cycle, state.config.new_density)
    found = found.keep(keep)
    log = state.log._replace(track=track)
    return _Followed(found, log, due, int(late[rows].sum()), level)


def _weigh_tracks(found: WindowTracks, rows: Integers, tilts: Tilts) -> HorizonEvidence:
    """Tilts of the cycle by which of the tracks go on, `rows` (A,), of those that were heard more than once; the
    panel's codes silence it for reasons of their own."""
    heard = np.zeros(len(found.ident), dtype=np.bool_)
    heard[rows] = True
    asked = (found.hits >= 2) & ~(found.log_ris > 0.0).any(axis=1)
    shows = np.full(len(found.ident), CONSTANTS.shown * CONSTANTS.steady)
    return weigh_tilts(tracks.nearly_level(found), found.rises, shows, asked, heard, tilts)


def _names(landmarks: WindowTable, forms: Integers) -> Integers:
    """Landmark labels (A,) by which a cycle's explanation names what explains each component: of forms (A, 5) the ident
    of a point or wall, or a combined one of a point's image in a wall and of two walls in either order."""
    if not len(forms):
        return np.zeros(0, dtype=np.int64)
    point, first, second = forms[:, 0] >= 0, forms[:, 3], forms[:, 4]
    wall = np.where(first >= 0, first, forms[:, 1])
    own, beside = landmarks.ident[np.where(point, forms[:, 0], wall)], landmarks.ident[np.where(point, wall, second)]
    pair = ~point & (second >= 0)
    named = image_ident(np.where(pair, np.minimum(own, beside), own), np.where(pair, np.maximum(own, beside), beside))
    return np.where(pair | (point & (wall >= 0)), named, own)


def remove_or_add_features(state: WindowState, left: Residuals, view: CycleAssociation) -> WindowState:
    """Remove features that the evidence contradicts, or walls that two others explain, or, in a cycle without removals,
    let tracks give birth to features."""
    fresh = True
    if state.cycle % REFRESH == 0 and len(state.landmarks.ident):
        gone = features_to_remove(state.landmarks, left, state.log)
        if not gone.any():
            gone = explained_walls(state)
        state, fresh = remove_from_map(state, ~gone), not gone.any()
    if not fresh:
        return state
    after = births(state, view)
    calm = after.landmarks.next_ident == state.landmarks.next_ident and state.cycle % STRIDE == 0
    if calm and state.scene.use_vt:
        after = with_other_cause(after, view)
        if after.landmarks.next_ident == state.landmarks.next_ident:
            after = reclassified(after, view)
    return with_fragments(after) if state.cycle % REFRESH == 2 else after


def outcome_of(heard: int, features: int, lost: bool) -> StepOutcome:
    """Outcome of a cycle, from the number of components heard, the number of features known, and whether the filter is
    lost."""
    if not heard:
        return StepOutcome.NO_MEASUREMENTS
    if lost:
        return StepOutcome.DIVERGED
    return StepOutcome.OK if features else StepOutcome.NO_LANDMARKS
