"""Window filter, one cycle: motion, measurement prediction, association, Gauss-Newton, landmark update, births,
removals."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.model import Body, DataSheet, Measurement, RisCode, SensorModel
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations, stranger_density
from rislam_rt.slam.start_prior import StartPrior
from rislam_rt.slam.step_checks import check_sides, check_step
from rislam_rt.slam.step_info import StepInfo
from rislam_rt.slam.window import tracks
from rislam_rt.slam.window.cycle_association import CycleAssociation, associate_cycle, score_again
from rislam_rt.slam.window.cycle_explanation import (
    components_to_explain,
    innovations,
    learn_cycle,
    levelled_observations,
    log_associations,
    outcome_of,
    remove_or_add_features,
    reweigh_wall_returns,
    unexplained,
)
from rislam_rt.slam.window.divergence import divergence_monitor, recovery
from rislam_rt.slam.window.landmarks.landmark_table import empty_table
from rislam_rt.slam.window.landmarks.landmark_update import no_observations
from rislam_rt.slam.window.landmarks.measurement_prediction import KnownEnvironment
from rislam_rt.slam.window.measurement_log import Residuals, empty_log, squares
from rislam_rt.slam.window.relinearisation import level, relinearise
from rislam_rt.slam.window.smoother import attitude, motion, window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import TURN
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.solver_limits import DAMPING, LATELY, MISSED, REFRESH, STILL
from rislam_rt.slam.window.state import WindowState


def init(
    start: StartPrior, body: Body, ris: DataSheet | None, sensor: SensorModel, config: SlamConfig,
    *, rng: np.random.Generator,
) -> WindowState:  # fmt: skip
    """State of the window filter before the first cycle: one pose at the start prior, and an empty map."""
    free = np.array([1.0, 1.0, float(config.height == "estimated")])
    offset = start.heading_std if config.heading == "estimated" else 0.0
    turns = config.heading != "known"
    std = np.concatenate([np.full(3, 1e-5), start.velocity_std * free, [offset]])
    window = window_gaussian.begin(start.position, start.velocity, std, turns=turns)
    scene = KnownEnvironment(body, sensor.radio, sensor, ris, config.max_bounces, config.use_vt)
    # what turns at all does so by ten times what a random walk of the heading tells in a cycle
    lively = (config.sigma_a, 0.0, *((10.0 * config.turn_std,) if turns else ()))
    motion_mode = np.stack([motion.first_motion_mode(level) for level in lively])
    return WindowState(
        0, config, window, empty_table(scene.num_panels), empty_log(), tracks.no_tracks(scene.num_panels),
        no_observations(),
        motion_mode, motion_mode,
        np.array([start.heading]), np.zeros((1, 3)), attitude.first_levels(compass=not turns), start.position_std * free, scene, CONSTANTS.log_lost, False, 0.0,
        (None,), np.zeros((0, 3)),
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
    turn = heading - float(state.heading[-1])
    state = _move(state, dt, heading)
    state = state._replace(codes=(*state.codes, code)[-state.window.num_poses :])
    scene = state.scene
    heard = components_to_explain(measurement, scene)
    observed = heard.observed
    strangers = stranger_density(observed, scene.sensor, max(config.new_density, unexplained(state, observed)))
    state, view = _associate_over_motions(state, heading, code, observed, strangers)
    bend = np.sqrt(float(motion.expected_variance(state.level[0] @ motion.transition(CONSTANTS.stay))))
    state, used = log_associations(state, observed, view)
    state, left, nis, uncertain = _solve(state, view, used)
    heard = heard._replace(observed=levelled_observations(observed, state.log, uncertain))
    jumped = state.lost_log_odds == 0.0
    state, landmark = learn_cycle(state, heard, view, used, left, dt, turn, bend, code)
    if state.cycle % REFRESH == 0 and scene.use_vt:  # without wall returns the fit is too free to show a scatter
        state = state._replace(log=reweigh_wall_returns(state.log, left, state.window.num_poses))
    state, wrong = recovery.check_motion(state)
    state = remove_or_add_features(state, left, view)
    outcome = outcome_of(len(measurement), len(state.landmarks.ident), wrong or jumped or state.lost_log_odds >= 0.0)
    if divergence_monitor.is_lost(state.lost_log_odds) and len(state.landmarks.ident):
        state = recovery.restart(state)
    info = StepInfo(landmark, 1.0, False, nis, 3 * len(view.row), 0.0, len(state.landmarks.points), outcome)
    return state._replace(cycle=state.cycle + 1), info


def _move(state: WindowState, dt: float, heading: float) -> WindowState:
    """Add a pose `dt` [s] after the last to the window, and marginalise the oldest when the window is full."""
    if dt <= 0.0 and state.cycle == 0:
        return state._replace(heading=np.array([heading]))
    window, motion_mode, headings, passed = state.window, state.motion_mode, state.heading, state.passed
    rotation = state.attitude
    while window.num_poses >= CONSTANTS.window:
        motion_mode = motion.forward(motion_mode, _likelihoods(window, len(window.accel))[:, 0], CONSTANTS.stay)
        passed = np.concatenate([passed, window.head[None, :3]])
        window, headings = window_gaussian.slide(window), headings[1:]
        rotation = rotation[1:]
    level = state.level @ motion.transition(CONSTANTS.stay)
    if state.config.motion == "told":
        window = window_gaussian.extend(window, dt, _assumed_precision(state.config, dt, window.turns))
    else:
        precision = _precisions(level)
        window = window_gaussian.extend(window, dt, precision, _surplus(precision, level))
    return state._replace(
        window=window, motion_mode=motion_mode, heading=np.append(headings, heading), passed=passed,
        attitude=np.concatenate([rotation, np.zeros((1, 3))]),
    )  # fmt: skip


def smoothed(state: WindowState) -> Floats:
    """Smoothed positions (K, 3) [m] of all cycles so far, each from a window's length of later cycles, fewer for the
    last ones."""
    return np.concatenate([state.passed, window_gaussian.poses(state.window)[:, :3]])


def _associate_over_motions(
    state: WindowState, heading: float, code: RisCode | None, observed: Observations, strangers: Floats
) -> tuple[WindowState, CycleAssociation]:
    """Associate a cycle's components under the motion as believed, a manoeuvre in the last steps, or a jump in
    position, and return the state and association of the likeliest.

    A jump has to explain the cycle better than being lost does, which explains nothing.
    """

    def view_of(window: Window) -> CycleAssociation:
        return associate_cycle(
            window, state.landmarks, state.visibility, heading, state.scene, code, observed, strangers,
            state.attitude_variance,
        )  # fmt: skip

    calm = best = view_of(state.window)
    window = state.window
    if state.config.motion == "learnt" and len(calm.groups.leader) and len(state.window.step):
        lively = window_gaussian.now_under(window, _livelier(window.solved), (calm.mean, calm.covariance))
        score = score_again(calm, *lively, observed, strangers)
        if score + CONSTANTS.log_rare > calm.score:
            trial = window_gaussian.solve(window._replace(precision=_livelier(window.precision)))
            view = view_of(trial)
            if view.score + CONSTANTS.log_rare > calm.score:
                best, window = view, trial
    if best.surprise > MISSED and (state.window.step[-2:] > 0.0).sum() == 2:
        by = divergence_monitor.jump(best, observed)
        view = view_of(divergence_monitor.shifted(state.window, by)) if by.any() else best
        if view.score + divergence_monitor.log_jump() > max(best.score, CONSTANTS.log_lost):
            return recovery.after_jump(state, by), view
    return state._replace(window=window), best


def _livelier(precision: Floats) -> Floats:
    """Prior precisions (K - 1, A) of the window's accelerations, the last steps' lowered to the liveliest motion mode,
    but not vertically."""
    found, lively = precision.copy(), COLUMNS[: precision.shape[1]] != 1
    found[-LATELY:, lively] = np.minimum(found[-LATELY:, lively], CONSTANTS.liveliest**-2.0)
    return found


GROUPS = (np.array([0, 1]), np.array([2]), np.array([TURN]))
"""Axes that share one chain of motion modes: the two horizontal ones, the vertical one, and the rate of turn."""
COLUMNS = np.array([0, 0, 1, 2])
"""Index into `GROUPS` of each axis."""


def _likelihoods(window: Window, count: int) -> Floats:
    """Log likelihoods (N, K, L) of the L motion modes in the window's first K steps, for N groups of axes."""
    size, free = len(window.head), window.accel.shape[1]
    every = np.arange(count)
    inside = window.covariance[size : size + count * free, size : size + count * free]
    block = inside.reshape(count, free, count, free)[every, :, every]
    found = np.stack([
        motion.log_likelihood(
            window.accel[:count, group], block[:, group[:, None], group], window.solved[:count, group[0]]
        )
        for group in GROUPS[: free - 1]
    ])  # fmt: skip
    found[0, :, motion.is_level_only()] = -np.inf
    return found


