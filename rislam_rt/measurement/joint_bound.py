"""Errors of components drawn from the joint bound of all paths, which counts overlap and merges unresolved ones."""

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers
from rislam_rt.measurement.components import ComponentErrors, NoiselessComponents, in_resolution_cells, join
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.estimation.path_signals import InnerProducts, build_sounding, inner_of, waves_at
from rislam_rt.measurement.estimation.positive_definite import inverse
from rislam_rt.measurement.estimation.refine import amplitude_variance, information_matrix
from rislam_rt.measurement.received_paths import Received
from rislam_rt.measurement.received_signal import num_tones
from rislam_rt.model import RadioConfig

LEAST_CERTAINTY = 2.0
"""Ratio of a path's amplitude to its standard deviation below which it is not resolved from its neighbour."""


def joint_errors(
    received: Received, radio: RadioConfig, config: ReceiverConfig, draws: Floats
) -> tuple[NoiselessComponents, ComponentErrors]:
    """Joint bound of the resolved paths of one capture: their components, and errors drawn from that Cramér-Rao bound.

    Paths merge until every component is certain enough, or has no neighbour to merge with.

    Parameters
    ----------
    received
        The paths of one capture.
    draws
        (P, 5) normal draws of all columns of the paths; the last three are used.
    """
    sounding = build_sounding(num_tones(radio, config), radio)
    merging = config.merge
    place = in_resolution_cells(received, radio)
    near = np.linalg.norm(place[:, None] - place, axis=-1)
    unit = np.sqrt(radio.energy * radio.array.num_antennas / (sounding.num_samples * radio.noise_psd))
    strength = np.abs(received.gain)
    leader = np.arange(len(strength))
    if merging:
        leader = _absorbed(strength * unit * np.sqrt(sounding.num_samples) < LEAST_CERTAINTY, near)
    while True:
        parts = join(received, leader)
        parameters = np.column_stack([parts.tau * radio.bandwidth, parts.cosines])
        covariance, variance = joint_bound(inner_of(sounding, waves_at(sounding, parameters)), parts.gain * unit)
        rows = np.unique(leader)
        certainty = np.abs(parts.gain) * unit / np.sqrt(variance)
        doubtful = rows[np.argsort(certainty)[: np.sum(certainty < LEAST_CERTAINTY)]]
        merged = _paired(leader, doubtful, strength, near) if merging else leader
        if np.array_equal(merged, leader):
            return parts, _draw(parts, covariance, np.sqrt(variance) / unit, draws, radio)
        leader = merged


def _absorbed(faint: Booleans, near: Floats) -> Integers:
    """Leaders (N,) of paths when each path too faint to be resolved merges with the nearest other within a cell."""
    distance = np.where(~faint & (near < 1.0), near, np.inf)
    joins = faint & np.isfinite(distance).any(axis=1)
    return np.where(joins, np.argmin(distance, axis=1), np.arange(len(faint))) if len(faint) else np.arange(0)


def _paired(leader: Integers, doubtful: Integers, strength: Floats, near: Floats) -> Integers:
    """Leaders (N,) of paths after unresolved ones, in their order, merged with their nearest neighbours, each once."""
    merged = leader.copy()
    free = leader == np.arange(len(leader))
    for row in doubtful:
        distance = np.where(free & (np.arange(len(free)) != row), near[row], np.inf)
        nearest = int(np.argmin(distance))
        if free[row] and distance[nearest] < 1.0:
            weak, strong = (row, nearest) if strength[row] <= strength[nearest] else (nearest, row)
            merged[merged == weak] = strong
            free[[row, nearest]] = False
    return merged


def _draw(
    parts: NoiselessComponents, covariance: Floats, gain_std: Floats, draws: Floats, radio: RadioConfig
) -> ComponentErrors:
    """Draw correlated errors of components by their joint bound, from independent standard normal draws."""
    scale = np.sqrt(np.maximum(np.diagonal(covariance), np.finfo(np.float64).tiny))
    correlation = covariance / scale[:, None] / scale
    value, vector = np.linalg.eigh(correlation)
    # The symmetric root keeps each component's own draw its own where nothing overlaps.
    root = (vector * np.sqrt(np.maximum(value, 0.0))) @ vector.T
    units = np.array([1.0 / radio.bandwidth, 1.0, 1.0])
    error = (scale * (root @ draws[parts.path, 2:].T.ravel())).reshape(3, -1).T * units
    return ComponentErrors(error, scale.reshape(3, -1).T * units, gain_std)


def joint_bound(inner: InnerProducts, amplitude: Complexes) -> tuple[Floats, Floats]:
    """Joint Cramér-Rao bound of P paths at unit noise: covariance (3P, 3P) of the parameters, parameter by parameter,
    and variance (P,) of the complex amplitudes.
    """
    known = inverse(inner.signal)
    information = 2.0 * information_matrix(inner, known, amplitude)
    return inverse(information), amplitude_variance(inner, known, amplitude, information)
