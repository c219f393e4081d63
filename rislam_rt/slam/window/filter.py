"""Window filter, one cycle: motion, measurement prediction, association, Gauss-Newton, landmark update, births,
removals."""

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.input_checks import check_sides, check_step
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations, stranger_density
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.step_info import LossCause, StepInfo, StepOutcome
from rislam_rt.slam.window import tracks
from rislam_rt.slam.window.cycle_association import CycleAssociation, associate_cycle, score_again, with_tilts
from rislam_rt.slam.window.cycle_explanation import (
    beside_panels,
    components_to_explain,
    innovations,
    learn_cycle,
    levelled_observations,
    log_associations,
    outcome_of,
    remove_or_add_features,
    unexplained,
)
from rislam_rt.slam.window.divergence import divergence_monitor, recovery
from rislam_rt.slam.window.landmarks.landmark_table import empty_table
from rislam_rt.slam.window.landmarks.landmark_update import no_observations
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.measurement_log import Residuals, empty_log, reweigh_wall_returns, squares
from rislam_rt.slam.window.motion import coordinated_turn, manoeuvres, motion_learning
from rislam_rt.slam.window.motion.track_rates import with_rates
from rislam_rt.slam.window.relinearisation import level, relinearise
from rislam_rt.slam.window.reported_threshold import sensor_of_reports
from rislam_rt.slam.window.smoother import attitude, heave, motion, window_gaussian
from rislam_rt.slam.window.smoother.attitude import Attitude
from rislam_rt.slam.window.smoother.marginals import prediction_variance
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.solver_limits import CLIMBED, LASTED, LATELY, REFRESH
from rislam_rt.slam.window.start_frame import in_room, no_frame, turned_with, with_turn_fixed, with_velocity_turned
from rislam_rt.slam.window.state import WindowState


def init(
    start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: SlamConfig,
    *, rng: np.random.Generator,
) -> WindowState:  # fmt: skip
    """State of the window filter before the first cycle: one pose at the start prior, and an empty map."""
    free = np.array([1.0, 1.0, float(config.height == "estimated")])
    offset = start.heading_std if config.heading == "estimated" else 0.0
    turns, turned = config.heading != "known", offset > 0.0 and config.filter == "window"
    std = np.concatenate([np.full(3, 1e-5), start.velocity_std * free, [0.0 if turned else offset]])
    velocity, heave_levels = start.velocity.copy(), heave.first_levels()
    if config.filter == "window" and config.motion == "learnt" and config.use_vt:
        velocity[2], std[5], heave_levels = heave.at_start(float(velocity[2]), float(std[5]))
    height = np.array([start.position[2], 0.0])
    window = window_gaussian.begin(start.position, velocity, std, turns=turns)
    window = heave.with_heave(window, heave.variance(heave_levels), height)
    frame = no_frame(start)
    if turned:
        window, frame = with_velocity_turned(window, start), turned_with(start)
    scene = KnownEnvironment(body, sensor.radio, sensor, ris, config.max_bounces, config.use_vt)
    # what turns at all does so by ten times what a random walk of the heading tells in a cycle
    lively = (config.sigma_a, 0.0, *((10.0 * config.turn_std,) if turns else ()))
    motion_mode = np.stack([motion.first_motion_mode(level) for level in lively])
    return WindowState(
        0, config, window, empty_table(scene.num_panels), empty_log(), tracks.no_tracks(scene.num_panels),
        no_observations(),
        motion_mode, motion_mode, True, True, float(scipy.special.logit(CONSTANTS.stay)),
        np.array([start.heading]), np.zeros((1, 3)), np.zeros((1, 2 + (not turns), 2 + (not turns))),
        attitude.first_levels(compass=not turns), heave_levels, height,
        start.position_std * free, frame, scene, CONSTANTS.log_lost, False, 0.0,
        (None,), np.zeros((0, 3)), sensor, (),
    )  # fmt: skip


