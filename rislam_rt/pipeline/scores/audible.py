"""Audible paths of a run: those above the detection threshold, and the walls that they meet, for its scores."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.model import PathKind, Paths
from rislam_rt.pipeline.specification.spec import Settings

HEARD = 2.0
"""[s] in all for which something must be audible to count as heard."""


def audible_paths(paths: Paths, settings: Settings) -> Booleans:
    """(K, P) which paths are above the detection threshold, on the side that the array hears.

    Wall returns count where the estimator uses them.
    """
    sensor = settings.sensor
    heard = paths.valid & (settings.radio.integrated_snr(paths.gain) >= sensor.threshold)
    heard &= sensor.in_window(paths.tau)
    if settings.radio.array.pattern == "upper":
        heard &= paths.arrival[..., 2] >= 0.0
    wanted = paths.landmark >= 0
    if settings.slam.use_vt:
        wanted |= paths.kind == PathKind.VT
    return np.asarray(heard & wanted)


def audible_planes(paths: Paths, audible: Booleans, group: Integers) -> Booleans:
    """(K, N) whether a path that is `audible` (K, P) meets each plane; `group` (W,) tells the plane of each wall."""
    over = np.zeros((paths.num_paths, int(group.max(initial=-1)) + 1), dtype=np.bool_)
    for path in range(paths.num_paths):
        _, _, tx, rx = paths.identity(path)
        over[path, group[[*tx, *rx]]] = True
    return np.asarray((audible.astype(np.int64) @ over) > 0)


def audible_seconds(audible: Booleans, time: Floats) -> Floats:
    """(N,) [s] for which each column of (K, N) was audible, in all, for scores; of one cycle, `HEARD` each."""
    step = float(np.median(np.diff(time))) if len(time) > 1 else HEARD
    return np.asarray(audible.sum(axis=0) * step)


def heard_long(audible: Booleans, time: Floats) -> Booleans:
    """Which columns of (K, N) count in a score: audible for `HEARD` seconds in all."""
    return np.asarray(audible_seconds(audible, time) >= HEARD - 1e-9)
