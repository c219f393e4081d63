"""Manoeuvres that no step tells of: the agent sets off, stops, turns or climbs where the map measures nothing of it,
or what it measures passes for neighbours' pull.

A track counts as following the agent by its agreement with the motion as believed. While that is wrong, those that tell
of the right one do not count, and those that keep their length bear the wrong one out: who set off from rest was held
for standing still. So all tracks are asked at once whether an acceleration in the last steps explains them better, by
more than it is rarer, and the map's returns whether they bear that out.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.window.landmarks.landmark_update import with_scatter
from rislam_rt.slam.window.measurement_log import reweigh_wall_returns, squares, unique_forms
from rislam_rt.slam.window.motion import motion_agreement
from rislam_rt.slam.window.motion.motion_learning import COLUMNS, UP, vertical_information
from rislam_rt.slam.window.motion.track_rates import with_rates
from rislam_rt.slam.window.relinearisation import Predictions, levelled, predictions, relinearise
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.smoother.marginals import prediction_variance
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.solver_limits import CLIMBED, LASTED, LATELY, STRIDE
from rislam_rt.slam.window.state import WindowState


def with_manoeuvre(state: WindowState) -> WindowState:
    """State whose last steps are as lively as can be, and accelerated as the tracks agree that they are, if these speak
    for a manoeuvre that the motion as believed leaves out.

    One that begins has to be held for true, as births may follow from it; one that goes on only to be likelier than
    not. What scatter wall returns were held to have is weighed again, as long as it goes on: first by the cycles
    before, so that they tell of the motion what they can, then by all.
    """
    window, scene = state.window, state.scene
    if window.turns or not scene.use_vt or state.config.motion != "learnt":  # as `rate_factor` has it; told stays told
        return state
    if len(window.step) <= LASTED[0] or not (window.step > 0.0).all():
        return state
    told = motion_agreement.latest_lengths(state)
    if told is None:
        return state
    # who manoeuvres goes on doing so; who does not may have begun in any of the steps
    lively = (state.level[:2] @ motion.transition(CONSTANTS.stay))[:, -1]
    least = np.where(lively > 0.5, 0.0, CONSTANTS.log_born)
    least[UP] += CONSTANTS.log_upright * state.is_level  # most floors are level
    best, accel, steps = 0.0, np.zeros(3), 0
    for each in [each for each in LASTED if each < len(window.step)]:
        share = np.maximum(lively, 1.0 - CONSTANTS.stay**each)
        log_odds, by = motion_agreement.weigh_manoeuvre(state, told, each, np.log(share / (1.0 - share)) - least)
        if log_odds > best:
            best, accel, steps = log_odds, by, each
    if not steps:
        return state
    # the newest pose is not measured yet: its step goes on as the ones before
    last = slice(-steps - 1, None)
    trial = solve_livelier(window, steps + 1, upwards=bool(accel[2]))
    trial.accel[last, :3] = window.accel[last, :3] + accel
    before = state
    for until in (state.window.num_poses - 2 - steps, state.window.num_poses):
        # which tracks follow hangs on the motion, and the motion on them
        state = with_rates(_with_scatter_relearnt(state._replace(window=trial), until))
        trial = window_gaussian.solve(state.window)
    after = state._replace(window=trial)
    return after if best + _log_borne_out(before, after, state.cycle - steps) > 0.0 else before


def _log_borne_out(before: WindowState, after: WindowState, begin: int) -> float:
    """Log likelihood ratio of what is heard over walls alone since a cycle, by the motion `after` against that `before`
    a manoeuvre; no path tells more than that it is another than it was held for, which is rare (`max_log_ratio`)."""
    ratio = _log_returns(after, begin) - _log_returns(before, begin)
    return float(np.clip(ratio, -CONSTANTS.max_log_ratio, CONSTANTS.max_log_ratio).sum())


def _with_scatter_relearnt(state: WindowState, until: int) -> WindowState:
    """State whose wall returns scatter about the motion as it is now estimated by as much as they did in the first
    `until` cycles of the window: what a manoeuvre that was not believed in did to them was held for neighbours' pull,
    whose variance would go on holding the agent back."""
    found = predictions(state, 0)
    state = _reweighed(state, until, found)
    log = state.log
    rows = (log.form[:, 0, 0] == TX).nonzero()[0]
    visibility = with_scatter(state.visibility, log.form[rows, 0], log.scatter(rows))
    return relinearise(state._replace(visibility=visibility), 0, found)[0]


def _reweighed(state: WindowState, until: int, found: Predictions, *, moved: bool = True) -> WindowState:
    """State whose log weighs wall returns by their residuals, of what is `found`, in the first `until` cycles of the
    window: of the errors as they are expected, or, unless the estimate has `moved` with them, of the residuals alone,
    which are less."""
    state, left = levelled(state, 0, found)
    spread = prediction_variance(state.window, left.slot, left.slopes) if moved else 0.0
    left = left._replace(square=squares(left.row, left.left, state.log, spread))
    return state._replace(log=reweigh_wall_returns(state.log, left, state.window.num_poses, until))


def with_climb(state: WindowState) -> WindowState:
    """State that climbs or descends in its last steps, if that explains what is heard of walls better than the height
    as believed does, by more than it is rarer.

    While a floor is held for level, what a climb does to the returns from above is held for neighbours' pull, whose
    variance would go on holding the height. So both are weighed: the climb with the scatter from before it began.
    """
    window, steps, learnt = state.window, CLIMBED, state.config.motion == "learnt"
    if state.cycle % STRIDE or not learnt or not state.scene.use_vt or len(window.step) <= steps:
        return state
    calmer = _scattering_as_before(state, steps)
    if calmer is None:
        return state
    trial, found = calmer
    for linearised in (found, None):
        trial = relinearise(trial, 0, linearised)[0]
        trial = trial._replace(window=solve_livelier(trial.window, steps + 1, upwards=True))
    last, begin = slice(-steps - 1, None), state.cycle - steps
    inner = vertical_information(trial.window).information[last, last]
    free = np.linalg.slogdet(np.eye(steps + 1) + CONSTANTS.liveliest**2 * inner)[1]
    free += float(np.sum(trial.window.accel[last, 2] ** 2)) / CONSTANTS.liveliest**2
    ratio = _log_returns(trial, begin) - _log_returns(state, begin)
    log_ratio = float(ratio.sum()) - 0.5 * free
    return trial if log_ratio + CONSTANTS.log_rare - CONSTANTS.log_upright > CONSTANTS.log_born else state


def _scattering_as_before(state: WindowState, steps: int) -> tuple[WindowState, Predictions] | None:
    """State whose returns over walls alone scatter no more than they did before the last `steps`, and its predictions;
    None if none has come to scatter by more than still fits (`crowd`)."""
    log, until = state.log, state.window.num_poses - 1 - steps
    rows = (log.form[:, 0, 0] == TX).nonzero()[0]
    now = log.scatter(rows)
    for exact in (False, True):  # most often the residuals alone show that none has
        found = predictions(state, 0, slopes=exact)
        before = _reweighed(state, until, found, moved=exact).log
        fewer = np.minimum(now, before.scatter(rows))
        if not (now > CONSTANTS.crowd * fewer).any():
            return None
    visibility = with_scatter(state.visibility, log.form[rows, 0], fewer)
    log = log._replace(extra=np.minimum(log.extra, before.extra))
    return state._replace(log=log, visibility=visibility), found


def _log_returns(state: WindowState, begin: int) -> Floats:
    """Log likelihoods (P,), without their constants, of the lengths of returns over walls alone since a cycle, path by
    path, at the estimate; each path scatters by a variance of its own, of which beforehand no more is known than that
    it fits (`crowd`)."""
    log, left = state.log, levelled(state, 0, predictions(state, 0, slopes=False))[1]
    left = left.take((log.form[left.row, 0, 0] == TX) & (log.cycle[left.row] >= begin))
    _, which = unique_forms(log.form[left.row, 0])
    square = left.left[:, 0] ** 2 * (1.0 + log.extra[left.row, 0] / log.std[left.row, 0] ** 2)
    return np.asarray(-0.5 * (np.bincount(which) + 1.0) * np.log(CONSTANTS.crowd + np.bincount(which, square)))


def livelier(precision: Floats, steps: int = LATELY, *, upwards: bool = False) -> Floats:
    """Prior precisions (K - 1, A) of the window's accelerations for the trial of a manoeuvre: those of the last `steps`
    lowered to the liveliest motion mode's, of all axes but the vertical one, or of this alone."""
    found, lively = precision.copy(), (COLUMNS[: precision.shape[1]] == UP) == upwards
    found[-steps:, lively] = np.minimum(found[-steps:, lively], CONSTANTS.liveliest**-2.0)
    return found


def solve_livelier(window: Window, steps: int = LATELY, *, upwards: bool = False) -> Window:
    """Window solved again for the trial of a manoeuvre, with `livelier` priors of its last steps."""
    uneven = window.uneven.copy()
    if upwards:
        uneven[-steps:] = np.minimum(uneven[-steps:], CONSTANTS.liveliest**-2.0)
    precision = livelier(window.precision, steps, upwards=upwards)
    return window_gaussian.solve(window._replace(precision=precision, uneven=uneven))
