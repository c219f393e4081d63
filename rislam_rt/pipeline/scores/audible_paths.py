"""Audible paths of a run, those above the detection threshold, and the walls that reflect them, for the scores."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.model import PathKind, Paths, Scene
from rislam_rt.pipeline.specification.pipeline_spec import Settings

HEARD = 2.0
"""[s] Least total time for which a path or wall must be above the detection threshold to count in a score."""


def audible_paths(paths: Paths, settings: Settings, *, use_vt: bool) -> Booleans:
    """Which true paths (K, P) the receiver can detect: over the SNR threshold, in its window, from the array's front.

    The direct path does not count; wall returns (VT) do with `use_vt`, for an estimator that uses them.
    """
    sensor = settings.sensor
    heard = paths.valid & (settings.radio.integrated_snr(paths.gain) >= sensor.threshold)
    heard &= sensor.in_window(paths.tau) & settings.radio.array.receives(paths.arrival[..., 2])
    counted = paths.landmark >= 0
    if use_vt:
        counted |= paths.kind == PathKind.VT
    return np.asarray(heard & counted)


def audible_planes(paths: Paths, audible: Booleans, group: Integers) -> Booleans:
    """Whether an `audible` path (K, P) is reflected at each plane, (K, N); `group` (W,) is the plane of each wall."""
    over = np.zeros((paths.num_paths, int(group.max(initial=-1)) + 1), dtype=np.bool_)
    for path in range(paths.num_paths):
        _, _, tx, rx = paths.identity(path)
        over[path, group[[*tx, *rx]]] = True
    return np.asarray((audible.astype(np.int64) @ over) > 0)


def landmarks_audible(scene: Scene, paths: Paths, audible: Booleans) -> Booleans:
    """Whether an `audible` path (K, P) goes over each landmark of the scene, (K, N)."""
    of = paths.landmark[:, None] == np.arange(len(scene.landmarks))
    return np.asarray((audible.astype(np.int64) @ of) > 0)


def audible_seconds(audible: Booleans, time: Floats) -> Floats:
    """Total time (N,) [s] for which each path or plane was audible, from (K, N) cycles; a lone cycle counts `HEARD`."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else HEARD
    return np.asarray(audible.sum(axis=0) * step)


def heard_long(audible: Booleans, time: Floats) -> Booleans:
    """Which paths or planes (N,) count in a score: those of (K, N) that were audible for `HEARD` seconds in all."""
    return np.asarray(audible_seconds(audible, time) >= HEARD - 1e-9)
