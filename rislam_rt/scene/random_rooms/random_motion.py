"""Random motions of an agent: speed, rates of turn and of climb over time, integrated from a start that keeps clear."""

from typing import Literal, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import SceneError
from rislam_rt.geometry.angles import rotation_z, wrap
from rislam_rt.model import Body, Trajectory
from rislam_rt.scene.random_rooms.random_floor_plan import depth_inside
from rislam_rt.scene.random_rooms.shell import Roof

MOTIONS = ("straight", "curve", "corner", "stop", "turn", "climb")
"""Kinds of random motion."""
CYCLES, CYCLE = 300, 0.1
"""Number of cycles of a random motion, and time [s] between them: half a minute."""
TIME = CYCLE * np.arange(CYCLES, dtype=np.float64)
"""Times (K,) [s] of a random motion's cycles."""
SPEED, SLOWEST = (0.05, 0.6), 0.01
"""Range of random speeds [m/s], log-uniform; in too small a room a draw is slowed down, to `SLOWEST` at least."""
OFF_WALLS, BELOW_CEILING = 0.45, 0.6
"""Least distances [m] of a random motion from the walls and from the ceiling."""
HEIGHT, CLIMB = (0.3, 1.6), (0.3, 0.9)
"""Ranges [m] of a random motion's height at the start, and of its climb or descent."""
WANDER = 0.12
"""Standard deviation [rad/s] of the rate of turn of a random motion along a curve."""
CORNER, CORNER_TIME = (0.9, 2.2), 0.5
"""Range [rad] of the turn at a corner of a random motion, and the time [s] that it takes."""
STANDING, WALKING, BRAKING = (1.0, 3.0), (2.0, 6.0), 0.6
"""Ranges [s] of a random motion's stops and of the time between two, and the time [s] to brake or set off."""
SPIN = (1.0, 3.0)
"""Range [rad] of a random motion's turn on the spot."""
Ways = Literal["anyhow", "along_walls", "carried"]
"""How random motions lie in their room: in any direction and moving from the first cycle on; or from rest, first
parallel or at right angles to a wall, with right angles for corners; or like these, carried by a walker."""
WALL_SPEED = (0.2, 1.4)
"""Range of speeds [m/s] of random motions along walls, log-uniform; in too small a room the way ends early."""
REST, SETTING_OFF = (0.3, 1.0), (0.3, 1.0)
"""Ranges of the rest [s] at the start of a random motion along walls, and of the acceleration [m/s^2] from it, which is
that of its last halt too."""
STEP_RATE, BOB, SWAY = (1.5, 2.2), (0.005, 0.02), (0.005, 0.02)
"""Ranges of a walker's steps per second, and of the amplitudes [m] of what is carried: upwards once in a step, and
sideways once in two: a hand bobs by less than the 27 to 48 mm from top to bottom of a body's centre of mass at 0.7 to
1.6 m/s (Orendurff et al. 2004, J. Rehabil. Res. Dev. 41(6A))."""
STROLL = 0.8
"""Speed [m/s] from which on a walker's amplitudes are whole; below, they are in proportion."""
SHORTEST = 4.0
"""Least time [s] after which a random motion along walls halts for good; its turns, and a climb, go on in place."""
_STARTS, _SLOWER = 64, 0.8


class MotionProfile(NamedTuple):
    """Profile of a random motion: shares of the speed, rates of turn [rad/s] and of climb [m/s], (K,) each."""

    pace: Floats
    turn: Floats
    climb: Floats


def draw_motion_profile(kind: str, ways: Ways = "anyhow", *, rng: np.random.Generator) -> MotionProfile:
    """Draw the profile of a random motion of one of `MOTIONS` and of one of `Ways`, without the rest at its start."""
    still, steady = np.zeros(CYCLES), np.ones(CYCLES)
    if kind == "straight":
        return MotionProfile(steady, still, still)
    if kind == "corner":
        angles = CORNER if ways == "anyhow" else (np.pi / 2.0, np.pi / 2.0)
        return MotionProfile(steady, _corners(angles, rng), still)
    if kind in ("stop", "turn"):
        pace, stops = _stop_and_go(rng)
        turn = 0.5 * _wander(rng)
        return MotionProfile(pace, _spins(stops, rng) if kind == "turn" else turn * pace, still)
    wander = _wander(rng)
    return MotionProfile(steady, wander, _climb(rng) if kind == "climb" else still)


