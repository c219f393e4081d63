"""The paper's nested particle filter, a cycle of it: predict, classify, associate, weigh, resample, births and deaths.

What is expected, what comes out as one, who is who, what a track is and which point is the panel is asked of the window
filter's parts, which see the particles by their mean and covariance (`gaussian_view`); pose and map are the particles'.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.model import Body, DataSheet, Measurement, RadioConfig, RisCode, SensorModel
from rislam_rt.model.sensor_model import ONE_PULSE
from rislam_rt.slam.classify import Sightings, classify, classify_geometric, load_classifier, track_features
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.input_checks import check_sides, check_step
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.nested.gaussian_view import gaussian_view
from rislam_rt.slam.nested.particles.engine_choice import pick_engine
from rislam_rt.slam.nested.particles.new_landmark import LandmarkHistory, initialise_landmark
from rislam_rt.slam.nested.particles.particle_belief import (
    Nested,
    draw,
    drop,
    effective_size,
    propagate,
    remember,
    renew,
)
from rislam_rt.slam.nested.particles.prior_map import set_prior_map
from rislam_rt.slam.nested.particles.weights import FLOOR, Seen, update
from rislam_rt.slam.nested_config import NestedConfig
from rislam_rt.slam.observations import PANEL, free_space, stranger_density
from rislam_rt.slam.predicted_returns import AXES, observe, poses_of
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.step_info import REMOVED, LossCause, StepInfo, StepOutcome
from rislam_rt.slam.window import WindowState, cycle_explanation
from rislam_rt.slam.window import init as window_init
from rislam_rt.slam.window import revisit as window_revisit
from rislam_rt.slam.window.births.feature_removal import remove_from_map
from rislam_rt.slam.window.cycle_association import CycleAssociation, associate_cycle
from rislam_rt.slam.window.divergence.divergence_monitor import cause_of_loss
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN, compile_forms
from rislam_rt.slam.window.measurement_log import Log, squares
from rislam_rt.slam.window.relinearisation import relinearise
from rislam_rt.slam.window.smoother import attitude, window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.solver_limits import REFRESH
from rislam_rt.slam.window.tracks import WindowTracks

BROAD = 10.0
"""Prior standard deviation [m] of a landmark's position before its measurements."""
WALL_CYCLES = 20
"""Measurements that a track needs before birth where walls are found by points alone: two legs leave room for error."""
HELD = 1e-4
"""Standard deviation [m, m/s, rad] of the start up to which a coordinate is held fixed and not sampled."""


class NestedState(NamedTuple):
    """State of the nested particle filter: the particles, and a window state for all that is not pose or place."""

    front: WindowState
    """Window state with tracks, log and landmark table; its window is the particles' Gaussian view."""
    belief: Nested
    """The particles of the agent and of the landmarks."""


def init(
    start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: SlamConfig,
    *, rng: np.random.Generator,
) -> NestedState:  # fmt: skip
    """State of the nested filter before the first cycle: particles drawn from the start prior, and an empty map."""
    once = replace(sensor, period=ONE_PULSE)  # particles know nothing of what is heard a period too early
    return _begin(window_init(start, body, ris, once, config, rng=rng), config, rng=rng)


def revisit(state: NestedState, start: StartPrior, config: SlamConfig, *, rng: np.random.Generator) -> NestedState:
    """State of the nested filter for another run, or another agent, on the map of an earlier one (`window.revisit`)."""
    return _begin(window_revisit(state.front, start, config, rng=rng), config, rng=rng)


def _begin(front: WindowState, config: SlamConfig, *, rng: np.random.Generator) -> NestedState:
    """State of the nested particle filter with particles that have the mean and covariance of a window state."""
    front = front._replace(sway=attitude.held_level(front.sway))
    mean, covariance = window_gaussian.now(front.window)
    std = np.sqrt(np.diag(covariance))[:HEAD]
    mean[6] += front.heading[-1]
    belief = draw(mean[:HEAD], np.where(std > HELD, std, 0.0), config.nested.num_agents, rng=rng)
    engine, features = pick_engine(config.nested.engine), mean[HEAD:].reshape(-1, 3)
    return NestedState(front, set_prior_map(belief, features, covariance[HEAD:, HEAD:], config.nested, engine, rng=rng))


