"""Lost or not, and what to do about it: a chain of two hidden states, jumps, and a start that was told wrong.

While the agent is tracked, the map foresees what is heard; once it is lost, all is strangers'. The log likelihood of a
cycle under the one against the other (`look`) moves the log odds of a hidden chain, which passes from tracked to lost
at a rate of its own. Before it is held for lost, the belief is given what might explain the cycle: livelier motion, and
a jump to where the map's returns and what is heard agree.
"""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.tracks import Glance
from rislam_rt.slam.window import egomotion, gauss
from rislam_rt.slam.window.egomotion import Rates
from rislam_rt.slam.window.gauss import Window
from rislam_rt.slam.window.levels import LEVELS
from rislam_rt.slam.window.log import Log
from rislam_rt.slam.window.look import Look

RATE = 1e-4
"""Probability that a cycle is the one in which the agent is lost: once in 1000 s."""
MOST = 15.0
"""Log odds beyond which nothing more is learnt."""
JUMP = 1.0
"""Standard deviation [m] of an agent's place after it was lost, and of a jump."""
CELL = 0.01
"""Distance [m] within which two places are one: as far as a cycle's returns tell."""
LOG_JUMP = np.log(RATE) + 2.0 * np.log(CELL / JUMP)
"""Log probability of a jump to one certain place."""
ALIKE = 0.1
"""Difference of cosines, and of log amplitudes in units of ten times that, within which a component may be a return."""


def advance(log_odds: float, score: float) -> float:
    """Log odds of being lost, a cycle on, after one that the map explains better than strangers do by `score`."""
    lost = 1.0 / (1.0 + np.exp(-log_odds))
    lost += (1.0 - lost) * RATE
    return float(np.clip(np.log(lost / (1.0 - lost)) - score, np.log(RATE), MOST))


def jump(view: Look, glance: Glance) -> Floats:
    """(3,) [m] by which an agent that hears this is elsewhere than thought: on which most returns agree."""
    lead = view.groups.leader
    expected, heard = view.expected.seen[lead], glance.seen
    off = np.abs(heard[:, 1:] - expected[:, None, 1:]).max(axis=-1)
    level = np.abs(glance.log_amplitude - view.groups.log_amplitude[:, None])
    row, column = ((off < ALIKE) & (level < 10.0 * ALIKE)).nonzero()
    if len(row) < egomotion.FEWEST:
        return np.zeros(3)
    gap = heard[column, 0] - expected[row, 0]
    found = Rates(view.expected.jacobian[lead[row], 0, :3], gap, np.full(len(row), CELL**2))
    return egomotion.agreed(found)


def displaced(window: Window, by: Floats) -> Window:
    """The window with the last pose elsewhere, its velocity as it was: two steps that nothing is known of."""
    dt = window.step[-2:]
    accel, precision = window.accel.copy(), window.precision.copy()
    moved = np.append(by, 0.0)[window.axes]
    flat = window.axes < 3
    # v stays: a dt of the one is what the other takes back
    size = dt[0] * (0.5 * dt[0] + dt[1]) - 0.5 * dt[0] * dt[1]
    accel[-2, flat] += moved[flat] / size
    accel[-1, flat] -= moved[flat] / size * dt[0] / dt[1]
    precision[-2:, flat] = (JUMP / size) ** -2.0
    return window._replace(accel=accel, precision=precision)


def ask_tracks(window: Window, log: Log, idents: Integers, heading: Floats) -> egomotion.Told | None:
    """What the first tracks say of the start, once there are enough of them."""
    passes = window.step[window.step > 0.0]
    step = float(passes.mean()) if len(passes) else CYCLE
    found = egomotion.rates(log, idents, heading, step)
    if len(found.rate) < egomotion.FEWEST:
        return None
    share = window.step.mean() / step
    std = np.sqrt(np.diag(window.covariance)[3:6])
    return egomotion.weigh(found, share * window.head[3:6], share * std + 1e-6)


CYCLE = 0.1
"""Time [s] that is held to pass from cycle to cycle where the clock says that none does."""


def restarted(window: Window, velocity: Floats, spread: float, turned: float) -> Window:
    """Before anything is born: with another velocity at its start, or an offset of the compass within `turned` [rad]."""
    head, prior = window.head.copy(), window.prior
    head[3:5] = velocity[:2]
    hessian = prior.hessian.copy()
    hessian[[3, 4], [3, 4]] = np.minimum(hessian[[3, 4], [3, 4]], spread**-2.0)
    if turned > 0.0:
        hessian[6, 6] = turned**-2.0
    prior = prior._replace(hessian=hessian, middle=head, gradient=np.zeros(len(head)))
    return gauss.solve(window._replace(head=head, prior=prior))


def lost(log_odds: float) -> bool:
    """Whether the map is given up."""
    return log_odds > np.log(LEVELS.born / (1.0 - LEVELS.born))
