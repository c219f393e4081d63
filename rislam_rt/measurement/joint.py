"""Errors from the joint bound of all paths: what overlapping signals cost each other, and what cannot be told apart."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.measurement.atoms import Sounding, build_sounding, factors, inner_products
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.parts import Errors, Parts, audible, cell_offsets, join
from rislam_rt.measurement.received import Received
from rislam_rt.measurement.refine import joint_bound
from rislam_rt.measurement.signal import num_tones
from rislam_rt.model import RadioConfig

LEAST_CERTAINTY = 2.0
"""A path whose amplitude is less than this many times its standard deviation is not resolved from its neighbour."""


def joint_errors(received: Received, radio: RadioConfig, config: ReceiverConfig, draws: Floats) -> tuple[Parts, Errors]:
    """Components that can be resolved, and errors drawn from their joint bound.

    Under alternation the panel's paths and the others are separate problems.

    Parameters
    ----------
    draws
        (P, 5) normal draws of all columns of the paths; the last three are used.
    """
    sounding = build_sounding(num_tones(radio, config), radio)
    halves = [received]
    if config.alternation:
        halves = [audible(received, received.from_panel), audible(received, ~received.from_panel)]
    parts, errors = zip(*(_one_problem(half, sounding, radio, config.merge, draws) for half in halves), strict=True)
    return Parts(*map(np.concatenate, zip(*parts, strict=True))), Errors(
        *map(np.concatenate, zip(*errors, strict=True))
    )


def _one_problem(
    received: Received, sounding: Sounding, radio: RadioConfig, merging: bool, draws: Floats
) -> tuple[Parts, Errors]:
    near = np.linalg.norm(cell_offsets(received, radio), axis=-1)
    leader = np.arange(len(received.tau))
    unit = np.sqrt(radio.energy / (sounding.num_samples / radio.array.num_antennas * radio.noise_psd))
    if merging:
        lone = np.abs(received.gain) * unit * np.sqrt(sounding.num_samples)
        leader = _absorbed(leader, lone < LEAST_CERTAINTY, lone, near)
    while True:
        parts = join(received, leader)
        covariance, variance = _bound(parts, sounding, radio, unit)
        certainty = np.abs(parts.gain) * unit / np.sqrt(variance)
        rows = np.unique(leader)
        merged = leader
        if merging:
            doubtful = np.zeros(len(leader), dtype=bool)
            doubtful[rows] = certainty < LEAST_CERTAINTY
            alive = np.isin(np.arange(len(leader)), rows)
            strength = np.where(alive, np.abs(received.gain), 0.0)
            merged = _absorbed(leader, _one_of_each_pair(doubtful, strength, near), strength, near)
        if np.array_equal(merged, leader):
            break
        leader = merged
    return parts, _draw(parts, covariance, np.sqrt(variance) / unit, draws, radio)


def _bound(parts: Parts, sounding: Sounding, radio: RadioConfig, unit: float) -> tuple[Floats, Floats]:
    parameters = np.column_stack([parts.tau * radio.bandwidth, parts.cosines])
    return joint_bound(inner_products(factors(sounding, parameters)), parts.gain * unit)


def _absorbed(leader: Integers, doubtful: Booleans, strength: Floats, near: Floats) -> Integers:
    """Leaders (N,) after each doubtful row joined the nearest stronger row that is not doubtful, within a cell."""
    open_to = (strength[:, None] < strength) & ~doubtful & (near < 1.0)
    distance = np.where(open_to, near, np.inf)
    joins = np.flatnonzero(doubtful & open_to.any(axis=1))
    moved = leader.copy()
    for row in joins:
        moved[leader == row] = np.argmin(distance[row])
    return moved


def _one_of_each_pair(doubtful: Booleans, strength: Floats, near: Floats) -> Booleans:
    """Of doubtful rows within a cell of each other all but the strongest: one must be left to join."""
    rivals = doubtful & (near < 1.0) & (strength[:, None] < strength)
    settled = ~doubtful & (strength > 0.0) & (near < 1.0) & (strength[:, None] < strength)
    return doubtful & (rivals.any(axis=1) | settled.any(axis=1))


def _draw(parts: Parts, covariance: Floats, gain_std: Floats, draws: Floats, radio: RadioConfig) -> Errors:
    """Correlated errors of all components from independent draws."""
    scale = np.sqrt(np.maximum(np.diagonal(covariance), np.finfo(np.float64).tiny))
    correlation = covariance / scale[:, None] / scale
    value, vector = np.linalg.eigh(correlation)
    # The symmetric root keeps each component's own draw its own where nothing overlaps.
    root = (vector * np.sqrt(np.maximum(value, 0.0))) @ vector.T
    units = np.array([1.0 / radio.bandwidth, 1.0, 1.0])
    error = (scale * (root @ draws[parts.path, 2:].T.ravel())).reshape(3, -1).T * units
    return Errors(error, scale.reshape(3, -1).T * units, gain_std)
