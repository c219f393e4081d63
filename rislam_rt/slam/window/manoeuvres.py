"""Manoeuvres that only tracks tell of: the agent sets off, stops or turns where the map measures nothing of it.

A track counts as following the agent by its agreement with the believed motion. While that is wrong, those that tell of
the right one do not count, and those that keep their length bear the wrong one out. So in each cycle all tracks are
asked at once whether they agree on another motion better, by more than a manoeuvre is rare.
"""

import numpy as np

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.divergence import motion_agreement
from rislam_rt.slam.window.motion_learning import livelier
from rislam_rt.slam.window.smoother import motion, window_gaussian
from rislam_rt.slam.window.state import WindowState
from rislam_rt.slam.window.track_rates import with_rates


ONSETS = (5, 10)
"""Steps over which a manoeuvre may have lasted."""


def with_manoeuvre(state: WindowState) -> WindowState:
    """State whose last steps are as lively as can be, and go where the tracks agree that they go, if these speak for a
    manoeuvre that the motion as estimated leaves out."""
    window = state.window
    if window.rates is None or state.config.motion != "learnt":
        return state
    steps = ONSETS[state.cycle % len(ONSETS)]
    if steps >= len(window.step):
        return state
    # who manoeuvres goes on doing so; who does not may have begun in any of the steps
    share = max(float((state.level[0] @ motion.transition(CONSTANTS.stay))[-1]), 1.0 - CONSTANTS.stay**steps)
    odds, accel = motion_agreement.weigh_manoeuvre(state, steps, np.log(share / (1.0 - share)))
    if odds <= 0.0:
        return state
    if __import__('os').environ.get('MAN'):
        print('   manoeuvre', state.cycle, 'odds %.1f' % odds, np.round(accel, 2), steps, flush=True)
    trial = window_gaussian.solve(window._replace(precision=livelier(window.precision, steps + 1)))
    trial.accel[-steps - 1 :, :2] = window.accel[-steps - 1 :, :2] + accel
    for _ in range(2):
        state = with_rates(state._replace(window=trial))
        trial = window_gaussian.solve(state.window)
    return state._replace(window=trial)
