"""The agent's true motion: a straight line, a recording (TUM or CSV), a path along waypoints, or a random walk."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import GeometryError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.model import Body, Trajectory
from rislam_rt.scene.check.triangle_array import KEEP_AWAY, MIN_CLEARANCE
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.motion.random_walk import draw_walk
from rislam_rt.scene.motion.recorded_poses import RecordedPoses, parse_csv, parse_tum
from rislam_rt.scene.motion.stop_and_go import plan_stops
from rislam_rt.scene.motion.waypoints import RoundedPath, along_heading, round_corners
from rislam_rt.scene.scene_folder import read_inside
from rislam_rt.scene.schema import AgentSection

MAX_TUM_BYTES = 100_000_000
"""Most bytes of a recording of the agent's motion."""
MAX_CYCLES = 1_000_000
"""Most cycles of a trajectory."""
SAME_STEP = 1e-6
"""Steps [s] of a recording this near to the cycle are the cycle; time stamps from the epoch on are no finer."""
LONGEST_GAP = 5.0
"""Longest gap [s] in a recording over which poses are interpolated: where the agent went is not known."""


def build_motion(agent: AgentSection, folder: Path, triangles: Floats) -> tuple[Trajectory, bytes]:
    """Motion of the agent from its section of the scene file, and the bytes of its recording (empty without one).

    Parameters
    ----------
    triangles
        (T, 3, 3) [m] of all that a random walk keeps away from.

    Raises
    ------
    Fault
        Tx and Rx coincide, the recording is missing, damaged or contradicts the section, or no such way exists.
    """
    body = _body(agent)
    if agent.velocity is not None:
        return straight_motion(agent.start, agent.velocity, agent.cycles or 0, agent.cycle_s or 0.0, body), b""
    if agent.trajectory is not None:
        try:
            content = read_inside(folder, agent.trajectory, MAX_TUM_BYTES)
            return _recorded_motion(agent, content, body), content
        except Fault as fault:
            name = agent.trajectory[:80]
            message = fault.message if name in fault.message else f"'{name}': {fault.message}"
            raise Fault(message, fault.mend, "trajectory") from None
    if agent.waypoints is not None:
        return _waypoint_motion(agent, agent.waypoints, triangles, body), b""
    return _walk(agent, triangles, body), b""


def straight_motion(start: Any, velocity: Any, cycles: int, cycle_s: float, body: Body) -> Trajectory:
    """Motion at constant velocity (3,) [m/s] from `start` (3,) [m], heading along it (0 if vertical)."""
    time = np.arange(cycles, dtype=np.float64) * cycle_s
    speed = np.asarray(velocity, dtype=np.float64)
    heading = np.arctan2(speed[1], speed[0]) if np.hypot(speed[0], speed[1]) > 0.0 else 0.0
    position = np.asarray(start, dtype=np.float64) + time[:, None] * speed
    return Trajectory(time, position, np.tile(speed, (cycles, 1)), np.full(cycles, heading), body)


def travel(way: RoundedPath, speed: float, cycle_s: float, cycles: int | None, body: Body) -> Trajectory:
    """Motion along a path with rounded corners at constant speed [m/s], heading along it, to its end, or for `cycles`.

    Raises
    ------
    Fault
        The way is too short for the cycles, or too long.
    """
    time = _cycle_times(way.total / (speed * cycle_s), way.total, cycle_s, cycles)
    position, along = way.at(speed * time)
    return Trajectory(time, position, speed * along, along_heading(along), body)


def at_cycles(recording: RecordedPoses, cycle_s: float) -> RecordedPoses:
    """Interpolate the agent's recorded motion at even times, `cycle_s` [s] apart from the first on: positions by
    monotone cubics, headings linearly.

    Raises
    ------
    Fault
        A gap is longer than `LONGEST_GAP`, or there would be too many cycles.
    """
    from scipy.interpolate import PchipInterpolator

    time = recording.time - recording.time[0]
    step = np.diff(time)
    if step.max(initial=0.0) > max(LONGEST_GAP, cycle_s):
        pose = int(np.argmax(step))
        gap = f"{step[pose]:.3g} s without a pose after pose {pose}"
        raise Fault(f"{gap}, over which agent.cycle_s would have to interpolate", "cut the file there")
    count = int(time[-1] / cycle_s + 1e-6) + 1
    if count > MAX_CYCLES:
        raise Fault(f"{count} cycles of {cycle_s:g} s in the trajectory", f"give at most {MAX_CYCLES}")
    even = np.minimum(np.arange(count) * cycle_s, time[-1])
    position = PchipInterpolator(time, recording.position, axis=0)(even) if len(time) > 1 else recording.position
    heading = None if recording.heading is None else np.interp(even, time, np.unwrap(recording.heading))
    return RecordedPoses(recording.time[0] + np.arange(count) * cycle_s, position, heading)


