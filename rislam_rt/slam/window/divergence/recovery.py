"""Recovery from divergence: a corrected start, a jump to another position, or a restart with an empty map."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window import tracks
from rislam_rt.slam.window.landmarks.landmark_table import empty_table
from rislam_rt.slam.window.landmarks.landmark_update import no_observations
from rislam_rt.slam.window.measurement_log import empty_log
from rislam_rt.slam.window.motion import motion_agreement
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.smoother.cholesky import inverse
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic, Window
from rislam_rt.slam.window.start_frame import with_turn_fixed, without_velocity
from rislam_rt.slam.window.state import WindowState


def check_motion(state: WindowState) -> tuple[WindowState, bool]:
    """Recovery from a wrong start, which before any birth a check of the motion against the rates of path lengths
    corrects once, in the first cycles; later the same updates the odds of being lost, with a map or without one. Also
    returns whether the start was corrected."""
    if not motion_agreement.is_checked(state):
        return state, False
    begins = not len(state.landmarks.ident) and len(state.heading) <= motion_agreement.PAST + 1
    if state.start_was_wrong or not begins:  # later the speed may be another
        if state.cycle % motion_agreement.PAST == 0:
            odds = motion_agreement.log_other_motion(state)
            state = state._replace(
                lost_log_odds=float(np.clip(state.lost_log_odds + odds, CONSTANTS.log_lost, -CONSTANTS.log_lost))
            )
        return state, False
    told = motion_agreement.check_start(state)
    if told is None or told.log_odds <= 0.0:
        return state, False
    state = state._replace(start_was_wrong=True)
    if not told.is_compass:
        window = with_velocity(state.window, told.velocity, told.std)
        return state._replace(window=window, frame=without_velocity(state.frame)), True
    # a compass that was wrong is not trusted: its offset is estimated from now on
    window = with_free_compass(state.window, told.std / float(np.linalg.norm(told.velocity)))
    state = state._replace(heading=state.heading + told.turn, turned=state.turned + told.turn)
    if not state.window.turns:
        still = motion.first_motion_mode(0.0)[None]
        state = state._replace(
            motion_mode=np.concatenate([state.motion_mode, still]), level=np.concatenate([state.level, still])
        )
    return state._replace(window=window), True


def restart(state: WindowState) -> WindowState:
    """State of the window filter restarted with an empty map: the pose is kept, its position's deviation grown by
    `walk` beside the Gaussian."""
    window = state.window
    mean, covariance = window_gaussian.now(window)
    lively = np.sqrt(motion.expected_variance(state.level))[[0, 0, 1]]
    std = np.sqrt(np.concatenate([np.full(3, 1e-10), np.diag(covariance)[3:6] + lively**2, [covariance[6, 6]]]))
    # a height known at the start is filtered from then on, unless the motion is told
    away = CONSTANTS.walk * np.array(
        [1.0, 1.0, float(state.config.height == "estimated" or state.config.motion == "learnt")]
    )
    shift = np.sqrt(state.shift**2 + np.diag(covariance)[:3] + away**2)
    fresh = window_gaussian.begin(mean[:3], mean[3:6], std, turns=window.turns)
    fresh = fresh._replace(head=mean[:HEAD], prior=fresh.prior._replace(middle=mean[:HEAD]))
    return state._replace(
        window=fresh, landmarks=empty_table(state.scene.num_panels)._replace(next_ident=state.landmarks.next_ident),
        log=empty_log(), tracks=tracks.no_tracks(state.scene.num_panels), visibility=no_observations(),
        motion_mode=state.level, is_level=True,
        heading=state.heading[-1:], attitude=state.attitude[-1:],
        attitude_information=state.attitude_information[-1:], shift=shift, lost_log_odds=0.0, start_was_wrong=False,
        codes=state.codes[-1:], passed=np.concatenate([state.passed, window_gaussian.poses(window)[:-1, :3]]),
        frame=with_turn_fixed(state.frame, window),
    )  # fmt: skip


def after_jump(state: WindowState, by: Floats) -> WindowState:
    """Recovery by the agent's jump by `by` (3,) [m]: the last pose alone, with the map, and even odds of being lost
    until the next cycle."""
    passed = np.concatenate([state.passed, window_gaussian.poses(state.window)[:-1, :3]])
    return state._replace(
        window=window_after_jump(state.window, by), motion_mode=state.level,
        heading=state.heading[-1:], attitude=state.attitude[-1:],
        attitude_information=state.attitude_information[-1:], codes=state.codes[-1:],
        passed=passed, lost_log_odds=0.0, frame=with_turn_fixed(state.frame, state.window),
    )  # fmt: skip


def window_after_jump(window: Window, by: Floats) -> Window:
    """Sliding window after the agent's jump by `by` (3,) [m]: the last pose alone, uncertain by a second's walk;
    velocity and map as they were."""
    while window.num_poses > 1:
        window = window_gaussian.slide(window)
    head, size = window.head.copy(), len(window.head)
    head[:3] += by
    covariance = inverse(window.prior.hessian)
    covariance[[0, 1], [0, 1]] += CONSTANTS.walk**2
    slots = window.slots._replace(middle=np.concatenate([head[[0, 1, 2, 6]], head[HEAD:]])[None])
    prior = Quadratic(inverse(covariance), np.zeros(size), head)
    turn = prior.hessian @ inverse(window.prior.hessian)
    noise = turn @ window.noise @ turn.T
    return window._replace(head=head, prior=prior, noise=noise, slots=slots, covariance=covariance)


def with_velocity(window: Window, velocity: Floats, std: float) -> Window:
    """Sliding window with another horizontal velocity at its start, before any birth, within `std` [m/s] or the told
    deviation, whichever is larger."""
    head, hessian = window.head.copy(), window.prior.hessian.copy()
    # the tracks will be asked again, as features: their word is not to count twice
    information, axes = np.linalg.eigh(hessian[3:5, 3:5])
    head[3:5], hessian[3:5, 3:5] = velocity[:2], (axes * np.minimum(information, std**-2.0)) @ axes.T
    return _begun(window, head, hessian)


def with_free_compass(window: Window, std: float) -> Window:
    """Sliding window whose compass offset is estimated from now on, before any birth: within `std` [rad], with the
    least rate of turn where none was estimated."""
    hessian, still = window.prior.hessian.copy(), ((0, 0), (0, int(not window.turns)))
    hessian[6, 6] = std**-2.0
    precision = np.pad(window.precision, still, constant_values=CONSTANTS.calmest**-2.0)
    window = window._replace(accel=np.pad(window.accel, still), variance=np.pad(window.variance, still))
    # directions hang on the heading from now on: no rates of lengths with them
    return _begun(window._replace(precision=precision, rates=None), window.head, hessian)


def _begun(window: Window, head: Floats, hessian: Floats) -> Window:
    """Sliding window with another head and Hessian of its prior, solved anew."""
    return window_gaussian.solve(window._replace(head=head, prior=Quadratic(hessian, np.zeros(len(head)), head)))
