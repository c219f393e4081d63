"""Random walks through a room, and random versions of the room: what a classifier should have met before."""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.compare.poses import random_poses
from rislam_rt.errors import SceneError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.model import Material, Scene, Trajectory

CLEARANCE = 0.2
"""Distance [m] from every surface that a walk keeps."""
CYCLE = 0.1
"""Time [s] between cycles."""
SPEED, TURN_RATE = (0.05, 0.2), 0.15
"""Range of speeds [m/s]; standard deviation of the rate at which a walk turns [rad/s]."""
REFLECTION, RADIUS = (0.15, 0.95), (0.02, 0.25)
"""Ranges of reflection coefficients, and of scatterer radii [m] (log-uniform), in random versions of a room."""
SLABS = {"concrete": 0.2, "brick": 0.12, "plasterboard": 0.025, "chipboard": 0.02, "marble": 0.03, "plywood": 0.02}
"""ITU materials, and thicknesses [m], of random versions; those of the room `itu_room` are not among them but one."""
LOW, HIGH = 0.1, 0.6
"""Range of a walk's height as shares of the room's."""
_TRIES = 40


def random_walk(scene: Scene, cycles: int, *, rng: np.random.Generator) -> Trajectory:
    """A walk of constant height and speed on an arc, clear of all surfaces, its heading along the motion.

    Raises
    ------
    SceneError
        The room is too full for one.
    """
    surfaces = np.concatenate([r.triangles for r in scene.reflectors])
    floor, ceiling = scene.bounds[:, 2]
    for _ in range(_TRIES):
        poses = random_poses(scene, 16, rng=rng, clearance=CLEARANCE)
        for start in poses.position:
            if floor + LOW * (ceiling - floor) < start[2] < floor + HIGH * (ceiling - floor):
                walk = _arc(scene, start, cycles, rng)
                if distance_to_triangles(walk.position, surfaces).min() > CLEARANCE:
                    return walk
    raise SceneError(f"{scene.name}: no room for a walk of {cycles} cycles; give fewer")


def random_version(scene: Scene, *, rng: np.random.Generator) -> Scene:
    """The same room with other walls (slabs of building materials every other time) and other scatterers' radii."""
    slabs = rng.uniform() < 0.5
    reflectors = tuple(replace(one, material=_material(slabs, rng)) for one in scene.reflectors)
    radii = np.exp(rng.uniform(np.log(RADIUS[0]), np.log(RADIUS[1]), size=len(scene.scatterers)))
    scatterers = tuple(
        replace(one, rcs=float(np.pi * radius**2), radius=float(radius), law="constant", height=None)
        for one, radius in zip(scene.scatterers, radii, strict=True)
    )
    return replace(scene, reflectors=reflectors, scatterers=scatterers)


def _material(slab: bool, rng: np.random.Generator) -> Material:
    if not slab:
        return Material(reflection=float(rng.uniform(*REFLECTION)))
    name = str(rng.choice(sorted(SLABS)))
    return Material(itu=name, thickness=SLABS[name] * float(rng.uniform(0.7, 1.4)))


def _arc(scene: Scene, start: Floats, cycles: int, rng: np.random.Generator) -> Trajectory:
    """Constant speed and rate of turn from a start."""
    time = CYCLE * np.arange(cycles, dtype=np.float64)
    speed, rate = rng.uniform(*SPEED), TURN_RATE * rng.standard_normal()
    heading = rng.uniform(-np.pi, np.pi) + rate * time
    velocity = speed * np.stack([np.cos(heading), np.sin(heading), np.zeros(cycles)], axis=1)
    steps: Floats = np.concatenate([np.zeros((1, 3)), 0.5 * CYCLE * (velocity[1:] + velocity[:-1])])
    turned = np.arctan2(np.sin(heading), np.cos(heading))
    return Trajectory(time, start + np.cumsum(steps, axis=0), velocity, turned, scene.agent.body)
