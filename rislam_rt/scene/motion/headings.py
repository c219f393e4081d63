"""Headings of the agent along its motion, and its turns on the spot."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import wrap

HALF_TURN = 1e-9
"""Angle [rad] to half a turn below which rounding alone would say whether it goes left or right: it goes left."""


def along_heading(course: Floats) -> Floats:
    """Headings (K,) [rad] of a motion along velocities or tangents (K, 3); of a vertical one or a standstill, its
    neighbour's."""
    length = np.linalg.norm(course, axis=1)
    # beside a millionth of the highest speed there is only rounding, which points anywhere
    level = np.hypot(course[:, 0], course[:, 1]) > np.maximum(
        1e-9 * length, max(1e-6 * length.max(initial=0.0), 1e-300)
    )
    if not level.any():
        return np.zeros(len(course))
    last = np.maximum.accumulate(np.where(level, np.arange(len(course)), -1))
    row = np.where(last >= 0, last, int(np.argmax(level)))
    return np.asarray(np.arctan2(course[row, 1], course[row, 0]))


def short_turn(before: Floats, after: Floats) -> Floats:
    """Turns (N,) [rad] on the spot from headings (N,) to headings (N,) [rad], the short way; half a turn to the
    left."""
    turn = wrap(after - before)
    return np.where(np.abs(turn) > np.pi - HALF_TURN, np.pi, turn)
