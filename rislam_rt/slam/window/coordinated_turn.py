"""Learning whether the agent goes where it faces: whether its velocity turns as its body does.

Who walks and what drives goes where it faces, mostly: then a curve is calm motion along a direction that the compass
tells (a coordinated turn). Who looks about, or strafes, does not: then the velocity is kept while the body turns. Both
are weighed by the marginal likelihood of the window's steps under the chain of motion modes, in which a turn that the
motion does not need asks for an acceleration. That an agent does not go where it faces is rare at first; later it
changes as rarely as motion modes do, from the one to the other and back.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.state import WindowState


def is_asked(state: WindowState) -> bool:
    """Whether that may be learnt: where the motion is, and a compass tells how the body turns."""
    return state.config.motion == "learnt" and not state.window.turns


def velocity_turn(state: WindowState, turn: float) -> float:
    """Turn of the velocity [rad] over a step in which the body turns by `turn` [rad], as is believed by now."""
    return turn if state.is_coordinated and is_asked(state) else 0.0


def learn_coordinated_turn(state: WindowState) -> WindowState:
    """State with the motion of its window's steps expressed anew, if the odds say from now on that the agent goes where
    it faces, or that it does no more."""
    turn = np.diff(state.heading)
    if not is_asked(state) or len(turn) != len(state.window.step) or not turn.any():
        return state
    like = _log_likelihoods(state, turn)
    odds = state.coordinated_log_odds + np.subtract(*motion.log_evidence(state.motion_mode[0], like, CONSTANTS.stay))
    if (odds > 0.0) == state.is_coordinated:
        return state
    angle = turn if odds > 0.0 else np.zeros(len(turn))
    return state._replace(
        window=window_gaussian.solve(with_velocity_turn(state.window, angle)), is_coordinated=bool(odds > 0.0)
    )


def log_odds_after(state: WindowState) -> float:
    """Log odds that the agent goes where it faces after the window's first step, which is to leave it, from those
    before it and what it tells."""
    turn = np.diff(state.heading[:2])
    odds = state.coordinated_log_odds
    if is_asked(state) and turn.any():
        like = _log_likelihoods(state, turn)
        odds += float(np.subtract(*motion.log_evidence(state.motion_mode[0], like, CONSTANTS.stay)))
    stays = CONSTANTS.stay
    share = 1.0 / (1.0 + np.exp(-np.clip(odds, -50.0, 50.0)))
    share = share * stays + (1.0 - share) * (1.0 - stays)
    return float(np.log(share / (1.0 - share)))


def _log_likelihoods(state: WindowState, turn: Floats) -> Floats:
    """Log likelihoods (2, K, L) of the motion modes in the window's first K steps, over which the body turned by `turn`
    (K,) [rad]: did the agent go where it faces, and did it not."""
    window, count, free = state.window, len(turn), state.window.accel.shape[1]
    size, every = len(window.head), np.arange(count)
    inside = window.covariance[size : size + count * free, size : size + count * free]
    spread = inside.reshape(count, free, count, free)[every, :2, every, :2]
    shift = np.stack([_asked_for(window, angle) for angle in (turn, np.zeros(count))])
    found = motion.log_likelihood(window.accel[:count, :2], spread, window.solved[:count, 0], shift)
    found[..., motion.is_level_only()] = -np.inf
    return found


def _asked_for(window: Window, angle: Floats) -> Floats:
    """Accelerations (K, 2) [m/s^2] beyond those of the window's first K steps that other turns (K,) [rad] of the
    velocity ask for, if the agent moves the same; 0 over steps that take no time."""
    count = len(angle)
    step, own = window.step[:count], window.velocity_turn[:count]
    speed = _velocities(window)[:count]
    by = (np.exp(1j * own) - np.exp(1j * angle)) * speed / np.where(step > 0.0, step, np.inf)
    return np.stack([by.real, by.imag], axis=1)


def _velocities(window: Window) -> Floats:
    """Horizontal velocities (K,) [m/s] of the window's poses, as complex numbers."""
    turned = np.exp(1j * np.concatenate([[0.0], np.cumsum(window.velocity_turn)]))
    first, accel = complex(*window.head[3:5]), window.accel[:, 0] + 1j * window.accel[:, 1]
    return np.asarray(turned * np.concatenate([[first], first + np.cumsum(window.step * accel * turned[1:].conj())]))


def with_velocity_turn(window: Window, angle: Floats) -> Window:
    """Window of the same motion, expressed by other turns (K - 1,) [rad] of the velocity and the accelerations that
    these ask for."""
    accel = window.accel.copy()
    accel[:, :2] += _asked_for(window, angle)
    return window._replace(accel=accel, velocity_turn=angle)
