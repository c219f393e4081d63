"""Multipath components before noise, of one path or of several unresolved ones, and the errors of a lone one."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.information import amplitude_std, measurement_std
from rislam_rt.measurement.received_paths import Received
from rislam_rt.model import RadioConfig, SensorModel

DISC_STD = 0.5
"""Standard deviation of each coordinate of a point spread evenly over the unit disc: what is known of a direction
cosine along which the array has no aperture."""


class NoiselessComponents(NamedTuple):
    """N multipath components of one cycle before noise, each of one path or of several that cannot be resolved."""

    path: Integers
    """(N,) column of the strongest path."""
    tau: Floats
    """(N,) [s] delay."""
    cosines: Floats
    """(N, 2) direction cosines in the body frame."""
    gain: Complexes
    """(N,) complex gain."""


class ComponentErrors(NamedTuple):
    """Errors of N multipath components, drawn by the Cramér-Rao bound, and their standard deviations."""

    error: Floats
    """(N, 3) errors of delay [s] and cosines, drawn."""
    deviation: Floats
    """(N, 3) standard deviations of delay [s] and cosines."""
    gain_std: Floats
    """(N,) standard deviation of the complex gain."""


class ReportedComponents(NamedTuple):
    """N multipath components as the receiver reports them, false ones included."""

    path: Integers
    """(N,) column of the strongest path, -1 for a false one."""
    points: Floats
    """(N, 3) delay [s] and cosines."""
    deviation: Floats
    """(N, 3) standard deviations of delay [s] and cosines."""
    gain: Complexes
    """(N,) complex gain."""
    gain_std: Floats
    """(N,) standard deviation of the complex gain."""
    capture: Integers
    """(N,) 0 for the sum of alternated codes, 1 + q for the difference of panel q."""


def path_std(snr: Floats, radio: RadioConfig) -> tuple[Floats, Floats]:
    """Standard deviations of a lone path's component by its Cramér-Rao bound: delay (...,) [s] and cosines (..., 2).

    `information.measurement_std` at the linear SNR over all L antennas, but no cosine is less certain than `DISC_STD`.
    """
    bound = measurement_std(snr, radio)
    return bound.tau, np.minimum(bound.cosines, DISC_STD)


def merge(received: Received, sensor: SensorModel) -> NoiselessComponents:
    """Merge paths of one capture closer than a resolution cell into multipath components, from the strongest down."""
    cell = np.ones((len(received.tau), len(received.tau)), dtype=bool)
    for value in in_resolution_cells(
        received, sensor.radio
    ).T:  # axis by axis: half the time of one three-dimensional array
        cell &= np.abs(np.subtract.outer(value, value)) < 1.0
    return join(received, _leaders(np.abs(received.gain), cell))


def join(received: Received, leader: Integers) -> NoiselessComponents:
    """Sum the paths of the same leader (N,), a row of `received`, to one multipath component each.

    The joint gain is the sum. Delay and cosines are those at which one path fits the sum best, to first order
    `Re sum_i alpha_i conj(alpha) tau_i / |alpha|^2`, kept between the members' own.
    """
    if not len(leader):
        return single(received)
    order = np.argsort(leader, kind="stable")
    rows, start = np.unique(leader[order], return_index=True)
    gain = np.add.reduceat(received.gain[order], start)
    points = np.column_stack([received.tau, received.direction[:, :2]])[order]
    weight = np.real(received.gain[order] * np.conj(np.repeat(gain, np.diff(start, append=len(order)))))
    joint = np.add.reduceat(weight[:, None] * points, start) / np.maximum(np.abs(gain) ** 2, 1e-300)[:, None]
    joint = np.clip(joint, np.minimum.reduceat(points, start), np.maximum.reduceat(points, start))
    return NoiselessComponents(received.path[rows], joint[:, 0], joint[:, 1:], gain)


def single(received: Received) -> NoiselessComponents:
    """Components of one path each, nothing merged."""
    return NoiselessComponents(received.path, received.tau, received.direction[:, :2], received.gain)


def lone_errors(parts: NoiselessComponents, radio: RadioConfig, draws: Floats) -> ComponentErrors:
    """Errors of multipath components, each as exact as a lone path's, as if no other were near; `draws` (N, 5) standard
    normal."""
    tau, cosines = path_std(radio.integrated_snr(parts.gain), radio)
    deviation = np.column_stack([tau, cosines])
    gain_std = np.full(len(tau), np.sqrt(2.0) * amplitude_std(radio))
    return ComponentErrors(deviation * draws[:, 2:], deviation, gain_std)


def in_resolution_cells(received: Received, radio: RadioConfig) -> Floats:
    """Delays and direction cosines (N, 3) of received paths in resolution cells, by which they merge to components."""
    array = radio.array
    widths = [count * array.spacing if count > 1 else 0.0 for count in (array.rows, array.cols)]
    return np.column_stack([received.tau * radio.bandwidth, received.direction[:, :2] * widths])


def clip_to_unit_disc(cosines: Floats) -> Floats:
    """Clip the direction cosines (..., 2) of components radially to the unit disc."""
    length = np.linalg.norm(cosines, axis=-1, keepdims=True)
    return cosines / np.maximum(length, 1.0)


def capped_cosine_std(deviation: Floats, radio: RadioConfig) -> Floats:
    """Standard deviations (N, 2) of a component's cosines, at most `DISC_STD`, as along an axis without aperture."""
    blind = np.array([radio.array.rows, radio.array.cols]) < 2
    return np.where(blind, DISC_STD, np.minimum(deviation, DISC_STD))


def blind_axes(cosines: Floats, radio: RadioConfig) -> Floats:
    """Direction cosines (N, 2) of components, zero along axes without aperture, where nothing is measured."""
    return cosines * (np.array([radio.array.rows, radio.array.cols]) > 1)


def _leaders(strength: Floats, cell: Booleans) -> Integers:
    """Leaders (N,) of paths that merge to components: for each the strongest free path of its resolution cell."""
    crowded = np.count_nonzero(cell, axis=1) > 1
    leader = np.where(crowded, -1, np.arange(len(strength)))
    rows = crowded.nonzero()[0]
    for row in rows[np.argsort(-strength[rows], kind="stable")]:
        if leader[row] < 0:
            leader[cell[row] & (leader < 0)] = row
    return leader