def draw_motion(
    outline: Floats, roof: Roof, course: MotionProfile, ways: Ways = "anyhow", *, rng: np.random.Generator
) -> Trajectory:
    """Lay a random motion's profile into a floor plan, from a random start at a random speed, heading along the motion.

    Where there is no room for it, it is slowed down; one along walls keeps its speed and comes to rest earlier.

    Raises
    ------
    SceneError
        There is no room for it even at the slowest, or the shortest.
    """
    anyhow = ways == "anyhow"
    speed = float(np.exp(rng.uniform(*np.log(SPEED if anyhow else WALL_SPEED))))
    rest, push = (0.0, np.inf) if anyhow else (rng.uniform(*REST), rng.uniform(*SETTING_OFF))
    low, high, end = outline.min(axis=0), outline.max(axis=0), CYCLE * CYCLES
    while speed >= SLOWEST and end >= SHORTEST:
        pace, rate, climb = course if anyhow else _from_rest(course, speed, push, rest, end)
        heading = CYCLE * np.cumsum(rate)
        rise = CYCLE * (np.cumsum(climb) - climb)
        steps = CYCLE * pace[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        shape = np.concatenate([np.zeros((1, 2)), np.cumsum(steps[:-1], axis=0)])
        start = rng.uniform(low, high, size=(_STARTS, 2))
        yaw = rng.uniform(-np.pi, np.pi, size=_STARTS) if anyhow else _along_walls(outline, rng)
        place = start[:, None] + speed * np.einsum("sij,kj->ski", rotation_z(yaw)[:, :2, :2], shape)
        coarse = depth_inside(outline, place[:, ::10]).min(axis=1)
        for number in np.flatnonzero(coarse >= OFF_WALLS):
            height = _start_height(roof, place[number], rise, rng)
            if height is not None and depth_inside(outline, place[number]).min() >= OFF_WALLS:
                position = np.column_stack([place[number], height + rise])
                angle = np.asarray(wrap(yaw[number] + heading))
                ahead = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
                velocity = np.column_stack([speed * pace[:, None] * ahead, climb])
                if ways == "carried":
                    step, by = _carried(speed * pace, ahead, rng)
                    position, velocity = position + step, velocity + by
                return Trajectory(TIME, position, velocity, angle, Body())
        speed, end = (_SLOWER * speed, end) if anyhow else (speed, _SLOWER * end)
    raise SceneError("no room for a motion; draw another plan")


def _carried(pace: Floats, ahead: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Draw what a walker's gait adds to positions (K, 3) [m] and velocities (K, 3) [m/s] of a random motion in a random
    room, at speeds (K,) [m/s] towards unit vectors (K, 2): sines in proportion to the speed up to `STROLL`."""
    rate, bob, sway = rng.uniform(*STEP_RATE), rng.uniform(*BOB), rng.uniform(*SWAY)
    phase = np.pi * rate * TIME + rng.uniform(0.0, 2.0 * np.pi)
    twice = 2.0 * phase + rng.uniform(0.0, 2.0 * np.pi)
    share, left = np.minimum(pace / STROLL, 1.0)[:, None], np.column_stack([-ahead[:, 1], ahead[:, 0]])
    step = share * np.column_stack([sway * np.sin(phase)[:, None] * left, bob * np.sin(twice)])
    by = np.pi * rate * np.column_stack([sway * np.cos(phase)[:, None] * left, 2.0 * bob * np.cos(twice)])
    return step, share * by


def _from_rest(course: MotionProfile, speed: float, push: float, rest: float, end: float) -> MotionProfile:
    """Profile of a random motion at `speed` [m/s] that rests, sets off straight on and stands again at `end` [s].

    It sets off and brakes with `push` [m/s^2]; all else in the profile comes later by the time that setting off takes.
    """
    later = np.count_nonzero(push * (TIME - rest) < speed)
    before = (np.ones(later), np.zeros(later), np.zeros(later))
    pace, turn, climb = (np.concatenate(parts)[:CYCLES] for parts in zip(before, course, strict=True))
    ramp = push / speed * np.maximum(np.minimum(TIME - rest, end - TIME), 0.0)
    return MotionProfile(np.minimum(pace, ramp), turn, climb)


def _along_walls(outline: Floats, rng: np.random.Generator) -> Floats:
    """Draw first courses [rad] of random motions along walls, parallel or at right angles to an edge of the plan."""
    edge = rng.choice(np.roll(outline, -1, axis=0) - outline, size=_STARTS)
    return np.asarray(np.arctan2(edge[:, 1], edge[:, 0]) + 0.5 * np.pi * rng.integers(0, 4, size=_STARTS))


def _start_height(roof: Roof, place: Floats, rise: Floats, rng: np.random.Generator) -> float | None:
    """Draw a random motion's height [m] at the start, so that all of it fits the room; None if it cannot."""
    room = roof.height(place) - BELOW_CEILING - rise
    low, high = HEIGHT[0] - min(0.0, float(rise.min())), min(HEIGHT[1], float(room.min()))
    return None if high < low else float(rng.uniform(low, high))


def _wander(rng: np.random.Generator) -> Floats:
    """Draw the smooth rate of turn (K,) [rad/s] of a random motion: three sines of 6 to 20 s and a mean."""
    period, phase = rng.uniform(6.0, 20.0, size=3), rng.uniform(0.0, 2.0 * np.pi, size=3)
    weight = rng.standard_normal(4) * WANDER * np.array([0.6, 0.6, 0.6, 0.5])
    waves = np.sin(2.0 * np.pi * TIME[:, None] / period + phase)
    return np.asarray(waves @ weight[:3] + weight[3])


def _corners(angles: tuple[float, float], rng: np.random.Generator) -> Floats:
    """Draw the rate of turn (K,) [rad/s] of a random motion with corners 4 to 10 s apart, by angles in a range."""
    rate, at = np.zeros(CYCLES), rng.uniform(2.0, 6.0)
    while at < TIME[-1]:
        turn = rng.uniform(*angles) * rng.choice([-1.0, 1.0])
        rate[slice(*np.searchsorted(TIME, (at, at + CORNER_TIME - 1e-9)))] = turn / CORNER_TIME
        at += rng.uniform(4.0, 10.0)
    return rate


def _stop_and_go(rng: np.random.Generator) -> tuple[Floats, list[tuple[float, float]]]:
    """Draw the stops of a random motion: its shares of the speed (K,), and from when to when [s] the agent stands."""
    pace, stops, at = np.ones(CYCLES), [], rng.uniform(*WALKING)
    while at < TIME[-1]:
        end = at + rng.uniform(*STANDING)
        pace = np.minimum(pace, np.maximum(np.maximum(at - TIME, TIME - end) / BRAKING, 0.0))
        stops.append((at, end))
        at = end + BRAKING + rng.uniform(*WALKING)
    return np.clip(pace, 0.0, 1.0), stops


def _spins(stops: list[tuple[float, float]], rng: np.random.Generator) -> Floats:
    """Draw the rate of turn (K,) [rad/s] of a random motion that turns at a constant rate in every stop."""
    rate = np.zeros(CYCLES)
    for begin, end in stops:
        angle = rng.uniform(*SPIN) * rng.choice([-1.0, 1.0])
        rate[slice(*np.searchsorted(TIME, (begin, end)))] = angle / (end - begin)
    return rate


def _climb(rng: np.random.Generator) -> Floats:
    """Draw the rate of climb (K,) [m/s] of a random motion: one rise or fall over 4 to 10 s, a raised cosine."""
    begin, length = rng.uniform(2.0, 8.0), rng.uniform(4.0, 10.0)
    share = np.clip((TIME - begin) / length, 0.0, 1.0)
    height = rng.uniform(*CLIMB) * rng.choice([-1.0, 1.0])
    return np.asarray(height / length * (1.0 - np.cos(2.0 * np.pi * share)))
