"""Path of the agent along waypoints: straight legs, corners rounded so that an acceleration is kept, and headings."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, cross
from rislam_rt.geometry.angles import wrap
from rislam_rt.scene.findings import Fault

SHARPEST = np.radians(170.0)
"""Largest turn [rad] at a waypoint: the arc of one that turns back would never end."""
STRAIGHT = 1e-9
"""Turn [rad] at a waypoint below which it needs no arc."""
HALF_TURN = 1e-9
"""Angle [rad] to half a turn below which rounding alone would say whether it goes left or right: it goes left."""


class RoundedPath(NamedTuple):
    """Path along waypoints with rounded corners: P pieces, straight legs and arcs in turn."""

    start: Floats
    """(P, 3) [m] where each piece begins."""
    along: Floats
    """(P, 3) unit tangent at the start of each piece."""
    inward: Floats
    """(P, 3) unit vector from the start to the arc's centre; of a leg, zero."""
    radius: Floats
    """(P,) [m] of the arcs; of a leg, one, which counts for nothing."""
    length: Floats
    """(P,) [m] of the pieces."""

    @property
    def total(self) -> float:
        """Length [m] of a path along waypoints."""
        return float(np.sum(self.length))

    def at(self, travelled: Floats) -> tuple[Floats, Floats]:
        """Positions (K, 3) [m] and unit tangents (K, 3) of a path along waypoints at distances (K,) [m] along it."""
        begin = np.concatenate([[0.0], np.cumsum(self.length)[:-1]])
        piece = np.clip(np.searchsorted(begin, travelled, side="right") - 1, 0, len(begin) - 1)
        gone, radius = travelled - begin[piece], self.radius[piece]
        bent = self.inward[piece].any(axis=1)
        angle = np.where(bent, gone / radius, 0.0)[:, None]
        along, inward = self.along[piece], self.inward[piece]
        straight = np.where(bent, 0.0, gone)[:, None] * along
        arc = radius[:, None] * (np.sin(angle) * along + (1.0 - np.cos(angle)) * inward)
        return self.start[piece] + straight + arc, np.cos(angle) * along + np.sin(angle) * inward


def round_corners(waypoints: Floats, radius: float, first: int = 0) -> RoundedPath:
    """Path along waypoints (W, 3) [m], the corner at each but the first and the last rounded by an arc of that radius
    [m]; `first` is the number of the first one in messages.

    Raises
    ------
    Fault
        Two waypoints are one, a turn is sharper than `SHARPEST`, or a leg is too short for the arcs at its ends.
    """
    legs = np.diff(waypoints, axis=0)
    length = np.linalg.norm(legs, axis=1)
    if (length < 1e-6).any():
        pair = first + int(np.argmax(length < 1e-6))
        raise Fault(f"waypoints {pair} and {pair + 1} are the same point", "leave one out")
    along = legs / length[:, None]
    before, after = along[:-1], along[1:]
    turn = np.arctan2(np.linalg.norm(cross(before, after), axis=1), np.einsum("ij,ij->i", before, after))
    if (turn > SHARPEST).any():
        corner = first + int(np.argmax(turn)) + 1
        mend = (
            f"give a way round (up to {np.degrees(SHARPEST):.0f} degrees at a waypoint), or a halt there: agent.halt_s"
        )
        what = f"the way turns back by {np.degrees(turn.max()):.0f} degrees at waypoint {corner} (the first is 0)"
        raise Fault(what, mend)
    cut = np.concatenate([[0.0], np.where(turn > STRAIGHT, radius * np.tan(turn / 2.0), 0.0), [0.0]])
    left = length - cut[:-1] - cut[1:]
    if (left < 0.0).any():
        leg = int(np.argmin(left))
        raise Fault(*_too_short(float(length[leg]), cut[leg : leg + 2], first + leg, radius))
    return _pieces(waypoints, along, turn, cut, left, radius)


def _too_short(length: float, arcs: Floats, number: int, radius: float) -> tuple[str, str]:
    """What is wrong with a leg of the way, from waypoint `number` on, that is too short for the `arcs` (2,) [m] of the
    corners at its ends, and the mend: a halt at the larger one, at both if the other alone is too large as well."""
    bent = [f"{number + end}" for end in range(2) if arcs[end] > 0.0]
    halts = " and ".join(bent if arcs.min() > length else [f"{number + int(np.argmax(arcs))}"])
    takes = f"the arc at waypoint {bent[0]} takes" if len(bent) == 1 else "the arcs at both take"
    return (
        f"{length:.3g} m from waypoint {number} to {number + 1} (the first is 0), of which {takes} {arcs.sum():.3g} m "
        f"(radius {radius:.3g} m, speed squared over acceleration)",
        f"halt at {halts} (agent.halt_s, one number of seconds for each waypoint), lower agent.speed_m_s, raise "
        "agent.acceleration_m_s2, or part the waypoints",
    )


def _pieces(waypoints: Floats, along: Floats, turn: Floats, cut: Floats, left: Floats, radius: float) -> RoundedPath:
    """Path along waypoints as leg, arc, leg, ... from directions, turns, and what the arcs cut off and leave."""
    count = 2 * len(along) - 1
    start, way, inward = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros((count, 3))
    start[::2], way[::2] = waypoints[:-1] + cut[:-1, None] * along, along
    start[1::2], way[1::2] = waypoints[1:-1] - cut[1:-1, None] * along[:-1], along[:-1]
    across = along[1:] - np.cos(turn)[:, None] * along[:-1]
    size = np.linalg.norm(across, axis=1, keepdims=True)
    bent = turn > STRAIGHT
    inward[1::2] = np.where(bent[:, None], across / np.where(size > 0.0, size, 1.0), 0.0)
    length = np.zeros(count)
    length[::2], length[1::2] = left, np.where(bent, radius * turn, 0.0)
    return RoundedPath(start, way, inward, np.where(inward.any(axis=1), radius, 1.0), length)


def along_heading(course: Floats) -> Floats:
    """Headings (K,) [rad] of a motion along velocities or tangents (K, 3); of a vertical one or a standstill, its
    neighbour's."""
    length = np.linalg.norm(course, axis=1)
    # beside a millionth of the highest speed there is only rounding, which points anywhere
    least = np.maximum(1e-9 * length, max(1e-6 * length.max(initial=0.0), 1e-300))
    level = np.hypot(course[:, 0], course[:, 1]) > least
    if not level.any():
        return np.zeros(len(course))
    last = np.maximum.accumulate(np.where(level, np.arange(len(course)), -1))
    row = np.where(last >= 0, last, int(np.argmax(level)))
    return np.asarray(np.arctan2(course[row, 1], course[row, 0]))


def short_turn(before: Floats, after: Floats) -> Floats:
    """Turns (N,) [rad] on the spot from headings (N,) to others (N,) [rad], the short way; half a turn to the left."""
    turn = wrap(after - before)
    return np.where(np.abs(turn) > np.pi - HALF_TURN, np.pi, turn)