def _waypoint_motion(agent: AgentSection, waypoints: list[list[float]], triangles: Floats, body: Body) -> Trajectory:
    """Motion of the agent along waypoints, off all triangles (T, 3, 3) [m]: at constant speed, unless halts or rest are
    asked for."""
    points, speed, cycle_s = np.array(waypoints, dtype=np.float64), agent.speed_m_s or 0.0, agent.cycle_s or 0.0
    # the scene check looks at the cycles, the first of which is at the first waypoint, and the last seldom at the last
    away = distance_to_triangles(points[1:], triangles)
    if away.min(initial=np.inf) < MIN_CLEARANCE:
        number = int(np.argmin(away)) + 1
        raise Fault(f"{waypoints[number]} lies on a surface", KEEP_AWAY, f"waypoints[{number}]")
    from_rest = agent.halt_s is not None if agent.from_rest is None else agent.from_rest
    if agent.halt_s is None and not from_rest:
        motion = travel(round_corners(points, speed**2 / agent.acceleration_m_s2), speed, cycle_s, agent.cycles, body)
    else:
        halts = np.zeros(len(points)) if agent.halt_s is None else np.array(agent.halt_s, dtype=np.float64)
        rate = None if agent.turn_deg_s is None else float(np.radians(agent.turn_deg_s))
        plan = plan_stops(points, halts, speed, agent.acceleration_m_s2, from_rest, rate)
        time = _cycle_times(plan.duration / cycle_s, plan.total, cycle_s, agent.cycles)
        motion = Trajectory(time, *plan.at(time), body)
    if agent.heading_deg is None:
        return motion
    return replace(motion, heading=np.full(len(motion), np.radians(agent.heading_deg)))


def _walk(agent: AgentSection, triangles: Floats, body: Body) -> Trajectory:
    """Motion of the agent on a random walk that keeps away from triangles (T, 3, 3) [m]."""
    assert agent.random_walk is not None
    speed, cycle_s, cycles = agent.speed_m_s or 0.0, agent.cycle_s or 0.0, agent.cycles or 0
    length, radius = speed * cycle_s * (cycles - 1), speed**2 / agent.acceleration_m_s2
    rng = np.random.default_rng(agent.random_walk.seed)
    start = np.array(agent.start, dtype=np.float64)
    way = draw_walk(start, length, radius, agent.random_walk.clearance_m, triangles, rng=rng)
    return travel(way, speed, cycle_s, cycles, body)


def _cycle_times(steps: float, length: float, cycle_s: float, cycles: int | None) -> Floats:
    """Times (K,) [s] of the cycles of the agent's motion along a way of that length [m], and of so many steps."""
    most = int(steps + 1e-9) + 1
    if cycles is not None and cycles > most:
        what = f"{cycles} cycles wanted, the way of {length:.3g} m ends after {most}"
        raise Fault(what, "lower agent.cycles, or lead the way on")
    if (cycles or most) > MAX_CYCLES:
        raise Fault(f"the way of {length:.3g} m takes {most} cycles", f"give at most {MAX_CYCLES}: agent.cycles")
    return np.arange(cycles or most, dtype=np.float64) * cycle_s


def _recorded_motion(agent: AgentSection, content: bytes, body: Body) -> Trajectory:
    """Motion of the agent from a recording (TUM or CSV), as far as the agent section contradicts none of it."""
    assert agent.trajectory is not None
    named = agent.columns or {}
    is_csv = agent.trajectory.lower().endswith(".csv")
    if named and not is_csv:
        raise Fault(f"'{agent.trajectory}' is no CSV file, and agent.columns is given", "leave agent.columns out")
    found = parse_csv(content, named) if is_csv else RecordedPoses(*parse_tum(content))
    if agent.start is not None and np.linalg.norm(found.position[0] - agent.start) > 1e-3:
        raise Fault(f"first pose {found.position[0].tolist()} is not agent.start {agent.start}", "leave it out")
    if agent.cycle_s is not None and np.abs(np.diff(found.time) - agent.cycle_s).max(initial=0.0) > SAME_STEP:
        found = at_cycles(found, agent.cycle_s)
    time, position, heading = found
    if agent.cycles is not None:
        if agent.cycles > len(time):
            what = f"{agent.cycles} cycles wanted, {len(time)} poses in '{agent.trajectory}'"
            raise Fault(what, "lower agent.cycles")
        time, position = time[: agent.cycles], position[: agent.cycles]
        heading = None if heading is None else heading[: agent.cycles]
    velocity = np.asarray(np.gradient(position, time, axis=0)) if len(time) > 1 else np.zeros_like(position)
    return Trajectory(time, position, velocity, along_heading(velocity) if heading is None else heading, body)


def _body(agent: AgentSection) -> Body:
    """Offsets of Tx and Rx for the agent's motion, from the agent section of the scene file."""
    offsets = {"tx_offset": agent.tx_offset_m, "rx_offset": agent.rx_offset_m}
    try:
        return Body(**{name: np.array(value) for name, value in offsets.items() if value is not None})
    except GeometryError as error:
        raise Fault.of(error) from None
