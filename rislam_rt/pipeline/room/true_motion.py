"""The true motion of a run: the scene's trajectory plus white-noise acceleration, as the filter's model has it, and a
body that looks about."""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.walls import build_walls
from rislam_rt.errors import ConfigError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.model import Scene, Trajectory

CLEARANCE = 0.3
"""Least distance [m] of a drawn trajectory from every surface; less where the scene's own trajectory comes nearer."""
BATCH = 256
"""Number of trajectories drawn at a time."""
MAX_BATCHES = 400
"""Batches of drawn trajectories after which the acceleration is held to be too large for the room."""


def draw_motion(scene: Scene, sigma_a: float, *, rng: np.random.Generator) -> Trajectory:
    """Draw the true trajectory: the scene's plus a random walk of the velocity in the horizontal plane.

    Discrete white-noise acceleration: over each step of `dt` an acceleration of standard deviation `sigma_a` [m/s^2]
    an axis, `v += a dt`, `x += v dt + a dt^2 / 2`, starting at rest against the scene's trajectory. Whole trajectories
    are redrawn until one stays `CLEARANCE` inside the walls (a step is far shorter than that, so none leads through
    one). The law is then that of the process on condition that it stays in the room: where `sigma_a` is large for the
    room, a filter that does not know of the walls reckons with more motion than there is. Heading and height are the
    scene's.

    Raises
    ------
    ConfigError
        None of `BATCH * MAX_BATCHES` trajectories stays inside.
    """
    motion = scene.agent
    if sigma_a == 0.0 or len(motion) < 2:
        return motion
    walls = build_walls(scene)
    surfaces = np.concatenate([walls.triangles, walls.occluders.triangles])
    clearance = min(CLEARANCE, float(distance_to_triangles(motion.position, surfaces).min()))
    low, high = scene.bounds[:, :2] + clearance * np.array([[1.0], [-1.0]])
    for _ in range(MAX_BATCHES):
        shift, speed = draw_walks(motion.time, sigma_a, BATCH, rng=rng)
        place = motion.position[:, :2] + shift
        for number in np.flatnonzero(((place >= low) & (place <= high)).all(axis=(1, 2))):
            position, velocity = motion.position.copy(), motion.velocity.copy()
            position[:, :2], velocity[:, :2] = place[number], velocity[:, :2] + speed[number]
            if float(distance_to_triangles(position, surfaces).min()) >= clearance - 1e-9:
                return replace(motion, position=position, velocity=velocity)
    raise ConfigError(
        f"motion.sigma_a_m_s2: {sigma_a:g} received; none of {BATCH * MAX_BATCHES} draws stays in '{scene.name}' for "
        f"{motion.time[-1] - motion.time[0]:.3g} s, give less, or fewer cycles"
    )


def draw_looks(motion: Trajectory, std: float, *, rng: np.random.Generator) -> Trajectory:
    """True motion of a body that looks about: its heading wanders off the scene's by a standard deviation [rad], as a
    sum of sines of 3 to 10 s, while the way stays as it is."""
    if std == 0.0:
        return motion
    period, phase = rng.uniform(3.0, 10.0, size=3), rng.uniform(0.0, 2.0 * np.pi, size=3)
    waves = np.sin(2.0 * np.pi * motion.time[:, None] / period + phase)
    return replace(motion, heading=motion.heading + std * np.sqrt(2.0 / 3.0) * waves.sum(axis=1))


def draw_walks(time: Floats, sigma_a: float, count: int, *, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Random walks in the true motion: positions and velocities (count, K, 2) [m, m/s] from rest in the origin."""
    dt = np.diff(time)[:, None]
    push = sigma_a * rng.standard_normal((count, len(time) - 1, 2))
    speed = np.zeros((count, len(time), 2))
    np.cumsum(push * dt, axis=1, out=speed[:, 1:])
    shift = np.zeros_like(speed)
    np.cumsum(speed[:, :-1] * dt + 0.5 * push * dt**2, axis=1, out=shift[:, 1:])
    return shift, speed
