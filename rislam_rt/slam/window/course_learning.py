"""Learning whether the agent's course follows its heading: whether its velocity turns as its body does.

Who walks and what drives goes where it faces, mostly: then a curve is calm motion along a direction that the compass
tells (a coordinated turn). Who looks about, or strafes, does not: then the velocity is kept while the body turns. Both
are weighed by the marginal likelihood of the window's steps under the chain of motion modes, in which a turn that the
motion does not need asks for an acceleration. As nobody tells, both are as likely at first, and a course that follows
the heading goes on to do so as a motion mode does.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.state import WindowState


def is_asked(state: WindowState) -> bool:
    """Whether the course may be learnt: where the motion is, and a compass tells how the body turns."""
    return state.config.motion == "learnt" and not state.window.turns


def course_change(state: WindowState, turn: float) -> float:
    """Course change [rad] of a step over which the body turns by `turn` [rad], as is believed by now."""
    return turn if state.follows and is_asked(state) else 0.0


def learn_course(state: WindowState) -> WindowState:
    """State with the motion of its window's steps expressed anew, if the odds say now that the course follows the
    heading, or no more does."""
    turn = np.diff(state.heading)
    if not is_asked(state) or len(turn) != len(state.window.step) or not turn.any():
        return state
    like = _log_likelihoods(state, turn)
    odds = state.course_log_odds + np.subtract(*motion.log_evidence(state.motion_mode[0], like, CONSTANTS.stay))
    if (odds > 0.0) == state.follows:
        return state
    course = turn if odds > 0.0 else np.zeros(len(turn))
    return state._replace(window=window_gaussian.solve(with_course(state.window, course)), follows=bool(odds > 0.0))


def log_odds_after(state: WindowState) -> float:
    """Log odds that the course follows the heading after the window's first step, which is to leave it, from those
    before it and what it tells."""
    turn = np.diff(state.heading[:2])
    odds = state.course_log_odds
    if is_asked(state) and turn.any():
        like = _log_likelihoods(state, turn)
        odds += float(np.subtract(*motion.log_evidence(state.motion_mode[0], like, CONSTANTS.stay)))
    stays = CONSTANTS.stay
    share = 1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0)))
    share = share * stays + (1.0 - share) * (1.0 - stays)
    return float(np.log(share / (1.0 - share)))


def _log_likelihoods(state: WindowState, turn: Floats) -> Floats:
    """Log likelihoods (2, K, L) of the motion modes in the window's first K steps, over which the body turned by `turn`
    (K,) [rad]: were the course to follow the heading, and were it not."""
    window, count, free = state.window, len(turn), state.window.accel.shape[1]
    size, every = len(window.head), np.arange(count)
    inside = window.covariance[size : size + count * free, size : size + count * free]
    spread = inside.reshape(count, free, count, free)[every, :2, every, :2]
    shift = np.stack([_asked_for(window, course) for course in (turn, np.zeros(count))])
    found = motion.log_likelihood(window.accel[:count, :2], spread, window.solved[:count, 0], shift)
    found[..., motion.is_level_only()] = -np.inf
    return found


def _asked_for(window: Window, course: Floats) -> Floats:
    """Accelerations (K, 2) [m/s^2] beyond those of the window's first K steps that other course changes (K,) [rad] ask
    for, if the agent moves the same; 0 over steps that take no time."""
    count = len(course)
    step, own = window.step[:count], window.course[:count]
    speed = _velocities(window)[:count]
    by = (np.exp(1j * own) - np.exp(1j * course)) * speed / np.where(step > 0.0, step, np.inf)
    return np.stack([by.real, by.imag], axis=1)


def _velocities(window: Window) -> Floats:
    """Horizontal velocities (K,) [m/s] of the window's poses, as complex numbers."""
    angle = np.exp(1j * np.concatenate([[0.0], np.cumsum(window.course)]))
    first, accel = complex(*window.head[3:5]), window.accel[:, 0] + 1j * window.accel[:, 1]
    return np.asarray(angle * np.concatenate([[first], first + np.cumsum(window.step * accel * angle[1:].conj())]))


def with_course(window: Window, course: Floats) -> Window:
    """Window of the same motion, expressed by other course changes (K - 1,) [rad] and the accelerations that these ask
    for."""
    accel = window.accel.copy()
    accel[:, :2] += _asked_for(window, course)
    return window._replace(accel=accel, course=course)