def step(
    state: WindowState, measurement: Measurement, code: RisCode | None, dt: float, heading: float, config: SlamConfig,
    *, rng: np.random.Generator,
) -> tuple[WindowState, StepInfo]:  # fmt: skip
    """Advance the window filter by one cycle's measurement, `dt` [s] after the last; returns the state and diagnostics.

    `heading` [rad] is what a compass tells, and counts only if the heading is "known"; `code` is the phase code that
    the agent believes was applied.
    """
    check_step(dt, heading, code, state.scene.ris)
    check_sides(measurement, state.scene.ris)
    if config.heading != "known":
        heading = float(state.heading[-1])
    else:
        heading += state.turned
    turn, restarted = heading - float(state.heading[-1]), state.lost_log_odds == 0.0
    state = manoeuvres.with_climb(manoeuvres.with_manoeuvre(with_rates(_move(state, dt, heading))))
    snr = state.scene.radio.integrated_snr(measurement.amplitude)
    reported = (*state.reported, snr)[-CONSTANTS.window :]
    scene = state.scene._replace(sensor=sensor_of_reports(state.sensor, reported))
    state = state._replace(codes=(*state.codes, code)[-state.window.num_poses :], scene=scene, reported=reported)
    heard = components_to_explain(measurement, scene)
    observed = heard.observed
    strangers = stranger_density(observed, scene.sensor, max(config.new_density, unexplained(state, observed)))
    bend = np.sqrt(float(motion.expected_variance(state.level[0] @ motion.transition(CONSTANTS.stay))))
    beside = beside_panels(state, observed, dt, turn, bend)
    state, view, lively = _associate_over_motions(state, heading, code, observed, strangers, beside)
    state, used = log_associations(state, observed, view)
    state, view, left, nis, uncertain = _solve(state, view, used, lively)
    heard = heard._replace(observed=levelled_observations(observed, state.log, uncertain))
    jumped, before = state.lost_log_odds == 0.0, state.lost_log_odds
    state, landmark = learn_cycle(state, heard, view, used, left, dt, turn, bend, code)
    if state.cycle % REFRESH == 0 and scene.use_vt:  # without wall returns the fit is too free to show a scatter
        state = state._replace(log=reweigh_wall_returns(state.log, left, state.window.num_poses))
    heard_odds = state.lost_log_odds
    state, wrong = recovery.check_motion(state)
    cause = divergence_monitor.cause_of_loss(before, heard_odds, state.lost_log_odds, view.score)
    if wrong or jumped:
        cause = LossCause.START if wrong else LossCause.RESTART if restarted else LossCause.JUMP
    state = remove_or_add_features(state, left, view)
    outcome = outcome_of(len(measurement), len(state.landmarks.ident), wrong or jumped or state.lost_log_odds >= 0.0)
    if divergence_monitor.is_lost(state.lost_log_odds) and len(state.landmarks.ident):
        state = recovery.restart(state)
    cause = cause if outcome == StepOutcome.DIVERGED else LossCause.NONE
    info = StepInfo(landmark, 1.0, False, nis, 3 * len(view.row), 0.0, len(state.landmarks.points), outcome, cause)
    return state._replace(cycle=state.cycle + 1), info


def _move(state: WindowState, dt: float, heading: float) -> WindowState:
    """Add a pose `dt` [s] after the last to the window, and marginalise the oldest when the window is full."""
    if dt <= 0.0 and state.cycle == 0:
        return state._replace(heading=np.array([heading]))
    window, motion_mode, headings, passed = state.window, state.motion_mode, state.heading, state.passed
    rotation, told = state.attitude, state.attitude_information
    odds, turn = state.coordinated_log_odds, heading - float(headings[-1])
    while window.num_poses >= CONSTANTS.window:
        odds = coordinated_turn.log_odds_after(
            state._replace(window=window, heading=headings, coordinated_log_odds=odds)
        )
        told_of_first = motion_learning.likelihoods(window, 1, motion_learning.vertical_information(window))[:, 0]
        motion_mode = motion.forward(motion_mode, told_of_first, CONSTANTS.stay)
        passed = np.concatenate([passed, window_gaussian.poses(window)[:1, :3]])
        state = state._replace(frame=with_turn_fixed(state.frame, window))
        window, headings = window_gaussian.slide(window), headings[1:]
        rotation, told = rotation[1:], told[1:]
    level = state.level @ motion.transition(CONSTANTS.stay)
    if state.config.motion == "told":
        window = window_gaussian.extend(window, dt, motion_learning.assumed_precision(state.config, dt, window.turns))
    else:
        precision = motion_learning.precisions(level)
        velocity_turn = coordinated_turn.velocity_turn(state, turn)
        window = window_gaussian.extend(window, dt, precision, motion_learning.variances(level), velocity_turn)
    return state._replace(
        window=window, motion_mode=motion_mode, heading=np.append(headings, heading), passed=passed,
        coordinated_log_odds=odds,
        attitude=np.concatenate([rotation, np.zeros((1, 3))]),
        attitude_information=np.concatenate([told, np.zeros((1, *told.shape[1:]))]),
    )  # fmt: skip


