"""Divergence monitor: a hidden Markov chain of tracked and lost, jumps in position, and corrections of the start.

While the agent is tracked, the map predicts what is heard; once it is lost, all is clutter. The log likelihood ratio of
a cycle (`CycleAssociation.score`) moves the log odds of a hidden chain, which passes from tracked to lost at a rate of
its own. Before it is held for lost, the belief is given what might explain the cycle: livelier motion, and a jump to
where the map's returns and what is heard agree.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import unit
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import Observations
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.step_info import LossCause
from rislam_rt.slam.window.cycle_association import CycleAssociation
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable
from rislam_rt.slam.window.motion import egomotion
from rislam_rt.slam.window.motion.length_rates import Rates
from rislam_rt.slam.window.smoother.motion_basis import HEAD, TURN, rotation
from rislam_rt.slam.window.smoother.window_gaussian import Window

CELL = 0.01
"""Distance [m] within which two positions are one: as far as a cycle's returns tell."""
CUT = 0.7
"""Probability that a track ends in a cycle with a jump, besides what silences it in any other."""
PAIRS = 60
"""Most pairs of a predicted return and a component from which a jump is estimated."""
ALIKE = 0.1
"""Difference of cosines within which a component may be a return shifted by a jump; for log amplitudes, ten times
that."""


def advance(log_odds: float, score: float, silent: Floats, kept: int) -> float:
    """Log odds of being lost after one more cycle, which the map explains better than clutter by the log likelihood
    ratio `score`.

    Of the tracks `kept` ones go on, and others end, which were due with probabilities `silent` (S,): a faint one comes
    and goes, and any may be hidden, which is `rare`. They need no pose: if many end at once, the agent may be
    elsewhere.
    """
    silent = np.minimum(silent, 1.0 - CONSTANTS.rare)
    ended = np.log((1.0 - (1.0 - CUT) * silent) / (1.0 - silent)).sum()
    burst = ended + kept * np.log(1.0 - CUT)
    rate = 1.0 / (1.0 + np.exp(-CONSTANTS.log_lost - max(burst, 0.0)))
    lost = 1.0 / (1.0 + np.exp(-log_odds))
    lost = min(lost + (1.0 - lost) * rate, 1.0 - 1e-9)
    limit = -CONSTANTS.log_lost
    return min(max(float(np.log(lost / (1.0 - lost))) - score, -limit), limit)


def jump(view: CycleAssociation, observed: Observations, use_vt: bool) -> Floats:
    """Displacement (3,) [m] of the agent on which most pairs of predicted and measured path lengths agree; 0 where
    there is none. Without `use_vt` wall returns have no say: walls that nothing corrects err by more than they tell."""
    lead, expected_log = view.groups.leader, view.groups.log_amplitude
    if not use_vt:
        moving = view.expected.forms[lead, 0] != TX
        lead, expected_log = lead[moving], expected_log[moving]
    expected, heard = view.expected.seen[lead], observed.seen
    off = np.maximum(*(np.abs(heard[:, axis] - expected[:, axis, None]) for axis in (1, 2)))
    row, column = (off < ALIKE).nonzero()
    alike = np.abs(observed.log_amplitude[column] - expected_log[row]) < 10.0 * ALIKE
    row, column = row[alike], column[alike]
    near = np.argsort(off[row, column], kind="stable")[:PAIRS]
    row, column = row[near], column[near]
    if len(row) < egomotion.FEWEST:
        return np.zeros(3)
    gap = heard[column, 0] - expected[row, 0]
    found = Rates(view.expected.jacobian[lead[row], 0, :3], gap, np.full(len(row), CELL**2), np.zeros(len(row)), gap)
    by = egomotion.agreed_velocity(found)
    return by if float(by @ by) > CELL**2 else np.zeros(3)


