"""The agent's true motion: a straight line, or a TUM file (`timestamp x y z qx qy qz qw`, one pose a line)."""

from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import GeometryError
from rislam_rt.model import Body, Trajectory
from rislam_rt.scene.findings import Fault
from rislam_rt.scene.meshes import read_inside
from rislam_rt.scene.schema import SMALLEST, AgentSection

MAX_TUM_BYTES = 100_000_000
MAX_TIME = 1e11
"""[s] From the epoch on, three thousand years: a recording's clock, and float64 still tells microseconds apart."""
MAX_STEP = 1e6
"""[s] Twelve days: longer gaps lie between recordings, not within one."""
MAX_TILT = 1e-3
"""Largest angle [rad] of a pose's z axis from the room's: the body turns about z only."""


def build_motion(agent: AgentSection, folder: Path) -> tuple[Trajectory, bytes]:
    """The trajectory of a scene file's agent section, and the bytes of its TUM file (empty without one).

    Raises
    ------
    Fault
        Tx and Rx coincide, or the TUM file is missing, damaged or contradicts the section.
    """
    body = _body(agent)
    if agent.trajectory is None:
        return straight_motion(agent.start, agent.velocity, agent.cycles or 0, agent.cycle_s or 0.0, body), b""
    content = read_inside(folder, agent.trajectory, MAX_TUM_BYTES)
    time, position, heading = parse_tum(content)
    if agent.cycles is not None:
        if agent.cycles > len(time):
            raise Fault(
                f"{agent.cycles} cycles wanted, {len(time)} poses in '{agent.trajectory}'", "lower agent.cycles"
            )
        time, position, heading = time[: agent.cycles], position[: agent.cycles], heading[: agent.cycles]
    if agent.cycle_s is not None and np.abs(np.diff(time) - agent.cycle_s).max(initial=0.0) > 1e-6:
        raise Fault(f"time steps of '{agent.trajectory}' differ from agent.cycle_s = {agent.cycle_s}", "mend either")
    if agent.start is not None and np.linalg.norm(position[0] - agent.start) > 1e-3:
        raise Fault(f"first pose {position[0].tolist()} is not agent.start {agent.start}", "leave agent.start out")
    return Trajectory(time, position, _velocity(time, position), heading, body), content


def straight_motion(start: Any, velocity: Any, cycles: int, cycle_s: float, body: Body) -> Trajectory:
    """Constant velocity (3,) [m/s] from `start` (3,) [m]; heading along it, 0 if it has no horizontal part."""
    time = np.arange(cycles, dtype=np.float64) * cycle_s
    speed = np.asarray(velocity, dtype=np.float64)
    heading = np.arctan2(speed[1], speed[0]) if np.hypot(speed[0], speed[1]) > 0.0 else 0.0
    position = np.asarray(start, dtype=np.float64) + time[:, None] * speed
    return Trajectory(time, position, np.tile(speed, (cycles, 1)), np.full(cycles, heading), body)


def parse_tum(content: bytes) -> tuple[Floats, Floats, Floats]:
    """Time (K,) [s], position (K, 3) [m] and heading (K,) [rad] of a TUM file; `#` starts a comment.

    Raises
    ------
    Fault
        A line is not eight finite numbers, time does not grow, or a pose is tilted.
    """
    rows = []
    for number, line in enumerate(content.decode("utf-8", errors="replace").splitlines(), start=1):
        words = line.split("#")[0].split()
        if words:
            rows.append(_pose(words, number))
    if not rows:
        raise Fault("the trajectory file holds no pose", "give lines 'timestamp x y z qx qy qz qw'")
    table = np.array(rows)
    time, position, q = table[:, 0], table[:, 1:4], table[:, 4:]
    if np.abs(time).max() > MAX_TIME:
        raise Fault(f"a time of {time[np.argmax(np.abs(time))]:.3g} s in the trajectory", "give seconds")
    step = np.diff(time)
    if (step <= 0.0).any():
        pose = int(np.argmax(step <= 0.0)) + 1
        raise Fault(f"time does not grow at pose {pose} ({time[pose]} s)", "sort the poses and drop repeated ones")
    odd = (step < SMALLEST) | (step > MAX_STEP)
    if odd.any():
        pose = int(np.argmax(odd)) + 1
        raise Fault(
            f"{step[pose - 1]:.3g} s from the pose before to pose {pose}",
            f"give steps of {SMALLEST:g} to {MAX_STEP:g} s: cut the file at a gap, thin it out where it is too dense",
        )
    if np.abs(position).max() > 1e5:
        raise Fault(f"a coordinate of {np.abs(position).max():.3g} m in the trajectory", "give metres")
    length = np.linalg.norm(np.clip(q, -2.0, 2.0), axis=1)  # a wrong length stays one, and no square overflows
    if (np.abs(length - 1.0) > 1e-3).any():
        raise Fault(
            f"quaternion of pose {int(np.argmax(np.abs(length - 1.0) > 1e-3))} has not length 1", "normalise it"
        )
    x, y, z, w = (q / length[:, None]).T
    tilt = 2.0 * np.hypot(x, y)
    if (tilt > MAX_TILT).any():
        raise Fault(f"pose {int(np.argmax(tilt > MAX_TILT))} is tilted", "give rotations about z only (qx = qy = 0)")
    return time, position, 2.0 * np.arctan2(z, w)


def _velocity(time: Floats, position: Floats) -> Floats:
    """(K, 3) [m/s] by central differences; zero for a single pose."""
    if len(time) < 2:
        return np.zeros_like(position)
    return np.asarray(np.gradient(position, time, axis=0), dtype=np.float64)


def _pose(words: list[str], number: int) -> list[float]:
    try:
        row = [float(word) for word in words]
    except ValueError:
        row = []
    if len(row) != 8 or not np.isfinite(row).all():
        raise Fault(
            f"line {number} of the trajectory is not eight finite numbers", "give 'timestamp x y z qx qy qz qw'"
        )
    return row


def _body(agent: AgentSection) -> Body:
    offsets = {"tx_offset": agent.tx_offset_m, "rx_offset": agent.rx_offset_m}
    try:
        return Body(**{name: np.array(value) for name, value in offsets.items() if value is not None})
    except GeometryError as error:
        what, _, mend = str(error).partition("; ")
        raise Fault(what, mend) from None
