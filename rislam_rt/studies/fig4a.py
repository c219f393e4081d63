"""Fig. 4(a) of the paper: gain of the direct path over the panel against distance, beside that of a sphere."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design import DesignProblem, GainCurves, direct_only, gain_curves, problem_from_paths
from rislam_rt.design.gain_curves import GainInterval
from rislam_rt.errors import ConfigError
from rislam_rt.model import Paths, RadioConfig, RisPanel, Scatterer, Scene, Trajectory
from rislam_rt.model.ris import ElementPattern
from rislam_rt.pipeline.channels import build_channel
from rislam_rt.pipeline.specification.pipeline_spec import build_design
from rislam_rt.pipeline.specification.radio import build_radio
from rislam_rt.progress import Tell, tell_nobody
from rislam_rt.studies.spec import Fig4aSpec


class Fig4a(NamedTuple):
    """Curves of Fig. 4(a): panel gain against distance at K places, nearest place last, and that of a sphere."""

    position: Floats
    """(K, 3) [m] positions of the agent."""
    distance: Floats
    """(K,) [m] from the agent to the panel's centre."""
    levels: int
    """Number of phase levels of an element."""
    curves: Mapping[str, GainCurves]
    """Panel gains by element pattern."""
    sphere: Floats
    """(K,) gain of the path over the sphere [dB]."""
    radius: float
    """Radius of the sphere [m]."""


def check_fig4a(scene: Scene, spec: Fig4aSpec) -> None:
    """Check that the scene has the one RIS panel that Fig. 4(a) needs, and the agent starts farther than `closest_m`.

    Raises
    ------
    ConfigError
        The scene has no panel or several, or the agent starts too near to it.
    """
    reach = float(np.linalg.norm(lone_panel(scene).center[:2] - scene.agent.position[0, :2]))
    if spec.closest_m >= reach:
        raise ConfigError(f"closest_m: {spec.closest_m:g} received; the path starts {reach:.3g} m away, give less")


def lone_panel(scene: Scene) -> RisPanel:
    """The one RIS panel of a scene for Fig. 4(a).

    Raises
    ------
    ConfigError
        There is none, or there are several.
    """
    if not isinstance(scene.ris, RisPanel):
        count = len(scene.panels) or "no"
        raise ConfigError(f"scene: '{scene.name}' has {count} panels; give one that has one [ris] section")
    return scene.ris


def run_fig4a(scene: Scene, spec: Fig4aSpec, *, rng: np.random.Generator, progress: Tell = tell_nobody) -> Fig4a:
    """Compute Fig. 4(a): gain of the direct panel path at each place under designed, random and optimal phase codes.

    Raises
    ------
    ConfigError
        Scene and specification do not fit (`check_fig4a`), or panel or sphere is out of sight at a place.
    TraceError, SetupError
        The traced channel failed, or the machine lacks what it needs.
    """
    check_fig4a(scene, spec)
    panel = lone_panel(scene)
    radio, motion = build_radio(spec.radio), walk_to_panel(scene, spec.places, spec.closest_m)
    radius = spec.sphere_radius_m or 0.5 * longer_side(panel)
    steps = len(spec.elements) * spec.places
    progress("places", 0, steps)
    sphere = sphere_gain(scene, motion, radio, radius, spec.channel)
    curves: dict[str, GainCurves] = {}
    for number, element in enumerate(spec.elements):
        at_places = []
        problems = place_problems(scene, motion, radio, element, spec.channel)
        for place, (problem, child) in enumerate(zip(problems, rng.spawn(spec.places), strict=True), start=1):
            at_places.append(
                gain_curves(
                    [problem], rng=child, method=spec.design.method, seeds=spec.seeds, draws=spec.draws,
                    coverage=spec.coverage, config=build_design(spec.design),
                )
            )  # fmt: skip
            progress("places", number * spec.places + place, steps)
        curves[element] = _joined(at_places)
    distance = np.linalg.norm(motion.position - panel.center, axis=1)
    return Fig4a(motion.position, distance, panel.spec.levels, curves, sphere, radius)


def walk_to_panel(scene: Scene, places: int, closest: float) -> Trajectory:
    """Places for Fig. 4(a) on a straight, level line from the trajectory's start towards the RIS panel, to `closest`
    [m] from it."""
    start = scene.agent.position[0]
    way = np.append(lone_panel(scene).center[:2] - start[:2], 0.0)
    reach = float(np.linalg.norm(way))
    position = start + np.linspace(0.0, 1.0 - closest / reach, places)[:, None] * way
    heading = np.full(places, np.arctan2(way[1], way[0]))
    return Trajectory(np.arange(float(places)), position, np.zeros((places, 3)), heading, scene.agent.body)


def place_problems(
    scene: Scene, motion: Trajectory, radio: RadioConfig, element: ElementPattern, channel: str
) -> list[DesignProblem]:
    """Code design problem of the direct panel path at every place of Fig. 4(a), for one element pattern."""
    panel = lone_panel(scene)
    panel = replace(panel, spec=replace(panel.spec, element=element))
    paths = build_channel(channel, replace(scene, ris=panel), radio, 0).paths(motion)
    _check_seen(paths, scene.landmarks.index(panel.name), motion)
    return [
        direct_only(problem_from_paths(paths, motion.tx[k], motion.rx[k], radio, panel.spec.levels, cycle=k))
        for k in range(len(motion))
    ]


def sphere_gain(scene: Scene, motion: Trajectory, radio: RadioConfig, radius: float, channel: str) -> Floats:
    """Gain (K,) [dB] of the path over a sphere in the panel's place, which touches the panel's plane."""
    panel = lone_panel(scene)
    center = panel.center + radius * panel.spec.normal
    ball = Scatterer(panel.name, center, np.pi * radius**2, radius)
    changed = replace(scene, scatterers=(*scene.scatterers, ball), ris=None)
    paths = build_channel(channel, changed, radio, 0).paths(motion)
    column = _check_seen(paths, changed.landmarks.index(panel.name), motion)
    return 20.0 * np.log10(np.abs(paths.gain[:, column]))


def longer_side(panel: RisPanel) -> float:
    """Longer side [m] of the panel in Fig. 4(a), an element's own width included."""
    spec = panel.spec
    return max(spec.rows * float(spec.spacing[1]), spec.cols * float(spec.spacing[0]))


def _check_seen(paths: Paths, landmark: int, motion: Trajectory) -> int:
    """Column of a landmark's direct path; an error if it is hidden at some place of Fig. 4(a)."""
    column = int(np.flatnonzero(paths.landmark == landmark)[0])
    hidden = np.flatnonzero(~paths.valid[:, column])
    if len(hidden):
        at = ", ".join(f"{x:.2f}" for x in motion.position[hidden[0]])
        raise ConfigError(f"scene: no free line from ({at}) m to '{paths.landmarks[landmark]}'; give an open room")
    return column


def _joined(parts: list[GainCurves]) -> GainCurves:
    """Join the gain curves of single places of Fig. 4(a)."""
    optimized, random = (
        GainInterval(*np.concatenate([getattr(part, name) for part in parts], axis=1))
        for name in ("optimized", "random")
    )
    return GainCurves(
        optimized, random, np.concatenate([p.exact for p in parts]), np.concatenate([p.continuous for p in parts])
    )