def smoothed(state: WindowState) -> Floats:
    """Smoothed positions (K, 3) [m] by the window filter in all cycles so far, each from a window's length of later
    cycles, fewer for the last ones."""
    places = np.concatenate([state.passed, window_gaussian.poses(state.window)[:, :3]])
    return in_room(state.frame, state.window, places)


def _associate_over_motions(
    state: WindowState, heading: float, code: RisCode | None, observed: Observations, strangers: Floats,
    beside: tracks.Continuations | None,
) -> tuple[WindowState, CycleAssociation, tuple[float, float]]:  # fmt: skip
    """Associate a cycle's components under the motion as believed, a manoeuvre in the last steps, across and then
    upwards, a turn of the body that no compass tells, or a jump in position, and return the state and association of
    the likeliest, and the log odds of these two manoeuvres, 0 for what is not believed.

    A body that begins to bob is asked about beside one that begins to climb. A jump has to explain the cycle better
    than being lost does, which explains nothing.
    """

    heaved = state.heave_variance

    def view_of(window: Window) -> CycleAssociation:
        return associate_cycle(
            window, state.landmarks, state.visibility, heading, state.scene, code, observed, strangers,
            state.sway, beside, heaved,
        )  # fmt: skip

    lively, window, best = [0.0, 0.0], state.window, view_of(state.window)
    level_floor = window, best
    learnt = state.config.motion == "learnt"  # a motion that is told stays told
    for axis in range(2 if learnt and len(best.groups.leader) and len(window.step) else 0):
        steps = (LATELY, CLIMBED)[axis]
        solved = manoeuvres.livelier(window.solved, steps, upwards=axis == 1)
        now = window_gaussian.now_under(window, solved, (best.mean, best.covariance))
        prior = CONSTANTS.log_rare - axis * CONSTANTS.log_upright  # upwards, of a floor that is not level besides
        if score_again(best, *now, observed, strangers) + prior > best.score:
            trial = manoeuvres.solve_livelier(window, steps, upwards=axis == 1)
            view = view_of(trial)
            log_odds = view.score + prior - best.score
            if log_odds > 0.0:
                lively[axis], window, best = log_odds, trial, view
        if axis == 0:
            level_floor = window, best
    if not heaved and len(best.groups.leader) and state.may_heave:
        floor, plain = level_floor
        prior, heaved = heave.begins(state.heave_levels)
        wide = plain.covariance.copy()
        wide[2, 2] += heaved
        rival = best.score + (CONSTANTS.log_rare - CONSTANTS.log_upright if lively[1] else 0.0)
        tried = score_again(plain, plain.mean, wide, observed, strangers) + prior > rival
        if tried and (view := view_of(floor)).score + prior > rival:
            lively[1], window, best = 0.0, floor, view
        else:
            heaved = 0.0
    if best.surprise > 1.0 and learnt and window.turns and (window.step[-1:] > 0.0).any():
        angle = divergence_monitor.turn(best, observed, float(state.scene.sensor.cell_length[0]))
        trial = divergence_monitor.turned(manoeuvres.solve_livelier(window), angle)
        view = view_of(trial)
        if view.score + divergence_monitor.log_turn() > best.score:
            best, window = view, trial
    if best.surprise > 1.0 and (state.window.step[-2:] > 0.0).sum() == 2:
        by, view = np.zeros(3), best
        for _ in range(2):  # the first step of the iteration may be centimetres off
            more = divergence_monitor.jump(view, observed, state.scene.use_vt)
            closer = view_of(divergence_monitor.shifted(state.window, by + more)) if more.any() else view
            if closer is view or (by.any() and closer.score <= view.score):
                break
            by, view = by + more, closer
        if by.any() and view.score + divergence_monitor.log_jump() > max(best.score, CONSTANTS.log_lost):
            walls = divergence_monitor.with_another_wall(state.window, state.landmarks, by)
            others = [other.score for other in map(view_of, walls) if other.surprise <= 1.0]
            another = max(others, default=-np.inf) + divergence_monitor.log_another_wall()
            if view.score + divergence_monitor.log_jump() > another:
                return recovery.after_jump(state, by), view, (0.0, 0.0)
    return state._replace(window=window), best, (lively[0], lively[1])