def step(
    state: NestedState, measurement: Measurement, code: RisCode | None, dt: float, heading: float, config: SlamConfig,
    *, rng: np.random.Generator,
) -> tuple[NestedState, StepInfo]:  # fmt: skip
    """Advance the nested filter by one cycle: `dt` [s] since the last, `heading` [rad], `code` held to be applied.

    Raises
    ------
    ConfigError
        One of them is no number, or not of the panel; or a component's panel is not named.
    """
    check_step(dt, heading, code, state.front.scene.ris)
    check_sides(measurement, state.front.scene.ris)
    if config.heading != "known":
        heading = float(state.front.heading[-1])
    turn = heading - float(state.front.heading[-1])
    front, belief = _move(state, dt, heading, code, config, rng=rng)
    scene, landmarks, engine = front.scene, front.landmarks, pick_engine(config.nested.engine)
    heard = cycle_explanation.components_to_explain(measurement, scene)
    observed = heard.observed
    strangers = stranger_density(
        observed, scene.sensor, max(config.new_density, cycle_explanation.unexplained(front, observed))
    )
    view = associate_cycle(front.window, landmarks, front.visibility, heading, scene, code, observed, strangers, None)
    front, used = cycle_explanation.log_associations(front, observed, view)
    belief, evidence, nis = update(belief, _seen(front, view, used), config.nested, engine)
    front = _refresh_view(front, belief, config)
    left = relinearise(front, 0 if front.cycle % REFRESH == 0 else front.window.num_poses - 1)[1]
    left = left._replace(square=squares(left.row, left.left, front.log, 0.0))
    before = front.lost_log_odds
    front, landmark = cycle_explanation.learn_cycle(front, heard, view, used, left, dt, turn, config.sigma_a, code)
    front, removed = _classify(front, config)
    landmark[heard.free[removed[len(removed) - len(observed.seen) :]]] = REMOVED

    grown = cycle_explanation.remove_or_add_features(front, left, view)
    # a wall found by a point that it stands before is gone with it
    found = grown.landmarks.ident
    grown = remove_from_map(grown, (found < landmarks.next_ident) | np.isin(found, grown.log.form[:, 0]))
    belief = _follow_map(belief, front, grown, config, rng=rng)
    ess = effective_size(belief)
    belief, resampled = renew(belief, _spans(grown), config.nested, engine, rng=rng)
    outcome = cycle_explanation.outcome_of(len(measurement), len(grown.landmarks.ident), grown.lost_log_odds >= 0.0)
    front = _refresh_view(grown._replace(cycle=grown.cycle + 1), belief, config)
    count = len(front.landmarks.points)
    cause = LossCause.NONE
    if outcome == StepOutcome.DIVERGED:
        cause = cause_of_loss(before, grown.lost_log_odds, grown.lost_log_odds, view.score)
    info = StepInfo(landmark, ess, resampled, nis, 3 * int(used.sum()), evidence, count, outcome, cause)
    return NestedState(front, belief), info


def _move(
    state: NestedState, dt: float, heading: float, code: RisCode | None, config: SlamConfig, *, rng: np.random.Generator
) -> tuple[WindowState, Nested]:
    """Predict the particles to the next cycle by the motion model, and append the present poses to their trail."""
    front, belief = state
    first = dt <= 0.0 and front.cycle == 0
    if not first:
        turn = config.turn_std * np.sqrt(dt) if config.heading == "estimated" else 0.0
        belief = propagate(belief, dt, config.sigma_a * config.axes, turn, rng=rng)
    if config.heading == "known":
        belief = belief._replace(heading=np.full_like(belief.heading, heading))
    elif config.heading == "velocity":
        belief = belief._replace(heading=np.arctan2(belief.velocity[:, 1], belief.velocity[:, 0]))
    belief = remember(belief, 1 if first else CONSTANTS.window)
    keep = len(belief.trail)
    step = np.zeros(0) if first else np.append(front.window.step, dt)[1 - keep :]
    headings = np.append(front.heading[:0] if first else front.heading, heading)[-keep:]
    front = front._replace(
        window=front.window._replace(step=step), heading=headings, codes=(*front.codes, code)[-keep:],
        attitude=np.zeros((len(headings), 3)),
        attitude_information=np.zeros((len(headings), *front.attitude_information.shape[1:])),
    )  # fmt: skip
    return _refresh_view(front, belief, config), belief


def _refresh_view(front: WindowState, belief: Nested, config: SlamConfig) -> WindowState:
    """Window state of the particle filter after its particles have changed: its window is their Gaussian view."""
    return front._replace(window=gaussian_view(belief, front.window.step, front.heading, config))


def _spans(front: WindowState) -> Floats:
    """Times (K,) [s] from each pose of the nested particle filter's trail to now."""
    return np.append(np.cumsum(front.window.step[::-1])[::-1], 0.0)


def _seen(front: WindowState, view: CycleAssociation, used: Booleans) -> Seen:
    """Observed returns (A,) that weigh the particles: of an unresolved group the strongest, less its partner's pull."""
    log, row = front.log, view.row[used]
    at = np.searchsorted(log.cycle, front.cycle) + view.pick[used]
    returns = compile_forms(front.landmarks.rows(log.form[at, 0]))
    seen = log.seen[at] - log.share[at, None] * view.groups.gap[row]
    return Seen(returns, front.landmarks.anchor, front.scene.body, seen, log.momentary(at) + FLOOR**2)