def _level_floor(window: Window, level: Floats) -> float:
    """Probability that the height moves as its motion modes (K, L) have it, and not as on a level floor."""
    size, free = len(window.head), window.accel.shape[1]
    covariance, solved = window.covariance[size + 2 :: free, size + 2 :: free], window.solved[:, 2]
    inner = np.linalg.inv(covariance)
    told, pull = inner - np.diag(solved), inner @ window.accel[:, 2]
    found, calm = (np.log(motion.expected_variance(each)) for each in (level, motion.first_motion_mode(0.0)))
    calm = np.log(1.0 / motion.expected_precision(motion.first_motion_mode(0.0)))
    found = -np.log(motion.expected_precision(level))
    share = np.linspace(0.0, 1.0, 5)
    std = np.exp(0.5 * (calm + share[:, None] * (found - calm)))
    inside = np.eye(len(told)) + std[:, :, None] * told * std[:, None, :]
    spun = std * pull
    score = 0.5 * np.vecdot(spun, np.linalg.solve(inside, spun[..., None])[..., 0]) - 0.5 * np.linalg.slogdet(inside)[1]
    score[1:] += CONSTANTS.log_rare
    weight = np.exp(score - score.max())
    return float(weight @ share / weight.sum())


def _pooled(one: Floats, other: Floats, share: float) -> Floats:
    """Logarithmic pool of probabilities (..., L)."""
    found = np.maximum(one, 1e-300) ** share * np.maximum(other, 1e-300) ** (1.0 - share)
    return np.asarray(found / found.sum(axis=-1, keepdims=True))


