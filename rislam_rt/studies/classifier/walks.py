"""Random walks of the agent through a room and the panel's phase codes along them, for training the classifier."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.compare.channel_comparison import random_poses
from rislam_rt.design import focus_codes
from rislam_rt.errors import SceneError
from rislam_rt.geometry.triangles import distance_to_triangles
from rislam_rt.model import DataSheet, PathKind, Paths, RisCode, Scene, Trajectory
from rislam_rt.ris import rephase

CLEARANCE = 0.2
"""Least distance [m] of a walk from every surface."""
CYCLE = 0.1
"""Time [s] between cycles of a walk."""
SPEED, TURN_RATE = (0.05, 0.2), 0.15
"""Range of speeds [m/s], and standard deviation of the turn rate [rad/s], of random walks."""
LOW, HIGH = 0.1, 0.6
"""Range of a walk's height as shares of the room's height."""
_TRIES = 40


def random_walk(scene: Scene, cycles: int, *, rng: np.random.Generator) -> Trajectory:
    """Draw a trajectory of constant height and speed on an arc, clear of all surfaces, its heading along the motion.

    Raises
    ------
    SceneError
        No free one was found: the room is too full.
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


def _arc(scene: Scene, start: Floats, cycles: int, rng: np.random.Generator) -> Trajectory:
    """Walk on an arc from `start` (3,) [m] with random constant speed and turn rate."""
    time = CYCLE * np.arange(cycles, dtype=np.float64)
    speed, rate = rng.uniform(*SPEED), TURN_RATE * rng.standard_normal()
    heading = rng.uniform(-np.pi, np.pi) + rate * time
    velocity = speed * np.stack([np.cos(heading), np.sin(heading), np.zeros(cycles)], axis=1)
    steps: Floats = np.concatenate([np.zeros((1, 3)), 0.5 * CYCLE * (velocity[1:] + velocity[:-1])])
    turned = np.arctan2(np.sin(heading), np.cos(heading))
    return Trajectory(time, start + np.cumsum(steps, axis=0), velocity, turned, scene.agent.body)


POLICIES = ("random", "held", "aimed", "exact")
"""Code policies: a random code each cycle; one random code throughout; the best code for the direct panel path at the
middle of the walk, throughout; the best for that path in each cycle."""
AIMED = tuple(POLICIES.index(name) for name in ("aimed", "exact"))
"""Indices of the code policies that know where the agent is."""


def set_codes(paths: Paths, panel: DataSheet | None, policy: str, *, rng: np.random.Generator) -> Paths:
    """True paths of a walk with gains under the phase codes of a policy; unchanged without a RIS panel.

    Where no path over the panel is without walls, the policies that aim take one random code.
    """
    if panel is None or paths.ris is None:
        return paths
    shape = (paths.num_cycles, panel.rows, panel.cols)
    if policy in ("aimed", "exact") and np.any(paths.kind == PathKind.RIS):
        best = focus_codes(paths, panel.levels).index
        direct = np.flatnonzero(paths.valid[:, paths.kind == PathKind.RIS].any(axis=1))
        middle = direct[len(direct) // 2] if len(direct) else 0  # of the cycles with a direct panel path
        index = best if policy == "exact" else best[middle]
    else:
        index = rng.integers(panel.levels, size=shape if policy == "random" else shape[1:])
    return rephase(paths, RisCode(index, panel.levels))
