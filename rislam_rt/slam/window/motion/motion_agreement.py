"""Agreement of the estimated motion with the rates at which path lengths change: a check of the motion without the map.

Every track tells of the velocity, whatever its cause (see `egomotion`): many tracks that agree on another velocity than
the estimated one speak against the map. So they are asked before each birth, which a wrong cause would let turn the
estimate, and, more leniently, every `PAST` cycles, where to be wrong costs the map.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.motion import egomotion, length_rates
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.smoother.marginals import acceleration_covariance, pose_covariance, way_variance
from rislam_rt.slam.window.smoother.motion_basis import TURN
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.solver_limits import LASTED, STILL
from rislam_rt.slam.window.state import WindowState
from rislam_rt.slam.window.tracks import CYCLE

PAST = 10
"""Cycles over which the estimated motion is checked against the rates of path lengths."""


def is_checked(state: WindowState) -> bool:
    """Whether the motion can be checked: with a heading for every pose of the window."""
    return len(state.heading) == state.window.num_poses


def check_start(state: WindowState) -> egomotion.StartCheck | None:
    """Check of the start's velocity and compass against the first tracks; None while there are too few of them."""
    window = state.window
    passes = window.step[window.step > 0.0]
    step = float(passes.mean()) if len(passes) else CYCLE
    found = _rates(state, slice(None), step)
    if found.number < egomotion.FEWEST:
        return None
    share = window.step.mean() / step
    std = np.sqrt(np.diag(window.covariance)[3:6])
    # who starts from rest has another velocity soon, for which neither the told one nor the compass was wrong
    learnt = state.config.motion == "learnt"
    time = step * len(window.step)
    manoeuvres = egomotion.Manoeuvres(state.level[0], share**2 * motion.ladder(), time) if learnt else None
    told = egomotion.weigh(found, share * window.head[3:6], share * std + 1e-6, manoeuvres)
    return told._replace(velocity=told.velocity / share if share > 0.0 else window.head[3:6])


def log_other_motion(state: WindowState) -> float:
    """Log likelihood ratio of the agent having moved in any other way over the last `PAST` cycles against as estimated,
    give or take a manoeuvre, from the rates at which path lengths changed; 0 where too few are known."""
    found = _latest_rates(state, scattered=True)
    if found is None:
        return 0.0
    lively = np.sqrt(motion.expected_variance(state.level[0])) * _latest(state.window)[1]
    std = np.sqrt(np.diag(window_gaussian.now(state.window)[1])[3:6] + lively**2) + 1e-6
    return egomotion.weigh(found, _mean_velocity(state.window)[0], std).log_odds - CONSTANTS.log_rare


def log_agreement(state: WindowState, after: Window) -> float:
    """Log likelihood ratio of the rates at which path lengths changed over the last `PAST` cycles under the motion as
    estimated `after` a birth against that before it; 0 where too few are known."""
    found = _latest_rates(state) if is_checked(state) else None
    if found is None:
        return 0.0
    one, other = (egomotion.log_evidence(found, *_mean_velocity(window)) for window in (state.window, after))
    return other - one


def latest_lengths(state: WindowState) -> length_rates.Lengths | None:
    """Lengths of tracks and of explained paths over the last `PAST` cycles, before those of the last pose are measured;
    None where they are too few."""
    passed = state.window.step[:-1][-PAST:]
    silent = not len(state.log.cycle) or state.log.cycle[-1] != state.cycle - 1  # then the log ends before the poses
    if silent or len(passed) < length_rates.EARLY - 1 or not is_checked(state):
        return None
    return _lengths(state, slice(-2 - len(passed), -1), float(passed.mean()))


