"""The truth that a run's score is measured against: motion, landmarks, walls, when each could be heard, the bounds."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.walls import build_walls
from rislam_rt.evaluate import Surfaces, root_mean_square
from rislam_rt.information import posterior_bound
from rislam_rt.model import Paths, Scene, SchemeResult
from rislam_rt.pipeline.scores.audible import audible_paths, audible_planes
from rislam_rt.pipeline.scores.bound import bound_problem
from rislam_rt.pipeline.scores.walls import coplanar, wall_surfaces
from rislam_rt.pipeline.specification.spec import PipelineSpec, build_settings


class Truth(NamedTuple):
    """K cycles, N landmarks, W planes, P paths, up to M components a cycle."""

    position: Floats
    """(K, 3) [m]."""
    velocity: Floats
    """(K, 3) [m/s]."""
    landmark: Floats
    """(N, 3) [m], the panel last if there is one."""
    panel: bool
    landmark_audible: Booleans
    """(K, N) whether one of its paths is above the detection threshold."""
    wall_middle: Floats
    """(W, 3) [m] centroid of each plane's surface; walls in one plane are one."""
    wall_normal: Floats
    """(W, 3)."""
    wall_spread: Floats
    """(W, 3, 3) [m^2] covariance of the points of its surface."""
    wall_audible: Booleans
    """(K, W) whether a path over it is above the threshold."""
    path_kind: Integers
    """(P,)."""
    path_landmark: Integers
    """(P,)."""
    component_path: Integers
    """(K, M) path of each component, -1 clutter, -9 beyond their number."""
    bound: Floats
    """(K,) least RMS position error [m]."""
    relative_bound: Floats
    """(K,) the same of the position relative to the start: the start taken as the origin."""

    def walls(self, shift: Floats) -> Surfaces:
        """The walls, moved by `shift` (3,) [m]."""
        return Surfaces(self.wall_middle + shift, self.wall_normal, self.wall_spread)


def build_truth(scene: Scene, paths: Paths, result: SchemeResult, spec: PipelineSpec) -> Truth:
    """The truth of one scheme in one run, under the codes that it applied."""
    settings, walls = build_settings(spec), build_walls(scene)
    audible = audible_paths(paths.with_gain(result.gain), settings)
    group = coplanar(walls)
    surfaces = wall_surfaces(walls, group)
    of = paths.landmark[:, None] == np.arange(len(scene.landmarks))
    bound, relative = run_bounds(scene, paths, result, spec)
    return Truth(
        scene.agent.position,
        scene.agent.velocity,
        scene.landmark_positions,
        scene.ris is not None,
        (audible[:, :, None] & of).any(axis=1),
        *surfaces,
        audible_planes(paths, audible, group),
        paths.kind,
        paths.landmark,
        result.component_path,
        bound,
        relative,
    )


def run_bounds(scene: Scene, paths: Paths, result: SchemeResult, spec: PipelineSpec) -> tuple[Floats, Floats]:
    """Bounds to hold a run against: least RMS position errors (K,) [m], absolute, and relative to the start.

    The motion's law is white acceleration of the root mean squares that this motion truly has, across and upwards, so
    that a lively one has a looser bound; what a filter is told of it does not count. Nobody is told the height after
    the start: that of an agent that climbs is not known. No measurement of an unknown room tells where it lies:
    relative to the start is what remains when the start is known exactly.
    """
    problem = bound_problem(scene, paths, result.gain, result.scheme, spec.model_dump(mode="json"))
    axes, time = problem.motion.axes, scene.agent.time
    push = np.diff(scene.agent.velocity, axis=0) / np.diff(time)[:, None]
    motion = problem.motion
    if len(push):
        motion = replace(motion, acceleration=root_mean_square(push[:, :axes]))
    if len(push) and axes == 2:
        motion = replace(motion, axes=3, climb=root_mean_square(push[:, 2]))
    found = [
        posterior_bound(problem.rows, time, law, problem.unknown_std).rms
        for law in (motion, replace(motion, start_position=0.0))
    ]
    return found[0], found[1]
