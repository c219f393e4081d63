"""Heard paths: those that a receiver detects in some cycle, their information times the detection probability."""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import PathKind, Paths, SensorModel, detection_probability

SILENT = 1e-4
"""Expected information, relative to that at the detection threshold, below which a path counts as never detected."""


def heard_paths(paths: Paths, sensor: SensorModel, *, use_vt: bool) -> Paths:
    """Select the paths that a receiver detects in some cycle, with gains times the root of the detection probability.

    Information is proportional to the SNR, so that it is multiplied by that probability.
    """
    snr = sensor.radio.integrated_snr(paths.gain)
    detected = _detected(snr, sensor.threshold)
    heard = paths.valid & (snr * detected >= SILENT * sensor.threshold)
    heard &= sensor.in_window(paths.tau) & sensor.radio.array.receives(paths.arrival[..., 2])
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
    """Probability that a path is heard at linear SNRs, by a table over 40 dB about the threshold; 0 below, 1 above."""
    decibel = np.linspace(-20.0, 20.0, 401)
    table = detection_probability(threshold * 10.0 ** (decibel / 10.0), threshold)
    with np.errstate(divide="ignore"):
        return np.interp(10.0 * np.log10(snr / threshold), decibel, table, left=0.0, right=1.0)