def _precisions(levels: Floats) -> Floats:
    """Prior precisions (..., A) of accelerations along A axes, from motion-mode probabilities (N, ..., L) of N groups
    of axes."""
    each = [motion.prior_precision(level, group == 2) for group, level in enumerate(levels)]
    return np.stack([each[group] for group in COLUMNS[: len(levels) + 1]], axis=-1)


def _surplus(precision: Floats, levels: Floats) -> Floats:
    """Variance (..., A) of the slopes of acceleration priors beyond their precisions (..., A), from motion-mode
    probabilities (N, ..., L) of N groups of axes (see `now_with_excess`)."""
    variance = np.stack([motion.expected_variance(levels[group]) for group in COLUMNS[: len(levels) + 1]], axis=-1)
    return np.asarray(np.maximum(precision**2 * variance - precision, 0.0))


def _assumed_precision(config: SlamConfig, dt: float, turns: bool) -> Floats:
    """Prior precisions (A,) of one step's acceleration, and of its rate of turn where the heading is estimated, under
    told motion."""
    upwards = config.sigma_a if config.height == "estimated" else STILL
    rates = (config.turn_std / np.sqrt(dt),) if turns else ()
    return np.array([config.sigma_a, config.sigma_a, upwards, *rates]) ** -2.0


def _solve(
    state: WindowState, view: CycleAssociation, used: Booleans
) -> tuple[WindowState, Residuals, float, Floats]:  # fmt: skip
    """Update the window with a cycle's associated components by two Gauss-Newton steps, the first on the association's
    predictions; re-linearises all poses every few cycles, else the last one. Also returns residuals, squared
    innovation, and the covariance (A, A) [rad^2] of the attitude."""
    axes = len(state.attitude_variance)
    innovation, jacobian, turned = innovations(view, state.log, used, state.cycle, axes)
    told = attitude.likelihood(innovation, jacobian, view.covariance, turned, state.attitude_variance)
    state = state._replace(sway=attitude.next_levels(state.sway, told))
    variance, last = state.attitude_variance, state.window.num_poses - 1
    covariance = np.linalg.inv(told.information[0] + np.diag(1.0 / variance))
    rotation = covariance @ told.slope[0]
    state = level(state, last, rotation[None])
    innovation = innovation - turned @ rotation
    window = window_gaussian.with_present(
        state.window, innovation, jacobian, turned, state.attitude[-1], variance
    )  # fmt: skip
    window = window_gaussian.solve(window, spread=False)
    state, left = relinearise(state._replace(window=window), 0 if state.cycle % REFRESH == 0 else last)
    window = window_gaussian.weigh_holds(window_gaussian.solve(state.window))
    left = left._replace(
        square=squares(left, state.log, window_gaussian.prediction_variance(window, left.slot, left.slopes))
    )
    return widen_motion(state._replace(window=window)), left, float(np.sum(innovation**2)), covariance


def widen_motion(state: WindowState) -> WindowState:
    """Re-estimate every step's motion-mode probabilities by forward-backward smoothing, and the prior precision of its
    acceleration from them."""
    window = state.window
    if not len(window.accel) or state.config.motion == "told":
        return state
    posterior, level = motion.smooth(state.motion_mode, _likelihoods(window, len(window.accel)), CONSTANTS.stay)
    share = _level_floor(window, posterior[1])
    calm = motion.first_motion_mode(0.0)
    posterior[1], level[1] = _pooled(posterior[1], calm, share), _pooled(level[1], calm, share)
    fresh = _precisions(posterior)
    # all steps at once, each as if the others were settled: damped, or they would take turns
    precision = np.exp((1.0 - DAMPING) * np.log(window.precision) + DAMPING * np.log(fresh))
    # the covariance is that of the precisions before
    surplus = _surplus(window.precision, posterior)
    return state._replace(window=window._replace(precision=precision, surplus=surplus), level=level)
