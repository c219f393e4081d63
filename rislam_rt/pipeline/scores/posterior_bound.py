"""The posterior Cramér-Rao bound of a scheme in a run: the least errors possible with its room, codes and noise."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.channel.walls import build_walls
from rislam_rt.evaluate import root_mean_square
from rislam_rt.information import (
    LandmarkModel,
    LinearMeasurements,
    MotionPrior,
    PosteriorBound,
    WallSpread,
    assumed_std,
    build_landmark_model,
    fewer_rows,
    heard_paths,
    posterior_bound,
)
from rislam_rt.information.heard_paths import SILENT
from rislam_rt.measurement import build_sensor, expected_distortion
from rislam_rt.measurement.received_paths import HORIZON_MARGIN
from rislam_rt.model import PathKind, Paths, Scene
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.specification.pipeline_spec import PipelineSpec, Settings, build_settings

NO_ROWS = LinearMeasurements(np.zeros((0, 3)), np.zeros((0, 0)), np.zeros(0))
"""Linear measurements of a cycle in which no path is detected."""


class SchemeBound(NamedTuple):
    """Posterior bounds on the RMS errors of agent, landmarks and walls of one scheme in one run."""

    agent: Floats
    """(K,) [m] bound on the position error, over the axes that are filtered."""
    relative: Floats
    """(K,) [m] the same relative to the start, which then has no error."""
    landmarks: Mapping[str, float]
    """[m] Bound on the position error at the end of the run, of each landmark that a path was detected from."""
    walls: Mapping[str, WallSpread]
    """Bounds on angle and distance at the end of the run, of each wall that reflects a counted path.

    The distance is that at the middle of the wall's surface."""


class BoundProblem(NamedTuple):
    """Inputs of a posterior bound's recursion: linearised measurements, unknowns of the map, priors of map and motion.

    The recursion can be run under several assumptions about motion and start.
    """

    rows: Sequence[LinearMeasurements]
    """(K,) linearised measurements of each cycle."""
    model: LandmarkModel | None
    """Unknowns of the map; None where no path is detected."""
    unknown_std: Floats
    """(U,) prior standard deviations of the map's unknowns."""
    motion: MotionPrior
    """Motion model and start prior, as the scheme's filter assumes them."""
    heard: frozenset[str]
    """Names of landmarks that a counted path comes from."""


def bound_problem(scene: Scene, paths: Paths, gain: Any, scheme: str, config: Mapping[str, Any]) -> BoundProblem:
    """Linearise the detectable paths of a scheme's run for the recursion of its posterior bound; see `scheme_bound`."""
    spec = PipelineSpec.model_validate(dict(config))
    settings = build_settings(spec, len(scene.panels) if SCHEMES[scheme].panel else 0)
    estimator, walls = ESTIMATORS[SCHEMES[scheme].estimator], build_walls(scene)
    sensor = build_sensor(settings.radio, settings.receiver)
    axes = 3 if settings.slam.height == "estimated" else 2
    use_vt = settings.slam.use_vt and estimator.walls == "planes"
    lit = paths.with_gain(gain)
    audible = heard_paths(lit.with_gain(over_distortion(lit, settings)), sensor, use_vt=use_vt)
    motion = MotionPrior(settings.slam.sigma_a, spec.start.position_std_m, spec.start.velocity_std_m_s, axes)
    if not audible.num_paths:
        return BoundProblem(len(scene.agent) * [NO_ROWS], None, np.zeros(0), motion, frozenset())
    model = build_landmark_model(
        audible, scene.agent, scene.landmark_positions, walls.normal, walls.offset, settings.radio,
        walls=estimator.walls,
    )  # fmt: skip
    rows = [fewer_rows(r) for r in model.rows(SILENT * sensor.threshold, angles=estimator.angles, use_vt=use_vt)]
    heard = frozenset(scene.landmarks[number] for number in audible.landmark if number >= 0)
    return BoundProblem(
        rows, model, assumed_std(model, float(scene.agent.position[:, 2].min()), upright=use_vt), motion, heard
    )


