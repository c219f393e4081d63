"""Learning whether the agent goes where it faces: whether its velocity turns as its body does.

Who walks and what drives goes where it faces, mostly: then a curve is calm motion along a direction that the compass
tells (a coordinated turn). Who looks about, or strafes, does not: then the velocity is kept while the body turns. Both
are weighed by the marginal likelihood of the window's steps under the chain of motion modes, in which a turn that the
motion does not need asks for an acceleration. That an agent does not go where it faces is rare at first; later it
changes as rarely as motion modes do, from the one to the other and back.
"""

import numpy as np
import scipy

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import horizontal
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
    follows = state.coordinated_log_odds + _log_ratio(state, turn) > 0.0
    if follows == state.is_coordinated:
        return state
    window = with_velocity_turn(state.window, turn if follows else np.zeros(len(turn)))
    return state._replace(window=window_gaussian.solve(window), is_coordinated=follows)


def log_odds_after(state: WindowState) -> float:
    """Log odds that the agent goes where it faces after the window's first step, which is to leave it, from those
    before it and what it tells."""
    turn, odds = np.diff(state.heading[:2]), state.coordinated_log_odds
    if is_asked(state) and turn.any():
        odds += _log_ratio(state, turn)
    share, stays = scipy.special.expit(odds), CONSTANTS.stay
    return float(scipy.special.logit(share * stays + (1.0 - share) * (1.0 - stays)))


def _log_ratio(state: WindowState, turn: Floats) -> float:
    """Log likelihood ratio of going where one faces against keeping the velocity, by the window's first K steps, over
    which the body turned by `turn` (K,) [rad]."""
    coordinated, kept = motion.log_evidence(state.motion_mode[0], _log_likelihoods(state, turn), CONSTANTS.stay)
    return float(coordinated - kept)


def _log_likelihoods(state: WindowState, turn: Floats) -> Floats:
    """Log likelihoods (2, K, L) of the motion modes in the window's first K steps, over which the body turned by `turn`
    (K,) [rad]: did the agent go where it faces, and did it not."""
    window, count = state.window, len(turn)
    spread = window_gaussian.step_covariances(window, count)[:, :2, :2]
    shift = _asked_for(window, np.stack([turn, np.zeros(count)]))
    found = motion.log_likelihood(window.accel[:count, :2], spread, window.solved[:count, 0], shift)
    found[..., motion.is_level_only()] = -np.inf
    return found


def _asked_for(window: Window, angle: Floats) -> Floats:
    """Accelerations (..., K, 2) [m/s^2] beyond those of the window's first K steps that other turns (..., K) [rad] of
    the velocity ask for, if the agent moves the same; 0 over steps that take no time."""
    count = angle.shape[-1]
    step, own = window.step[:count], window.velocity_turn[:count]
    speed = _velocities(window)[:count]
    by = (np.exp(1j * own) - np.exp(1j * angle)) * speed / np.where(step > 0.0, step, np.inf)
    return np.stack([by.real, by.imag], axis=-1)


def _velocities(window: Window) -> Complexes:
    """Horizontal velocities (K,) [m/s] of the window's poses, as complex numbers."""
    accel = window.accel[:, 0] + 1j * window.accel[:, 1]
    speed, _ = horizontal(window.step.tobytes(), window.velocity_turn.tobytes())
    return np.asarray(speed @ np.append(complex(*window.head[3:5]), accel))


def with_velocity_turn(window: Window, angle: Floats) -> Window:
    """Window of the same motion, expressed by other turns (K - 1,) [rad] of the velocity and the accelerations that
    these ask for."""
    accel = window.accel.copy()
    accel[:, :2] += _asked_for(window, angle)
    return window._replace(accel=accel, velocity_turn=angle)
