"""Manoeuvres that only tracks tell of: the agent sets off, stops or turns where the map measures nothing of it.

A track counts as following the agent by its agreement with the motion as believed. While that is wrong, those that tell
of the right one do not count, and those that keep their length bear the wrong one out: who set off from rest was held
for standing still. So all tracks are asked at once whether an acceleration in the last steps explains them better, by
more than it is rarer.
"""

import numpy as np

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.divergence import motion_agreement
from rislam_rt.slam.window.motion_learning import livelier
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.solver_limits import LATELY
from rislam_rt.slam.window.state import WindowState
from rislam_rt.slam.window.track_rates import with_rates


def with_manoeuvre(state: WindowState) -> WindowState:
    """State whose last steps are as lively as can be, and accelerated as the tracks agree that they are, if these speak
    for a manoeuvre that the motion as believed leaves out.

    It may have lasted for 5 steps or, asked in every other cycle, for 10.
    """
    window, steps = state.window, LATELY * (1 + state.cycle % 2)
    if window.rates is None or state.config.motion != "learnt" or steps >= len(window.step):
        return state
    # who manoeuvres goes on doing so; who does not may have begun in any of the steps
    lively = (state.level[0] @ motion.transition(CONSTANTS.stay))[-1]
    share = max(float(lively), 1.0 - CONSTANTS.stay**steps)
    log_odds, accel = motion_agreement.weigh_manoeuvre(state, steps, float(np.log(share / (1.0 - share))))
    if log_odds <= 0.0:
        return state
    # the newest pose is not measured yet: its step goes on as the ones before
    last = slice(-steps - 1, None)
    trial = window_gaussian.solve(window._replace(precision=livelier(window.precision, steps + 1)))
    trial.accel[last, :2] = window.accel[last, :2] + accel
    for _ in range(2):  # which tracks follow hangs on the motion, and the motion on them
        state = with_rates(state._replace(window=trial))
        trial = window_gaussian.solve(state.window)
    return state._replace(window=trial)
