"""What motion does to paths within a cycle: Doppler shifts, and the same paths a moment later."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.channel.cross_section import cross_section
from rislam_rt.channel.walls import Walls, build_walls
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import rotation_z, unit
from rislam_rt.geometry.planes import mirror, mirror_direction
from rislam_rt.model import Paths, RadioConfig, RisCode, RisLegs, RisSpec, Scene, Trajectory
from rislam_rt.ris import leg_response, rephase, zero_code


def doppler_shift(paths: Paths, trajectory: Trajectory, wavelength: float) -> Floats:
    """Doppler shift (K, P) [Hz] of every path, 0 where a path is not valid.

    `-(v . g) / lambda`, g the gradient of the path's length: each end contributes its velocity along the ray that
    leaves or reaches it, and walls and landmarks stand still. Both ends ride on one body, so a line of sight has no
    shift unless the agent turns, and a return from ahead has the shift of both ends.
    """
    tx, rx = end_velocities(trajectory)
    along = np.einsum("kpi,ki->kp", paths.departure, tx) + np.einsum("kpi,ki->kp", paths.arrival, rx)
    return along / wavelength


def end_velocities(trajectory: Trajectory) -> tuple[Floats, Floats]:
    """Velocities (K, 3) [m/s] of Tx and Rx, which make the Doppler shift: the agent's own, and its turning's."""
    quarter = rotation_z(trajectory.heading + np.pi / 2.0)
    horizontal = np.array([1.0, 1.0, 0.0])
    turn = turn_rate(trajectory)[:, None]
    body = trajectory.body
    return (
        trajectory.velocity + turn * (quarter @ (horizontal * body.tx_offset)),
        trajectory.velocity + turn * (quarter @ (horizontal * body.rx_offset)),
    )


def turn_rate(trajectory: Trajectory) -> Floats:
    """Rate (K,) [rad/s] of the heading for the ends' Doppler, from its differences between cycles."""
    if len(trajectory) < 2:
        return np.zeros(len(trajectory))
    return np.gradient(np.unwrap(trajectory.heading), trajectory.time)


def advance_trajectory(trajectory: Trajectory, elapsed: float) -> Trajectory:
    """Moved trajectory: every pose `elapsed` [s] later, at the cycle's velocity and turn rate."""
    return replace(
        trajectory,
        time=trajectory.time + elapsed,
        position=trajectory.position + elapsed * trajectory.velocity,
        heading=trajectory.heading + elapsed * turn_rate(trajectory),
    )


def advance_paths(
    paths: Paths,
    scene: Scene,
    radio: RadioConfig,
    trajectory: Trajectory,
    elapsed: float,
    code: RisCode | None = None,
) -> Paths:
    """The same paths `elapsed` [s] after the beginning of their cycles, each agent moving on.

    Parameters
    ----------
    trajectory
        The poses that `paths` were found at.
    elapsed
        [s]; negative looks back.
    code
        The panel's code, level 0 if none is given.

    Delays, directions, vertices, spreading loss, cross-sections and carrier phase are exact, those of the panel element
    by element.
    Which paths exist, and reflection coefficients, are held: within a cycle an agent moves by millimetres. No trace.
    """
    walls, later = build_walls(scene), advance_trajectory(trajectory, elapsed)
    before, after = _rays(paths, scene, walls, trajectory), _rays(paths, scene, walls, later)
    turned = np.exp(-2j * np.pi / radio.wavelength * (after.length - before.length))
    valid, points = paths.valid, _vertices(paths, walls, later, after)
    strength = _strength(paths, scene, walls, later, radio.wavelength, over=trajectory)
    moved = replace(
        paths,
        tau=np.where(valid, after.length / SPEED_OF_LIGHT, 0.0),
        departure=np.where(valid[..., None], after.departure, 0.0),
        arrival=np.where(valid[..., None], after.arrival, 0.0),
        vertices=np.where(valid[..., None, None], points, 0.0),
        gain=paths.gain * turned * strength * before.spreading / after.spreading,
        ris=None if paths.ris is None else _panel_legs(paths, scene, walls, radio, trajectory, later),
    )
    if scene.ris is None:
        return moved
    return rephase(moved, code if code is not None else zero_code(scene.ris.spec))


class _Rays(NamedTuple):
    """All paths (K, P) at one moment, by mirror images: nothing here asks whether a path exists."""

    length: Floats
    """[m]."""
    spreading: Floats
    """Length, or the product of both legs' lengths: what the amplitude is inverse to."""
    departure: Floats
    """(K, P, 3)."""
    arrival: Floats
    """(K, P, 3)."""


def _rays(paths: Paths, scene: Scene, walls: Walls, trajectory: Trajectory) -> _Rays:
    """Lengths and directions of moved paths for poses (K,)."""
    direct = (paths.landmark < 0)[:, None]
    tx, rx = (np.broadcast_to(end[:, None], (*paths.valid.shape, 3)) for end in (trajectory.tx, trajectory.rx))
    landmark = _landmark_points(paths, scene)
    ahead = _mirrored(np.where(direct, rx, landmark), walls, paths.tx_walls[:, ::-1]) - tx
    back = _mirrored(np.where(direct, tx, landmark), walls, np.where(direct, paths.tx_walls, paths.rx_walls)) - rx
    first, second = np.linalg.norm(ahead, axis=-1), np.linalg.norm(back, axis=-1)
    return _Rays(
        np.where(direct[:, 0], first, first + second),
        np.where(direct[:, 0], first, first * second),
        unit(ahead),
        unit(back),
    )