def scheme_bound(scene: Scene, paths: Paths, gain: Any, scheme: str, config: Mapping[str, Any]) -> SchemeBound:
    """Posterior Cramér-Rao bound on the RMS errors of agent, landmarks and walls of one scheme in one run.

    Linearised at the true motion, under the codes that were applied. Landmarks and walls are unknown, the start is
    known to its prior. A path from the array's front within the delay window counts with its information times its
    detection probability (the information reduction factor of Niu, Willett and Bar-Shalom, 2001); data association
    counts as known, and paths as resolved. A scheme that uses delays alone has no angles, and one that maps every
    mirror image as a point has no walls. The prior of walls is the filter's (`information.assumed_std`).

    Parameters
    ----------
    paths
        True paths along `scene.agent`.
    gain
        (K, P) under the applied codes.
    config
        The run's specification, as a result holds it.
    """
    problem = bound_problem(scene, paths, gain, scheme, config)
    model, motion = problem.model, problem.motion
    bound, from_start = bounds_of_motion(problem, scene.agent.time, motion)
    if model is None:
        return SchemeBound(bound.rms, from_start.rms, {}, {})
    landmarks = {name: error for name, error in model.landmark_error(bound.last).items() if name in problem.heard}
    walls = build_walls(scene)
    middle = np.array([walls.surface(number)[0] for number in range(len(walls))]).reshape(-1, 3)
    return SchemeBound(bound.rms, from_start.rms, landmarks, model.wall_error(bound.last, middle))


def bounds_of_motion(
    problem: BoundProblem, time: Floats, motion: MotionPrior
) -> tuple[PosteriorBound, PosteriorBound]:  # fmt: skip
    """Posterior bounds of a run under a prior of the motion, over the cycles at `time` (K,) [s]: absolute, and relative
    to the start. In an unknown room no measurement tells the absolute position: the latter is with the start known
    exactly."""
    return (
        posterior_bound(problem.rows, time, motion, problem.unknown_std),
        posterior_bound(problem.rows, time, replace(motion, start_position=0.0), problem.unknown_std),
    )


def over_distortion(paths: Paths, settings: Settings) -> Complexes:
    """Gains (K, P) of paths for the posterior bound, reduced so that the SNR counts hardware distortion as noise.

    Unchanged where the estimator is not told of the distortion (`hardware.told`).
    """
    hardware, receiver, radio = settings.hardware, settings.receiver, settings.radio
    if not hardware.told:
        return paths.gain
    leakage = 10.0 ** (-receiver.leakage_cancellation_db / 20.0)
    direct = paths.kind == PathKind.LOS
    there = paths.valid & radio.array.receives(paths.arrival[..., 2], HORIZON_MARGIN)
    heard = np.where(direct, leakage, 1.0) * np.abs(paths.gain) * there
    power = np.sum(heard**2, axis=1)
    extra = expected_distortion(hardware, radio, receiver, power, np.sum(np.abs(paths.gain[:, direct]) ** 2, axis=1))
    return np.asarray(paths.gain * np.sqrt(radio.noise_psd / (radio.noise_psd + extra))[:, None])


def true_motion_bounds(
    scene: Scene, paths: Paths, gain: Any, scheme: str, config: Mapping[str, Any]
) -> tuple[Floats, Floats]:
    """Posterior bounds on the RMS position errors (K,) [m] of a scheme's run under the motion as it truly is, absolute,
    and relative to the start.

    The motion model is white acceleration with the RMS that the true motion has, horizontally and vertically, whatever
    a filter assumes. The height after the start is not known if the agent climbs.
    """
    problem = bound_problem(scene, paths, gain, scheme, config)
    axes, time = problem.motion.axes, scene.agent.time
    push = np.diff(scene.agent.velocity, axis=0) / np.diff(time)[:, None]
    motion = problem.motion
    if len(push):
        motion = replace(motion, acceleration=root_mean_square(push[:, :axes]))
    if len(push) and axes == 2:
        motion = replace(motion, axes=3, climb=root_mean_square(push[:, 2]))
    bound, relative = bounds_of_motion(problem, time, motion)
    return bound.rms, relative.rms
