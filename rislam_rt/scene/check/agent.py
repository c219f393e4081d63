"""Scene check of the agent: where it starts, what it runs into, what it could never receive."""

from collections.abc import Iterator

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.constants import MAX_SPEED
from rislam_rt.geometry.triangles import connected_triangles
from rislam_rt.model import RadioConfig
from rislam_rt.scene.check.mesh_queries import crossings, ray_hits, sphere_directions, touching, winding
from rislam_rt.scene.check.triangle_array import KEEP_AWAY, MIN_CLEARANCE, TriangleArray
from rislam_rt.scene.findings import Finding

NUM_PROBES = 400
"""Rays cast from the agent's start to look for holes of the room: one of 0.03 sr, 30 cm wide at 2 m, is found."""

LONGEST_GAP, MANY_STEPS = 5.0, 10.0
"""Gap in a recording [s], and its ratio to the usual step, up to which it is taken for meant."""


def agent_errors(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: errors of an agent out of bounds, on a surface, inside an object, or through a wall."""
    motion = room.scene.agent
    places = {"agent": motion.position, "Tx": motion.tx, "Rx": motion.rx}
    for part, points in places.items():
        outside = room.outside(points)
        if len(outside):
            message = f"{_where(part, outside[0], points)} lies outside the meshes' bounds {room.box}"
            yield room.error(_field(room, outside[0]), message, "move the start or change the motion")
            return
    for part, points in places.items():
        cycles, near = touching(points, room.triangles, MIN_CLEARANCE)
        if len(cycles):
            message = f"{_where(part, cycles[0], points)} lies on '{room.name(near[0])}'"
            yield room.error(_field(room, cycles[0]), message, KEEP_AWAY)
            break
    yield from _through_wall(room)
    name = _enclosing(room, motion.position[0], holding=room.scene.landmark_positions)
    if name:  # as the path crosses no surface, all of it is inside
        message = f"{motion.position[0].tolist()} lies inside the object '{name}'"
        yield room.error(room.start_key, message, "move the start out of it")


def agent_warnings(room: TriangleArray, radio: RadioConfig) -> Iterator[Finding]:
    """Scene check: warnings of an open room, a wrong unit of speed, scatterers in objects or below the array."""
    motion = room.scene.agent
    directions = sphere_directions(NUM_PROBES)
    lost = ray_hits(motion.position[0], directions, room.triangles) < 0
    if lost.any():
        mean = np.round(directions[lost].mean(axis=0), 2) + 0.0
        message = f"{lost.mean():.1%} of rays from the start leave the room, towards {mean.tolist()} in the mean"
        yield room.warning("reflector", message, "close the room, if it is not meant to be open")
    yield from _odd_steps(room)
    for number, scatterer in enumerate(room.scene.scatterers):
        field = f"scatterer[{number}].position ({scatterer.name})"
        away = np.linalg.norm(np.stack([motion.tx, motion.rx]) - scatterer.position, axis=-1).min(axis=0)
        radius = max(scatterer.radius or 0.0, MIN_CLEARANCE)
        if away.min() < radius:
            near = f"within {away.min():.2g} m of its centre at cycle {np.argmin(away)}"
            message = f"the agent comes {near}, and its radius is {radius:g} m"
            yield room.warning(field, message, "lead the agent around it")
        if radio.array.pattern == "upper" and (motion.rx[:, 2] >= scatterer.position[2]).all():
            message = "it lies below the array, which hears from above only"
            yield room.warning(field, message, "it will not be heard: fine if that is meant, else raise it")
        name = _enclosing(room, scatterer.position, holding=motion.position[:1])
        if name:
            yield room.warning(field, f"it lies inside '{name}', where no ray reaches it", "move it out")


def _odd_steps(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: warnings of a wrong unit of speed, and of a gap in a recording."""
    motion = room.scene.agent
    step = np.diff(motion.time)
    if not len(step):
        return
    speed = np.linalg.norm(np.diff(motion.position, axis=0), axis=-1) / step
    fast, gap, usual = int(np.argmax(speed)), int(np.argmax(step)), float(np.median(step))
    if speed[fast] > MAX_SPEED:
        message = f"it moves at up to {speed[fast]:.3g} m/s (after cycle {fast})"
        yield room.warning("agent", message, "give metres and seconds, and mend what jumps there")
    if step[gap] > max(LONGEST_GAP, MANY_STEPS * usual):
        rest = f"where else there are {usual:.3g} s between poses"
        message = f"{step[gap]:.3g} s without a pose after cycle {gap}, {rest}"
        yield room.warning("agent.trajectory", message, "cut the file there, unless it is meant")


def _through_wall(room: TriangleArray) -> Iterator[Finding]:
    """Scene check: error of an agent whose path goes through a surface, or that has one between Tx and Rx."""
    motion = room.scene.agent
    cycles, walls = crossings(motion.position[:-1], motion.position[1:], room.triangles)
    if len(cycles):
        message = f"the path goes through '{room.name(walls[0])}' after cycle {cycles[0]}"
        yield room.error("agent", message, "lead it around the object")
        return
    cycles, walls = crossings(motion.tx, motion.rx, room.triangles)
    if len(cycles):
        message = f"'{room.name(walls[0])}' stands between Tx and Rx at cycle {cycles[0]}"
        yield room.error(_field(room, cycles[0]), message, "keep further away from it")


def _enclosing(room: TriangleArray, point: Floats, holding: Floats) -> str:
    """Scene check: name of the object around a point (3,) that holds no mark (H, 3), a reflector; empty without one."""
    scene_box = np.prod(room.bounds[1] - room.bounds[0])
    for number, reflector in enumerate(room.scene.reflectors):
        mine = room.triangles[room.owner == number]
        low, high = mine.min(axis=(0, 1)), mine.max(axis=(0, 1))
        if (point < low).any() or (point > high).any():
            continue
        label = connected_triangles(mine)
        for piece in range(label.max() + 1):
            solid = mine[label == piece]
            # more than a tenth of the scene's box is no object, nor is what holds a mark: a room of a larger building
            if np.prod(np.ptp(solid.reshape(-1, 3), axis=0)) > 0.1 * scene_box or abs(winding(point, solid)) < 0.5:
                continue
            if not any(abs(winding(mark, solid)) > 0.25 for mark in holding):
                return reflector.name
    return ""


def _where(part: str, cycle: np.int64, points: Floats) -> str:
    """Position of a part of the agent at a cycle, in words for a finding of the scene check."""
    return f"{part} at {np.round(points[cycle], 4).tolist()} (cycle {cycle})"


def _field(room: TriangleArray, cycle: np.int64) -> str:
    """Key of the scene file that says where the agent is at a cycle; how it moves on, several can say."""
    return room.start_key if cycle == 0 else "agent"