def _classify(front: WindowState, config: SlamConfig) -> tuple[WindowState, Booleans]:
    """Tracks the particle filter does not examine for births (young; wall returns, if thrown away), and which log
    entries are wall returns."""
    tracks, scene = front.tracks, front.scene
    need = config.nested.birth_cycles if config.use_vt or not len(front.landmarks.ident) else WALL_CYCLES
    looked = np.maximum(tracks.looked, 2 * need // 3)  # looked at again when their measurements have grown by a half
    removed = np.zeros(len(tracks.ident), dtype=np.bool_)
    if not config.use_vt:
        poses = window_gaussian.poses(front.window)
        poses[:, 3] += front.heading
        removed = wall_returns(tracks, front.log, front.cycle, poses, scene.body, scene.radio, config.nested)
        looked = np.where(removed, tracks.hits, looked)
    return front._replace(tracks=tracks._replace(looked=looked)), np.isin(front.log.track, tracks.ident[removed])


def _follow_map(
    belief: Nested, before: WindowState, after: WindowState, config: SlamConfig, *, rng: np.random.Generator
) -> Nested:
    """Particles of the nested filter with the map's present landmarks: removed ones dropped, a new one initialised."""
    keep = np.isin(before.landmarks.ident, after.landmarks.ident)
    belief = belief if keep.all() else drop(belief, keep)
    for row in range(len(belief.clouds), len(after.landmarks.ident)):
        engine, history = pick_engine(config.nested.engine), _history(after, row)
        belief = initialise_landmark(belief, history, after.scene.body, _spans(after), config.nested, engine, rng=rng)
    return belief


def _history(front: WindowState, row: int) -> LandmarkHistory:
    """Measurements in which a new feature of the map was found, and its prior, for the particle filter to start."""
    landmarks, log, window = front.landmarks, front.log, front.window
    at = (log.form[:, 0] == landmarks.ident[row]).any(axis=1).nonzero()[0]
    forms = landmarks.rows(log.form[at[0]])
    slots = log.cycle[at] - (front.cycle - window.num_poses + 1)
    known = np.unique(forms[0, (forms[0] >= 0) & (forms[0] != row)])
    local = np.append(known, row)
    own = np.where(forms[0] >= 0, np.searchsorted(known, forms[0]), forms[0])
    own = np.where(forms[0] == row, len(known), own)
    seen = log.seen[at]
    if forms[1, 0] != UNKNOWN:  # it comes out as one with another return: moved by what that pulls
        place = window_gaussian.poses(window)[slots]
        poses = poses_of(place[:, :3], front.heading[slots] + place[:, 3], front.scene.body)
        both = np.stack([observe(compile_forms(forms[[k]]), window.features, landmarks.anchor, poses).seen[:, 0]
                         for k in range(2)])  # fmt: skip
        seen = seen - log.share[at, None] * (both[1] - both[0])
    holds = window.holds
    mine = (holds.feature == row).nonzero()[0]
    axis, weight = holds.axis[mine], holds.probability[mine] / holds.std[mine] ** 2
    information = BROAD**-2.0 * AXES + (axis.T * weight) @ axis
    place = BROAD**-2.0 * window.features[row] + axis.T @ (weight * holds.aim[mine])
    prior = np.linalg.inv(information)
    return LandmarkHistory(
        compile_forms(own[None]), known, landmarks.anchor[local], prior @ place, prior, slots, seen,
        log.momentary(at),
    )  # fmt: skip


def wall_returns(
    tracks: WindowTracks, log: Log, cycle: int, poses: Floats, body: Body, radio: RadioConfig, config: NestedConfig
) -> Booleans:
    """Whether each track (T,) is a wall return for the particle filter, by the classifier, from K estimated poses (K,
    4) [m, rad].

    What the receiver says ran over the panel is none, however it looks to a classifier.
    """
    count, window = len(tracks.ident), len(poses)
    if not count:
        return np.zeros(0, dtype=np.bool_)
    row = np.minimum(np.searchsorted(tracks.ident, log.track), count - 1)
    at = (tracks.ident[row] == log.track).nonzero()[0]
    row, slot = row[at], log.cycle[at] - (cycle - window + 1)
    if config.classifier == "amplitude":
        ratio = log.log_amplitude[at] + np.log(np.maximum(log.seen[at, 0], 1e-3)) - free_space(radio)
        bright = np.bincount(row, ratio > np.log(config.specular_ratio), count)
        found = bright > 0.5 * np.bincount(row, minlength=count)
    else:
        seen, std, level = np.zeros((count, window, 3)), np.ones((count, window, 3)), np.zeros((count, window))
        held = np.zeros((count, window), dtype=np.bool_)
        seen[row, slot], std[row, slot], level[row, slot] = log.seen[at], log.std[at], log.log_amplitude[at]
        held[row, slot] = True
        features = track_features(Sightings(seen, std, level, held, poses[:, :3], poses[:, 3]), body, radio)
        network = config.classifier == "network"
        found = (classify(features, load_classifier()) if network else classify_geometric(features)) < 0.5
    return np.asarray(found & (tracks.side < PANEL))
