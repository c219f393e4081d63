"""The posterior bound of a scheme in a run: what no estimator could beat with the same room, codes and noise."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import repeat
from typing import Any

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.channel.walls import build_walls
from rislam_rt.information import MotionPrior, Rows, build_landmark_model, posterior_bound
from rislam_rt.measurement.false_alarms import detection_threshold
from rislam_rt.model import PathKind, Paths, Scene
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.spec import PipelineSpec, Settings, build_settings

NO_ROWS = Rows(np.zeros((0, 3)), np.zeros((0, 0)), np.zeros(0))
"""A cycle in which nothing is heard."""


def scheme_bound(scene: Scene, paths: Paths, gain: Any, scheme: str, config: Mapping[str, Any]) -> Floats:
    """Least RMS position error (K,) [m] of a scheme, over the axes that are filtered.

    Linearised at the true motion, under the codes that were applied. Landmarks and walls are unknown, the start is
    known to its prior. A path counts when its SNR exceeds the detection threshold, the array hears it and its delay is
    reported; which path each component is counts as known, and paths as resolved. A scheme of delays alone has no
    angles, and one that holds every mirror image as a point of its own has no walls.

    Parameters
    ----------
    paths
        True paths along `scene.agent`.
    gain
        (K, P) under the applied codes.
    config
        The run's specification, as a result holds it.
    """
    spec = PipelineSpec.model_validate(dict(config))
    settings = build_settings(spec)
    estimator, walls = ESTIMATORS[SCHEMES[scheme].estimator], build_walls(scene)
    threshold = detection_threshold(settings.radio, settings.receiver)
    axes = 3 if settings.slam.height == "estimated" else 2
    use_vt = settings.slam.use_vt and estimator.walls == "planes"
    audible = heard_paths(paths.with_gain(gain), settings, threshold, use_vt=use_vt)
    motion = MotionPrior(settings.slam.sigma_a, spec.start.position_std_m, spec.start.velocity_std_m_s, axes)
    unknown_std = np.zeros(0)
    rows: Iterable[Rows] = repeat(NO_ROWS, len(scene.agent))
    if audible.num_paths:
        model = build_landmark_model(
            audible, scene.agent, scene.landmark_positions, walls.normal, walls.offset, settings.radio,
            walls=estimator.walls,
        )  # fmt: skip
        rows = map(fewer_rows, model.rows(threshold, angles=estimator.angles, use_vt=use_vt))
        unknown_std = model.prior_std()
    bound = posterior_bound(rows, scene.agent.time, motion, unknown_std)
    return np.asarray(np.sqrt(np.einsum("kii->k", bound.agent[:, :axes, :axes])))


def fewer_rows(rows: Rows) -> Rows:
    """At most as many measurements as there are unknowns, with the same information: the factor R of a QR."""
    weighted = np.sqrt(rows.information)[:, None] * np.concatenate([rows.agent, rows.unknown], axis=1)
    if len(weighted) <= weighted.shape[1]:
        return rows
    factor = np.asarray(np.linalg.qr(weighted, mode="r"))
    return Rows(factor[:, :3], factor[:, 3:], np.ones(len(factor)))


def heard_paths(paths: Paths, settings: Settings, threshold: float, *, use_vt: bool) -> Paths:
    """The columns that are reported in some cycle, with zero gain where they are not."""
    heard = paths.valid & (settings.radio.integrated_snr(paths.gain) >= threshold)
    heard &= (paths.tau >= settings.receiver.min_delay) & (paths.tau <= settings.receiver.max_delay)
    if settings.radio.array.pattern == "upper":
        heard &= paths.arrival[..., 2] >= 0.0
    wanted = paths.landmark >= 0
    if use_vt:
        wanted |= paths.kind == PathKind.VT
    return _columns(paths, heard, heard.any(axis=0) & wanted)


def _columns(paths: Paths, heard: Booleans, kept: Booleans) -> Paths:
    """Some of the paths, silent where they are not heard."""
    identity = {
        name: getattr(paths, name)[kept] for name in ("kind", "landmark", "tx_walls", "rx_walls", "num_vertices")
    }
    course = {name: getattr(paths, name)[:, kept] for name in ("valid", "tau", "departure", "arrival", "vertices")}
    gain = np.where(heard, paths.gain, 0.0)[:, kept]
    return replace(paths, **identity, **course, gain=gain, ris=None)