def turn(view: CycleAssociation, observed: Observations, cell: float) -> float:
    """Turn of the body [rad] that the divergence monitor tries: that on which most pairs of predicted and measured
    directions agree, of paths alike in length (within `cell` [m]), elevation and amplitude; 0 where there is none."""
    lead = view.groups.leader
    expected, heard = view.expected.seen[lead], observed.seen
    alike = np.abs(heard[:, 0] - expected[:, 0, None]) < cell
    alike &= np.abs(observed.log_amplitude - view.groups.log_amplitude[:, None]) < 10.0 * ALIKE
    flat, seen = expected[:, 1] + 1j * expected[:, 2], heard[:, 1] + 1j * heard[:, 2]
    # what arrives from above tells no azimuth
    alike &= (np.abs(np.abs(seen) - np.abs(flat)[:, None]) < ALIKE) & (np.abs(flat)[:, None] > ALIKE)
    row, column = alike.nonzero()
    by = np.exp(1j * np.angle(flat[row] * seen[column].conj()))
    agree = np.abs(by[:, None] - by) < ALIKE
    count = [len(np.unique(row[near])) for near in agree]
    if max(count, default=0) < egomotion.FEWEST:
        return 0.0
    return float(np.angle(by[agree[int(np.argmax(count))]].sum()))


def log_turn() -> float:
    """Divergence monitor's prior log probability of an unannounced turn by one certain angle (within `ALIKE`), all
    alike."""
    return CONSTANTS.log_rare + float(np.log(ALIKE / (2.0 * np.pi)))


def turned(window: Window, by: float) -> Window:
    """Sliding window with its last heading turned by `by` [rad]: where its next solution is linearised."""
    accel = window.accel.copy()
    accel[-1, TURN] += by / window.step[-1]
    return window._replace(accel=accel)


def log_jump() -> float:
    """Divergence monitor's prior log probability of a jump to one certain place (`CELL`), as far as the agent walks in
    a second."""
    return CONSTANTS.log_lost + 2.0 * float(np.log(CELL / CONSTANTS.walk))


def with_another_wall(window: Window, landmarks: WindowTable, by: Floats) -> list[Window]:
    """Sliding windows of an agent that has not jumped by `by` (3,) [m], each with one wall where it would hear of it
    what it hears after the jump: for a trial association. What has come in front of a wall, or has gone from there,
    moves all returns over it, and leaves all others as they are."""
    walls = landmarks.walls
    place = window.head[HEAD:].reshape(-1, 3)[walls]
    normal = unit(place - landmarks.anchor[walls])
    along = normal @ by
    found = []
    for row, way in zip(walls[np.abs(along) > CELL], (along[:, None] * normal)[np.abs(along) > CELL], strict=True):
        head = window.head.copy()
        head[HEAD + 3 * row : HEAD + 3 * row + 3] -= 2.0 * way
        found.append(window._replace(head=head))
    return found


def log_another_wall() -> float:
    """Divergence monitor's prior log probability that a wall is heard no more, and another one instead of it at one
    certain distance (`CELL`)."""
    return CONSTANTS.log_rare + float(np.log(CELL / CONSTANTS.size))


def shifted(window: Window, by: Floats) -> Window:
    """Sliding window with its last position moved by `by` (3,) [m] and its velocity kept: for a trial association, not
    for a solution."""
    accel, dt = window.accel.copy(), window.step[-2:]
    # what one step gives to the velocity the next one takes back
    size = dt[0] * (0.5 * dt[0] + dt[1]) - 0.5 * dt[0] * dt[1]
    accel[-2, :3] += by / size
    accel[-1, :3] -= rotation(window.velocity_turn[-1]) @ by / size * dt[0] / dt[1]
    return window._replace(accel=accel)


def is_lost(log_odds: float) -> bool:
    """Whether the log odds of being lost are such that the map is given up."""
    return log_odds > CONSTANTS.log_born


def cause_of_loss(before: float, heard: float, checked: float, score: float) -> LossCause:
    """What adds most to the log odds of being lost in a cycle: tracks that ended, a map that explains the cycle worse
    than clutter (by `score`), or another motion.

    The log odds are those `before` the cycle, when it has been `heard`, and when its motion has been `checked`.
    """
    map_share = -score if heard != before else 0.0
    shares = {LossCause.TRACKS: heard - before - map_share, LossCause.MAP: map_share, LossCause.MOTION: checked - heard}
    cause = max(shares, key=lambda one: shares[one])
    return cause if shares[cause] > 0.0 else LossCause.NONE