def weigh_manoeuvre(
    state: WindowState, told: length_rates.Lengths, steps: int, log_prior: Floats
) -> tuple[float, Floats]:  # fmt: skip
    """Posterior log odds of a manoeuvre that has lasted for `steps` until the last measurement, and its acceleration
    (3,) [m/s^2], by the rates at which the lengths that `told` change; `log_prior` (2,) are the odds beforehand, of a
    horizontal one and of a climb.

    It is an acceleration of the liveliest mode, where the agent faces or in any direction, or upwards.
    """
    found, log_odds, change = length_rates.accelerations(told, steps), -np.inf, np.zeros(3)
    if found.number < egomotion.FEWEST:
        return log_odds, change
    found = _with_history(state, found, steps)
    calm, facing = acceleration_covariance(state.window, steps), [np.cos(state.heading[-1]), np.sin(state.heading[-1])]
    starts = egomotion.possible_changes(found, log_prior[0])
    if starts is not None:
        ways = [calm[:2, :2] + CONSTANTS.liveliest**2 * wide for wide in (np.outer(facing, facing), np.eye(2))]
        log_odds, change[:2] = egomotion.weigh_change(found, starts, calm[:2, :2], ways, log_prior[0])
    if state.scene.radio.array.pattern == "upper":  # else nobody knows what comes from above
        climbs, by = egomotion.weigh_climb(found, float(calm[2, 2]) + STILL**2, log_prior[1])
        if climbs > log_odds:
            return climbs, np.array([0.0, 0.0, by])
    return log_odds, change


def _with_history(state: WindowState, found: length_rates.Rates, steps: int) -> length_rates.Rates:
    """Rates of path lengths that hold each path for what it was before the last `steps`, as long as a manoeuvre is
    looked for."""
    until = state.window.num_poses - 1 - steps
    rows = slice(max(until - 1 - LASTED[-1], 0), until)
    log = state.log.take(state.log.cycle < state.cycle - state.window.num_poses + 1 + until)
    silent = not len(log.cycle) or log.cycle[-1] != state.cycle - state.window.num_poses + until
    if silent or until - rows.start < length_rates.MEASURED:
        return found
    place, passed = window_gaussian.floor_poses(state.window)[rows, :3], state.window.step[rows.start : until - 1]
    before = length_rates.rates(_lengths(state._replace(log=log), rows, float(passed.mean())))
    return egomotion.with_history(found, before, (place[-1] - place[0]) / passed.sum()) if before.number else found


def _latest_rates(state: WindowState, scattered: bool = False) -> length_rates.Rates | None:
    """Rates of path lengths over the last `PAST` cycles, with which motion must agree; None where they are too few."""
    cycles, time = _latest(state.window)
    if cycles < length_rates.MEASURED - 1:
        return None
    found = _rates(state, slice(-1 - cycles, None), time / cycles, scattered)
    return found if found.number >= egomotion.FEWEST else None


def _rates(state: WindowState, rows: slice, step: float, scattered: bool = False) -> length_rates.Rates:
    """Rates of path lengths over the window's poses `rows`, `step` [s] apart, seen under the estimated headings.

    Where the heading is estimated, its deviation turns all directions: each rate by twice the way across.
    """
    found, window = length_rates.rates(_lengths(state, rows, step), scattered), state.window
    if not window.turns:
        return found
    heading_std = np.sqrt(np.diag(pose_covariance(window, TURN))[rows].max())
    return found._replace(blur=np.hypot(found.blur, 2.0 * heading_std))


def _lengths(state: WindowState, rows: slice, step: float) -> length_rates.Lengths:
    """Lengths, for the agreement of motions, that are heard at the window's poses `rows`, `step` [s] apart."""
    body, pose = state.scene.body, window_gaussian.poses(state.window)[rows]
    return length_rates.lengths(length_rates.Heard(
        state.log, state.heading[rows] + pose[:, 3], pose[:, :3], step,
        body.tx_offset - body.rx_offset, state.scene.radio.array.spacing,
    ))  # fmt: skip


def _mean_velocity(window: Window) -> tuple[Floats, Floats]:
    """Mean velocity (3,) [m/s] over the last `PAST` cycles, and its standard deviations (3,)."""
    cycles, time = _latest(window)
    place = window_gaussian.floor_poses(window)[:, :3]
    variance = way_variance(window, np.array([-1 - cycles]), np.array([-1]))[0]
    return (place[-1] - place[-1 - cycles]) / time, np.sqrt(variance) / time + 1e-6


def _latest(window: Window) -> tuple[int, float]:
    """Number of the last `PAST` cycles, or as many as there are, over which motion must agree, and their time [s]."""
    step = window.step[-PAST:]
    return len(step), float(step.sum()) or len(step) * CYCLE  # where the clock stands still, as usual