def _strength(
    paths: Paths, scene: Scene, walls: Walls, trajectory: Trajectory, wavelength: float, *, over: Trajectory
) -> Floats:
    """Factor (K, P) on a moved path's gain from cross-sections that depend on directions, against an earlier `over`."""
    factor = np.ones(paths.valid.shape)
    for number, scatterer in enumerate(scene.scatterers):
        mine = np.flatnonzero(paths.landmark == number)
        values = []
        for motion in (over, trajectory):
            ends = ((motion.tx, paths.tx_walls[mine]), (motion.rx, paths.rx_walls[mine, ::-1]))
            images = [_mirrored(np.repeat(end[:, None], len(mine), axis=1), walls, seq) for end, seq in ends]
            values.append(cross_section(scatterer, wavelength, *(unit(p - scatterer.position) for p in images)))
        dark = values[0] == 0.0
        factor[:, mine] = np.where(dark, 0.0, np.sqrt(values[1] / np.where(dark, 1.0, values[0])))
    return factor


def _vertices(paths: Paths, walls: Walls, trajectory: Trajectory, rays: _Rays) -> Floats:
    """Interaction points (K, P, V, 3) [m] of moved paths, in the order of travel."""
    ahead = _bounces(trajectory.tx, rays.departure, walls, paths.tx_walls)
    back = _bounces(trajectory.rx, rays.arrival, walls, paths.rx_walls[:, ::-1])[:, :, ::-1]
    vertices = np.array(paths.vertices)
    for path in range(paths.num_paths):
        first, last = int((paths.tx_walls[path] >= 0).sum()), int((paths.rx_walls[path] >= 0).sum())
        count = int(paths.num_vertices[path])
        vertices[:, path, :first] = ahead[:, path, :first]
        vertices[:, path, count - last : count] = back[:, path, :last]
    return vertices


def _bounces(start: Floats, direction: Floats, walls: Walls, sequences: Integers) -> Floats:
    """Where moved rays (K, P, 3) from devices (K, 3) meet walls (P, D), one after the other: (K, P, D, 3)."""
    point, found = np.broadcast_to(start[:, None], direction.shape), np.zeros((*direction.shape[:2], 0, 3))
    for column in sequences.T if len(walls) else []:
        normal = walls.normal[column]
        slope = np.sum(direction * normal, axis=-1)
        real = (column >= 0) & (slope != 0.0)
        gap = walls.offset[column] - np.sum(point * normal, axis=-1)
        point = point + np.where(real, gap / np.where(real, slope, 1.0), 0.0)[..., None] * direction
        direction = np.where(real[..., None], mirror_direction(direction, normal), direction)
        found = np.concatenate([found, point[:, :, None]], axis=2)
    return found


def _landmark_points(paths: Paths, scene: Scene) -> Floats:
    """(P, 3) [m] landmarks of moved paths, the origin for paths without one."""
    return np.concatenate([scene.landmark_positions, np.zeros((1, 3))])[paths.landmark]


def _mirrored(points: Floats, walls: Walls, sequences: Integers) -> Floats:
    """Points (K, P, 3) mirrored in the walls (P, D) of their path, first column first; -1 stands for no wall."""
    for column in sequences.T if len(walls) else []:
        image = mirror(points, walls.normal[column], walls.offset[column])
        points = np.where(column[:, None] >= 0, image, points)
    return points


def _panel_legs(
    paths: Paths, scene: Scene, walls: Walls, radio: RadioConfig, before: Trajectory, after: Trajectory
) -> RisLegs | None:
    """Element responses of a moved path's panel legs: each element's own change of distance and angle."""
    if paths.ris is None or scene.ris is None:
        return paths.ris
    responses = []
    for response, leg, sequences, end in (
        (paths.ris.tx, paths.ris.tx_leg, paths.tx_walls, "tx"),
        (paths.ris.rx, paths.ris.rx_leg, paths.rx_walls[:, ::-1], "rx"),
    ):
        used, path = np.unique(leg, return_index=True)
        used, path = used[used >= 0], path[used >= 0]
        ends = (getattr(before, end), getattr(after, end))
        images = [_mirrored(np.repeat(p[:, None], len(used), axis=1), walls, sequences[path]) for p in ends]
        moved = np.array(response)
        for number, panel in enumerate(scene.panels):
            mine = paths.panel[path] == number
            old, new = (image[:, mine] for image in images)
            ratio = _ratio(panel.spec, panel.center, old, new, radio.wavelength)
            moved[:, used[mine]] *= scene.ris.spec.place(number, ratio)
        responses.append(moved)
    return replace(paths.ris, tx=responses[0], rx=responses[1])


def _ratio(spec: RisSpec, center: Floats, before: Floats, after: Floats, wavelength: float) -> Complexes:
    """Element responses (K, I, N, M) of devices that moved over those before, 1 where the panel's back is shown."""
    one = np.ones(before.shape[:-1], dtype=np.complex128)
    old, new = (leg_response(spec, center, device, one, wavelength) for device in (before, after))
    return np.where(old == 0.0, 1.0, new / np.where(old == 0.0, 1.0, old))
