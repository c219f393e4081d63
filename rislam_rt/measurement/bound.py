"""The bound-driven receiver: what an efficient estimator would report, without making the signal.

A path's complex amplitude is measured with the variance N0 / (L E) of the matched filter over the signal and all L
antennas; it is detected when the measured SNR exceeds the threshold, which makes the detection probability the
Marcum Q function of a noncentral chi-square detector. Delay and cosines err as the Cramér-Rao bound says.
"""

from typing import NamedTuple

import numpy as np
from scipy.stats import ncx2

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.information import amplitude_std, measurement_std
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.received import Received
from rislam_rt.model import Measurement, PathTruth, RadioConfig

DISC_STD = 0.5
"""Standard deviation of each coordinate of a point spread evenly over the unit disc: what is known of a direction
cosine along which the array has no aperture."""

NEGLIGIBLE = 1e-3
"""Paths this far below the detection threshold are left out: they move an amplitude at the threshold by 3 %."""


class Components(NamedTuple):
    """N components of one cycle before noise: single paths, or several in one resolution cell."""

    path: Integers
    """(N,) column of the strongest path."""
    tau: Floats
    """(N,) [s]."""
    cosines: Floats
    """(N, 2) body frame."""
    gain: Complexes
    """(N,)."""
    from_panel: Booleans
    """(N,)."""


def path_std(snr: Floats, radio: RadioConfig) -> tuple[Floats, Floats]:
    """Bounds of a lone path: standard deviations of the delay (...,) [s] and the cosines (..., 2).

    `information.measurement_std` at the linear SNR over all L antennas, but no cosine is less certain than `DISC_STD`.
    """
    bound = measurement_std(snr, radio)
    return bound.tau, np.minimum(bound.cosines, DISC_STD)


def detection_probability(snr: Floats, threshold: float) -> Floats:
    """Probability that the measured SNR of a path exceeds the threshold; both linear, over all antennas.

    Marcum's `Q_1(sqrt(2 snr), sqrt(2 threshold))`; `exp(-threshold)` for noise alone.
    """
    return np.asarray(ncx2.sf(2.0 * threshold, 2, 2.0 * np.asarray(snr, dtype=np.float64)))


def measure_bound(
    received: Received, radio: RadioConfig, config: ReceiverConfig, num_paths: int, *, rng: np.random.Generator
) -> tuple[Measurement, PathTruth]:
    """Components with bound-driven errors, missed detections, merging and clutter, in the order of their delays.

    Components in one resolution cell come out as one (`merge`). The errors have the variance that belongs to the true
    SNR; the standard deviations reported are those that the measured one suggests, all that a receiver knows.
    Each of the `num_paths` columns has its own draws whether heard or not, so that two codes see the same noise.
    """
    draws = rng.standard_normal((num_paths, 5))
    received = _audible(received, radio.integrated_snr(received.gain) > NEGLIGIBLE * config.detection_threshold)
    parts = merge(received, radio, config.alternation) if config.merge else _single(received)
    noise = draws[parts.path]
    gain = parts.gain + amplitude_std(radio) * (noise[:, 0] + 1j * noise[:, 1])
    tau_std, cosines_std = path_std(radio.integrated_snr(parts.gain), radio)
    tau = parts.tau + tau_std * noise[:, 2]
    cosines = _blind_axes(parts.cosines + cosines_std * noise[:, 3:], radio)
    seen = radio.integrated_snr(gain) > config.detection_threshold
    seen &= (tau >= config.min_delay) & (tau <= config.max_delay)
    clutter = _clutter(radio, config, rng)
    path = np.concatenate([parts.path[seen], np.full(len(clutter.tau), -1)])
    tau = np.concatenate([tau[seen], clutter.tau])
    cosines = np.concatenate([cosines[seen], clutter.cosines])
    amplitude = np.abs(np.concatenate([gain[seen], clutter.gain]))
    from_panel = np.concatenate([parts.from_panel[seen], clutter.from_panel])
    order = np.argsort(tau)
    reported = path_std(radio.integrated_snr(amplitude[order]), radio)
    measurement = Measurement(
        tau[order],
        into_disc(cosines[order]),
        amplitude[order],
        *reported,
        np.full(len(order), amplitude_std(radio)),
        from_panel[order] if config.alternation else None,
    )
    return measurement, PathTruth(path[order])


