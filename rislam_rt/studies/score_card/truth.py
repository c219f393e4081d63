"""The truth that a run is scored against: motion, landmarks, walls, when they are detectable, the bounds of the run."""

from typing import NamedTuple

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.channel.walls import build_walls
from rislam_rt.evaluate import Surfaces
from rislam_rt.model import Paths, Scene, SchemeResult
from rislam_rt.pipeline.scores.audible_paths import audible_paths, audible_planes, landmarks_audible
from rislam_rt.pipeline.scores.component_sources import uses_wall_returns
from rislam_rt.pipeline.scores.posterior_bound import true_motion_bounds
from rislam_rt.pipeline.scores.wall_scores import coplanar, wall_surfaces
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, build_settings


class Truth(NamedTuple):
    """True motion, landmarks, walls, paths and posterior bounds of a run, against which estimates are scored.

    K cycles, N landmarks, W planes, P paths, up to M components a cycle.
    """

    position: Floats
    """(K, 3) [m] true position of the agent."""
    velocity: Floats
    """(K, 3) [m/s] true velocity."""
    landmark: Floats
    """(N, 3) [m] true landmarks, the panel last if there is one."""
    panel: int
    """Number of panels."""
    landmark_audible: Booleans
    """(K, N) whether a path over the landmark is above the detection threshold."""
    wall_middle: Floats
    """(W, 3) [m] centroid of each plane's surface; walls in one plane are one."""
    wall_normal: Floats
    """(W, 3) unit normal of each plane."""
    wall_spread: Floats
    """(W, 3, 3) [m^2] covariance of the points of each plane's surface."""
    wall_audible: Booleans
    """(K, W) whether a path over the plane is above the detection threshold."""
    path_kind: Integers
    """(P,) `PathKind` of each path."""
    path_landmark: Integers
    """(P,) landmark of each path, -1 for LOS and VT."""
    component_path: Integers
    """(K, M) path of each component, -1 clutter, -9 beyond their number."""
    bound: Floats
    """(K,) [m] posterior bound on the RMS position error."""
    relative_bound: Floats
    """(K,) [m] the same relative to the start, which then has no error."""

    def __repr__(self) -> str:
        panels = f"{self.panel} panel" if self.panel == 1 else f"{self.panel or 'no'} panels"
        counts = f"{len(self.landmark)} landmarks ({panels} among them), {len(self.wall_middle)} walls"
        return f"Truth: {len(self.position)} cycles, {counts}, {len(self.path_kind)} paths"

    def walls(self, shift: Floats) -> Surfaces:
        """Surfaces of the true walls of a room, moved by `shift` (3,) [m]."""
        return Surfaces(self.wall_middle + shift, self.wall_normal, self.wall_spread)


def build_truth(scene: Scene, paths: Paths, result: SchemeResult, spec: PipelineSpec) -> Truth:
    """Truth of one scheme's run for scoring, with detectability and bounds under the phase codes that it applied."""
    settings, walls = build_settings(spec, len(scene.panels) if result.levels else 0), build_walls(scene)
    audible = audible_paths(paths.with_gain(result.gain), settings, use_vt=uses_wall_returns(result.scheme, settings))
    group = coplanar(walls)
    surfaces = wall_surfaces(walls, group)
    bound, relative = true_motion_bounds(scene, paths, result.gain, result.scheme, spec.model_dump(mode="json"))
    return Truth(
        scene.agent.position, scene.agent.velocity, scene.landmark_positions, len(scene.panels),
        landmarks_audible(scene, paths, audible), *surfaces, audible_planes(paths, audible, group), paths.kind,
        paths.landmark, result.component_path, bound, relative,
    )  # fmt: skip
