"""Stop-and-go motion of the agent along waypoints: halts, speed that grows from rest and falls to it, turns on the
spot."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import wrap
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.motion.waypoints import RoundedPath, along_heading, round_corners, short_turn


class Stretch(NamedTuple):
    """Stretch of a stop-and-go motion between two halts, with a trapezoidal speed along it."""

    way: RoundedPath
    peak: float
    """Largest speed [m/s]."""
    acceleration: float
    """[m/s^2] while the speed grows or falls."""
    rise: float
    """Time [s] from rest to the largest speed; 0 where the stretch begins with it."""
    fall: float
    """Time [s] from the largest speed to rest; 0 where the stretch ends with it."""

    @property
    def duration(self) -> float:
        """Time [s] that a stretch between two halts takes."""
        steady = self.way.total - 0.5 * self.peak * (self.rise + self.fall)
        return self.rise + steady / self.peak + self.fall

    def at(self, time: Floats) -> tuple[Floats, Floats]:
        """Distances (K,) [m] along a stretch between two halts, speeds (K,) [m/s], at times (K,) [s] from its start."""
        left = self.duration - time
        grows, falls = time < self.rise, left < self.fall
        speed = self.acceleration * np.where(grows, time, left)
        growing = 0.5 * self.acceleration * time**2
        falling = self.way.total - 0.5 * self.acceleration * left**2
        steady = self.peak * (time - 0.5 * self.rise)
        return np.where(grows, growing, np.where(falls, falling, steady)), np.where(grows | falls, speed, self.peak)


class StopAndGo(NamedTuple):
    """Stop-and-go motion along waypoints: S stretches, and halts before, between and after them."""

    stretches: Sequence[Stretch]
    halts: Floats
    """(S + 1,) [s]."""
    turns: Floats
    """(S - 1,) [rad] on the spot at the halts between the stretches."""
    turn_times: Floats
    """(S - 1,) [s] that the turns take, the last of their halts."""

    @property
    def begin(self) -> Floats:
        """Times (S,) [s] at which the stretches of a stop-and-go motion begin."""
        lasting = np.array([stretch.duration for stretch in self.stretches])
        return np.asarray(np.cumsum(self.halts[:-1]) + np.concatenate([[0.0], np.cumsum(lasting)[:-1]]))

    @property
    def duration(self) -> float:
        """Time [s] that a stop-and-go motion takes, halts at its ends included."""
        return float(self.begin[-1] + self.stretches[-1].duration + self.halts[-1])

    @property
    def total(self) -> float:
        """Length [m] of the way of a stop-and-go motion."""
        return float(sum(stretch.way.total for stretch in self.stretches))

    def at(self, time: Floats) -> tuple[Floats, Floats, Floats]:
        """Positions (K, 3) [m], velocities (K, 3) [m/s] and headings (K,) [rad] along the way of a stop-and-go motion,
        at ascending times (K,) [s]."""
        begin = self.begin
        places, velocities, tangents, turned = [], [], [], []
        for number, part in enumerate(np.split(time, np.searchsorted(time, begin[1:]))):
            stretch = self.stretches[number]
            travelled, speed = stretch.at(np.clip(part - begin[number], 0.0, stretch.duration))
            place, along = stretch.way.at(travelled)
            places.append(place)
            velocities.append(speed[:, None] * along)
            tangents.append(along)
            turned.append(np.zeros(len(part)))
            if number < len(self.turns) and self.turns[number]:
                takes = self.turn_times[number]
                share = np.clip((part - begin[number + 1] + takes) / takes, 0.0, 1.0)
                turned[-1] = self.turns[number] * share
        angle = along_heading(np.concatenate(tangents)) + np.concatenate(turned)
        return np.concatenate(places), np.concatenate(velocities), wrap(angle)


def plan_stops(
    waypoints: Floats, halts: Floats, speed: float, acceleration: float, from_rest: bool, turn_rate: float | None
) -> StopAndGo:
    """Plan a stop-and-go motion along waypoints (W, 3) [m] with halts (W,) [s], at most at that speed [m/s].

    Parameters
    ----------
    acceleration
        [m/s^2] along the way; across it in the corners at full speed, which are arcs but for those with a halt.
    from_rest
        Whether it starts from rest and ends at rest where it does not halt there.
    turn_rate
        [rad/s] on the spot, last thing in a halt; turns take the whole of their halts without it.

    Raises
    ------
    Fault
        The way has no such corners, or a halt is too short for its turn.
    """
    last = len(waypoints) - 1
    stops = [0, *(int(row) for row in np.flatnonzero(halts[1:-1]) + 1), last]
    stretches = []
    for start, end in pairwise(stops):  # each grows to that speed, or as far as its length lets it
        way = round_corners(waypoints[start : end + 1], speed**2 / acceleration, start)
        rests = [from_rest or halts[stop] > 0.0 or 0 < stop < last for stop in (start, end)]
        peak = min(speed, float(np.sqrt(2.0 * acceleration * way.total / sum(rests)))) if any(rests) else speed
        ramps = (peak / acceleration if rest else 0.0 for rest in rests)
        stretches.append(Stretch(way, peak, acceleration, *ramps))
    turns = _turns([stretch.way for stretch in stretches])
    inner = halts[stops[1:-1]]
    times = inner if turn_rate is None else np.abs(turns) / turn_rate
    if (times > (1.0 + 1e-9) * inner).any():
        late = int(np.argmax(times / inner))
        turn = f"the turn of {np.degrees(abs(turns[late])):.3g} degrees there takes {times[late]:.3g} s"
        mend = "halt longer, or raise agent.turn_deg_s"
        raise Fault(f"{inner[late]:g} s, and {turn}", mend, f"halt_s[{stops[late + 1]}]")
    return StopAndGo(stretches, halts[stops], turns, times)


def _turns(ways: Sequence[RoundedPath]) -> Floats:
    """Turns (S - 1,) [rad] on the spot from each of the ways of a stop-and-go motion into the next."""
    tangents = [np.concatenate([way.along, way.at(np.array([way.total]))[1]]) for way in ways]
    heading = along_heading(np.concatenate(tangents))
    first = np.cumsum([len(of_way) for of_way in tangents])[:-1]
    return short_turn(heading[first - 1], heading[first])