def merge(received: Received, radio: RadioConfig, alternation: bool) -> Components:
    """Join paths closer than 1/B in delay and within the array's beam, from the strongest down.

    The joint gain is the sum. Delay and cosines are those at which one path fits the sum best, to first order
    `Re sum_i alpha_i conj(alpha) tau_i / |alpha|^2`, kept between the members' own.
    """
    if not len(received.tau):
        return _single(received)
    tau, cosines = received.tau, received.direction[:, :2]
    cell = np.abs(tau[:, None] - tau) * radio.bandwidth < 1.0
    for axis, count in enumerate((radio.array.rows, radio.array.cols)):
        beam = 1.0 / (count * radio.array.spacing) if count > 1 else np.inf
        cell &= np.abs(cosines[:, None, axis] - cosines[:, axis]) < beam
    if alternation:
        cell &= received.from_panel[:, None] == received.from_panel
    leader = _leaders(np.abs(received.gain), cell)
    order = np.argsort(leader, kind="stable")
    rows, start = np.unique(leader[order], return_index=True)
    gain = np.add.reduceat(received.gain[order], start)
    points = np.column_stack([tau, cosines])[order]
    weight = np.real(received.gain[order] * np.conj(np.repeat(gain, np.diff(start, append=len(order)))))
    joint = np.add.reduceat(weight[:, None] * points, start) / np.maximum(np.abs(gain) ** 2, 1e-300)[:, None]
    joint = np.clip(joint, np.minimum.reduceat(points, start), np.maximum.reduceat(points, start))
    return Components(received.path[rows], joint[:, 0], joint[:, 1:], gain, received.from_panel[rows])


def into_disc(cosines: Floats) -> Floats:
    """Cosines (..., 2) brought radially into the unit disc, where directions are."""
    length = np.linalg.norm(cosines, axis=-1, keepdims=True)
    return cosines / np.maximum(length, 1.0)


def _audible(received: Received, keep: Booleans) -> Received:
    path, tau, direction, gain, from_panel = received
    return Received(path[keep], tau[keep], direction[keep], gain[keep], from_panel[keep])


def _single(received: Received) -> Components:
    return Components(received.path, received.tau, received.direction[:, :2], received.gain, received.from_panel)


def _leaders(strength: Floats, cell: Booleans) -> Integers:
    """(N,) for each path the strongest free path of its cell, taken from the strongest down."""
    leader = np.full(len(strength), -1)
    for row in np.argsort(-strength, kind="stable"):
        if leader[row] < 0:
            leader[cell[row] & (leader < 0)] = row
    return leader


def _blind_axes(cosines: Floats, radio: RadioConfig) -> Floats:
    """Zero along which the array has no aperture: nothing is measured there."""
    return cosines * (np.array([radio.array.rows, radio.array.cols]) > 1)


def _clutter(radio: RadioConfig, config: ReceiverConfig, rng: np.random.Generator) -> Components:
    """Poisson many, even over the delay window and the hemisphere; amplitudes as of noise above the threshold."""
    count = rng.poisson(config.clutter_rate)
    tau = rng.uniform(config.min_delay, config.max_delay, count)
    radius, azimuth = np.sqrt(1.0 - rng.uniform(size=count) ** 2), rng.uniform(-np.pi, np.pi, count)
    cosines = _blind_axes(np.column_stack([radius * np.cos(azimuth), radius * np.sin(azimuth)]), radio)
    snr = config.detection_threshold + rng.exponential(size=count)
    gain = np.sqrt(snr * radio.noise_psd / (radio.array.num_antennas * radio.energy)).astype(np.complex128)
    return Components(np.full(count, -1), tau, cosines, gain, rng.uniform(size=count) < 0.5)
