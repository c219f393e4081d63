"""The posterior bound of a scheme in a run: what no estimator could beat with the same room, codes and noise."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.channel.walls import build_walls
from rislam_rt.information import (
    LandmarkModel,
    LinearMeasurements,
    MotionPrior,
    WallSpread,
    assumed_std,
    build_landmark_model,
    fewer_rows,
    heard_paths,
    posterior_bound,
)
from rislam_rt.information.heard_paths import SILENT
from rislam_rt.measurement import build_sensor, expected_distortion
from rislam_rt.measurement.received import HORIZON_MARGIN
from rislam_rt.model import PathKind, Paths, Scene
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.specification.spec import PipelineSpec, Settings, build_settings

NO_ROWS = LinearMeasurements(np.zeros((0, 3)), np.zeros((0, 0)), np.zeros(0))
"""A cycle in which nothing is heard."""


class SchemeBound(NamedTuple):
    """Least RMS errors of one scheme in one run."""

    agent: Floats
    """(K,) position [m], over the axes that are filtered."""
    landmarks: Mapping[str, float]
    """[m] at the end of the run, of each landmark that a path was heard from."""
    walls: Mapping[str, WallSpread]
    """At the end of the run, of each wall that a counted path meets; its distance at the middle of its surface."""


class BoundProblem(NamedTuple):
    """What the recursion of a bound goes through: it can be run under several assumptions about motion and start."""

    rows: Sequence[LinearMeasurements]
    """(K,) measurements of each cycle."""
    model: LandmarkModel | None
    """None where nothing is heard."""
    unknown_std: Floats
    """(U,)."""
    motion: MotionPrior
    """What the scheme's filter takes for granted."""
    heard: frozenset[str]
    """Landmarks that a counted path comes from."""


def bound_problem(scene: Scene, paths: Paths, gain: Any, scheme: str, config: Mapping[str, Any]) -> BoundProblem:
    """What of a scheme in a run counts for its bound; see `scheme_bound`."""
    spec = PipelineSpec.model_validate(dict(config))
    settings = build_settings(spec)
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
    """Bound on the errors of a scheme: least RMS of agent, landmarks and walls.

    Linearised at the true motion, under the codes that were applied. Landmarks and walls are unknown, the start is
    known to its prior. A path that the array hears and whose delay is reported counts with its information times the
    probability of its detection (the information reduction factor of Niu, Willett and Bar-Shalom, 2001); which path
    each component is counts as known, and paths as resolved. A scheme of delays alone has no angles, and one that holds
    every mirror image as a point of its own has no walls. Of walls nothing is known beforehand but what the filter
    takes for granted (`information.assumed_std`).

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
    bound = posterior_bound(problem.rows, scene.agent.time, motion, problem.unknown_std)
    agent = bound.rms
    if model is None:
        return SchemeBound(agent, {}, {})
    landmarks = {name: error for name, error in model.landmark_error(bound.last).items() if name in problem.heard}
    walls = build_walls(scene)
    middle = np.array([walls.surface(number)[0] for number in range(len(walls))]).reshape(-1, 3)
    return SchemeBound(agent, landmarks, model.wall_error(bound.last, middle))


def over_distortion(paths: Paths, settings: Settings) -> Complexes:
    """Gains (K, P) for the bound, smaller by as much as the distortion that the estimator is told of exceeds the
    noise."""
    hardware, receiver, radio = settings.hardware, settings.receiver, settings.radio
    if not hardware.told:
        return paths.gain
    leakage = 10.0 ** (-receiver.leakage_cancellation_db / 20.0)
    direct = paths.kind == PathKind.LOS
    heard = np.where(direct, leakage, 1.0) * np.abs(paths.gain) * paths.valid
    if radio.array.pattern == "upper":
        heard = heard * (paths.arrival[..., 2] >= -HORIZON_MARGIN)
    power = np.sum(heard**2, axis=1)
    extra = expected_distortion(hardware, radio, receiver, power, np.sum(np.abs(paths.gain[:, direct]) ** 2, axis=1))
    return np.asarray(paths.gain * np.sqrt(radio.noise_psd / (radio.noise_psd + extra))[:, None])
