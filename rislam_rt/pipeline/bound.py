"""The posterior bound of a scheme in a run: what no estimator could beat with the same room, codes and noise."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import repeat
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.channel.walls import build_walls
from rislam_rt.information import MotionPrior, Rows, build_landmark_model, posterior_bound
from rislam_rt.measurement.bound import detection_probability
from rislam_rt.measurement.false_alarms import detection_threshold
from rislam_rt.model import PathKind, Paths, Scene
from rislam_rt.pipeline.estimators import ESTIMATORS
from rislam_rt.pipeline.schemes import SCHEMES
from rislam_rt.pipeline.spec import PipelineSpec, Settings, build_settings

SILENT = 1e-4
"""Information over that at the detection threshold below which a path counts as not heard."""
NO_ROWS = Rows(np.zeros((0, 3)), np.zeros((0, 0)), np.zeros(0))
"""A cycle in which nothing is heard."""


def scheme_bound(scene: Scene, paths: Paths, gain: Any, scheme: str, config: Mapping[str, Any]) -> Floats:
    """Least RMS position error (K,) [m] of a scheme, over the axes that are filtered.

    Linearised at the true motion, under the codes that were applied. Landmarks and walls are unknown, the start is
    known to its prior. A path that the array hears and whose delay is reported counts with its information times the
    probability of its detection (the information reduction factor of Niu, Willett and Bar-Shalom, 2001); which path
    each component is counts as known, and paths as resolved. A scheme of delays alone has no angles, and one that holds
    every mirror image as a point of its own has no walls.

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
        rows = map(fewer_rows, model.rows(SILENT * threshold, angles=estimator.angles, use_vt=use_vt))
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
    """The columns that are reported in some cycle, with their gains times the root of the detection probability.

    Information is proportional to the SNR, so that it comes out times that probability.
    """
    snr = settings.radio.integrated_snr(paths.gain)
    detected = _detected(snr, threshold)
    heard = paths.valid & (snr * detected >= SILENT * threshold)
    heard &= (paths.tau >= settings.receiver.min_delay) & (paths.tau <= settings.receiver.max_delay)
    if settings.radio.array.pattern == "upper":
        heard &= paths.arrival[..., 2] >= 0.0
    wanted = paths.landmark >= 0
    if use_vt:
        wanted |= paths.kind == PathKind.VT
    kept = heard.any(axis=0) & wanted
    gain = np.where(heard, paths.gain * np.sqrt(detected), 0.0)[:, kept]
    identity = {
        name: getattr(paths, name)[kept] for name in ("kind", "landmark", "tx_walls", "rx_walls", "num_vertices")
    }
    course = {name: getattr(paths, name)[:, kept] for name in ("valid", "tau", "departure", "arrival", "vertices")}
    return replace(paths, **identity, **course, gain=gain, ris=None)


def _detected(snr: Floats, threshold: float) -> Floats:
    """Probability of detection, read off a table over 40 dB about the threshold: 0 below it, 1 above."""
    decibel = np.linspace(-20.0, 20.0, 401)
    table = detection_probability(threshold * 10.0 ** (decibel / 10.0), threshold)
    with np.errstate(divide="ignore"):
        return np.interp(10.0 * np.log10(snr / threshold), decibel, table, left=0.0, right=1.0)
