"""Manoeuvres that only tracks tell of: the agent sets off, stops or turns where the map measures nothing of it.

A track counts as following the agent by its agreement with the motion as believed. While that is wrong, those that tell
of the right one do not count, and those that keep their length bear the wrong one out: who set off from rest was held
for standing still. So all tracks are asked at once whether an acceleration in the last steps explains them better, by
more than it is rarer.
"""

import numpy as np

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.window.divergence import motion_agreement
from rislam_rt.slam.window.landmarks.landmark_update import with_scatter
from rislam_rt.slam.window.measurement_log import reweigh_wall_returns, squares
from rislam_rt.slam.window.motion_learning import solve_livelier
from rislam_rt.slam.window.relinearisation import levelled, predictions, relinearise
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.smoother.marginals import prediction_variance
from rislam_rt.slam.window.solver_limits import LASTED
from rislam_rt.slam.window.state import WindowState
from rislam_rt.slam.window.track_rates import with_rates


def with_manoeuvre(state: WindowState) -> WindowState:
    """State whose last steps are as lively as can be, and accelerated as the tracks agree that they are, if these speak
    for a manoeuvre that the motion as believed leaves out.

    What scatter wall returns were held to have is weighed again, as long as it goes on: first by the cycles before, so
    that they tell of the motion what they can, then by all.
    """
    window = state.window
    if window.rates is None or state.config.motion != "learnt" or len(window.step) <= LASTED[0]:
        return state
    told = motion_agreement.latest_lengths(state)
    if told is None:
        return state
    # who manoeuvres goes on doing so; who does not may have begun in any of the steps
    lively = float((state.level[0] @ motion.transition(CONSTANTS.stay))[-1])
    best, accel, steps = 0.0, np.zeros(2), 0
    for each in [each for each in LASTED if each < len(window.step)]:
        share = max(lively, 1.0 - CONSTANTS.stay**each)
        log_odds, by = motion_agreement.weigh_manoeuvre(state, told, each, float(np.log(share / (1.0 - share))))
        if log_odds > best:
            best, accel, steps = log_odds, by, each
    if not steps:
        return state
    # the newest pose is not measured yet: its step goes on as the ones before
    last = slice(-steps - 1, None)
    trial = solve_livelier(window, steps + 1)
    trial.accel[last, :2] = window.accel[last, :2] + accel
    for until in (state.window.num_poses - 2 - steps, state.window.num_poses):
        # which tracks follow hangs on the motion, and the motion on them
        state = with_rates(_booked_anew(state._replace(window=trial), until))
        trial = window_gaussian.solve(state.window)
    return state._replace(window=trial)


def _booked_anew(state: WindowState, until: int) -> WindowState:
    """State whose wall returns scatter about the motion as it is now estimated by as much as they did in the first
    `until` cycles of the window: what a manoeuvre that was not believed in did to them was held for neighbours' pull,
    whose variance would go on holding the agent back."""
    found = predictions(state, 0)
    state, left = levelled(state, 0, found)
    spread = prediction_variance(state.window, left.slot, left.slopes)
    left = left._replace(square=squares(left.row, left.left, state.log, spread))
    log = reweigh_wall_returns(state.log, left, state.window.num_poses, until)
    rows = (log.form[:, 0, 0] == TX).nonzero()[0]
    visibility = with_scatter(state.visibility, log.form[rows, 0], log.scatter(rows))
    return relinearise(state._replace(log=log, visibility=visibility), 0, found)[0]