def _solve(
    state: WindowState, view: CycleAssociation, used: Booleans, lively: tuple[float, float]
) -> tuple[WindowState, CycleAssociation, Residuals, float, Floats]:  # fmt: skip
    """Update the window with a cycle's associated components by two Gauss-Newton steps, the first on the association's
    predictions; re-linearises all poses every few cycles, else the last one. `lively` are the log odds of manoeuvres by
    which they were associated. Also returns the association with what the attitude makes of it, residuals, squared
    innovation, and the covariance (A, A) [rad^2] of the attitude."""
    axes, spacing = len(state.attitude_variance), state.scene.radio.array.spacing
    innovation, jacobian, turned = innovations(view, state.log, used, state.cycle, axes, spacing)
    sharper = state.log.sharper(int(np.searchsorted(state.log.cycle, state.cycle)) + view.pick[used])
    told = attitude.likelihood(
        innovation * sharper, jacobian * sharper[..., None], view.covariance, turned * sharper[..., None],
        np.append(state.attitude_variance, state.heave_uncertainty),
    )  # fmt: skip
    state, begun = _with_heave_learnt(state, told)
    rotation = heave.without(told, float(state.window.heave_variance[-1]))
    sway = attitude.next_levels(state.sway, rotation)
    view = with_tilts(view, attitude.tilts(sway, rotation))
    sway[0] = view.tilts.weight.sum(axis=1)
    known = np.concatenate([state.attitude_information[:-1], rotation.information])
    state = state._replace(sway=sway, attitude_information=known)
    variance, last = state.nuisance_variance[-1], state.window.num_poses - 1
    nuisance, covariance = attitude.posterior(variance, heave.restricted(told, len(variance)))
    state = level(state, last, nuisance[None])
    turned = turned[..., : len(variance)]
    innovation = innovation - turned @ nuisance
    window = window_gaussian.with_present(
        state.window, innovation, jacobian, turned, state.nuisance[-1], variance
    )  # fmt: skip
    window = window_gaussian.solve(window, spread=False)
    state, left = relinearise(state._replace(window=window), 0 if begun or state.cycle % REFRESH == 0 else last)
    window = window_gaussian.weigh_holds(window_gaussian.solve(state.window))
    spread = prediction_variance(window, left.slot, left.slopes)
    left = left._replace(square=squares(left.row, left.left, state.log, spread, _excess_variance(window, left)))
    state = coordinated_turn.learn_coordinated_turn(motion_learning.learn_motion(state._replace(window=window), lively))
    if lively[1] and state.is_level:  # associated as if it climbed, which the other steps contradict
        state = state._replace(window=window_gaussian.solve(state.window))
    return state, view, left, float(np.sum(innovation**2)), covariance[:axes, :axes]


def _with_heave_learnt(state: WindowState, told: Attitude) -> tuple[WindowState, bool]:
    """State whose heave's deviation is learnt from what is `told` of attitude and heave of one more cycle, and whether
    it has come to be believed in, for all cycles of the window then.

    To begin with, single cycles may speak for a heave where the floor rises, and a floor that is held for uneven
    explains one: so the whole window is asked (`heave.window_levels`).
    """
    if not state.may_heave:
        return state, False
    window, begun = state.window, False
    state = state._replace(heave_levels=heave.next_levels(state.heave_levels, told, state.attitude_variance))
    start = state.start_height if window.num_poses > state.cycle else None
    if state.heaves:
        if start is not None and state.heave_variance > window.heave_variance[0]:  # the first ones were a guess
            window = heave.with_heave(window, state.heave_variance, start)
        variance = np.append(window.heave_variance[:-1], state.heave_variance)
        return state._replace(window=window._replace(heave_variance=variance)), False
    doubted = state.heave_variance > 0.0 or (not state.is_level and state.cycle % REFRESH == 0)
    if doubted and len(window.step) > LASTED[0] and (window.step > 0.0).all():
        rises = window_gaussian.pose_design(window)[1:, 2, HEAD + 2 :: window.accel.shape[1]]
        found = heave.window_levels(*motion_learning.vertical_information(window), rises)
        begun = heave.variance(found) > 0.0
        state = state._replace(heave_levels=found, is_level=state.is_level or begun)
    if begun:
        state = state._replace(window=heave.with_heave(window, state.heave_variance, start))
    return state, begun


def _excess_variance(window: Window, left: Residuals) -> Floats:
    """Variance (A, 3) of residuals, in squared deviations, by the window's excess covariance: by manoeuvres that the
    estimate holds for none.

    Of white accelerations over equal steps the variance of the place grows with the cube of time.
    """
    astray = window_gaussian.excess_now(window)[:3, :3]
    late = ((left.slot + 1.0) / window.num_poses) ** 3.0
    slopes = left.slopes[..., :3]
    return np.asarray(np.vecdot(slopes @ astray, slopes) * late[:, None])
