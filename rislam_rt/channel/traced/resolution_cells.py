"""Resolution cells of the receive array: scattered and diffracted paths within half a cell are summed to one path.

A rough wall sends thousands of rays, each far too weak to be heard alone. Their sum is what counts, and within half a
resolution cell of delay and both cosines nothing tells them from one wave with the sum of their gains.
"""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.traced.diffuse_paths import DiffusePaths
from rislam_rt.geometry.angles import rotation_z, unit
from rislam_rt.model import PathKind, Paths, RadioConfig, Trajectory

CELLS = 2.0
"""Summing cells to a resolution cell, along delay and along each direction cosine."""


def as_paths(extras: DiffusePaths, trajectory: Trajectory, radio: RadioConfig) -> Paths:
    """Sum scattered and diffracted paths within half a resolution cell into one path each, cycle by cycle.

    These paths have no identity: a column means nothing from one cycle to the next.

    Gains add up, carrier phases included; delay and directions are the mean by power. The kind is `VT`, for want of
    another: they came over walls alone.
    """
    groups, cycle = _cells(extras, trajectory, radio)
    count, cycles = len(cycle), len(trajectory)
    power = np.abs(extras.gain) ** 2
    total = np.maximum(np.bincount(groups, power, count), np.finfo(np.float64).tiny)
    gain = np.bincount(groups, extras.gain.real, count) + 1j * np.bincount(groups, extras.gain.imag, count)

    def mean(values: Floats) -> Floats:
        return np.bincount(groups, power * values, count) / total

    first = np.searchsorted(cycle, np.arange(cycles))
    column = np.arange(count) - first[cycle]
    width = int(column.max(initial=-1)) + 1

    def dense(values: np.ndarray) -> np.ndarray:
        table = np.zeros((cycles, width, *values.shape[1:]), dtype=values.dtype)
        table[cycle, column] = values
        return table

    return Paths(
        kind=np.full(width, PathKind.VT),
        landmark=np.full(width, -1),
        tx_walls=np.full((width, 1), -1),
        rx_walls=np.full((width, 1), -1),
        valid=dense(np.ones(count, dtype=np.bool_)),
        tau=dense(mean(extras.tau)),
        departure=dense(unit(np.stack([mean(axis) for axis in extras.departure.T], axis=-1))),
        arrival=dense(unit(np.stack([mean(axis) for axis in extras.arrival.T], axis=-1))),
        gain=dense(gain),
        vertices=dense(np.stack([mean(axis) for axis in extras.vertices[:, 0].T], axis=-1)[:, None]),
        num_vertices=np.ones(width, dtype=np.int64),
        walls=(),
        landmarks=(),
        source=extras.source,
    )


def _cells(extras: DiffusePaths, trajectory: Trajectory, radio: RadioConfig) -> tuple[Integers, Integers]:
    """Number (N,) of the delay and angle cell into which each diffuse path falls, and each cell's cycle (C,),
    ascending."""
    array = radio.array
    body = np.einsum("ni,nij->nj", extras.arrival, rotation_z(trajectory.heading[extras.cycle]))
    widths = CELLS * np.array([radio.bandwidth, array.rows * array.spacing, array.cols * array.spacing])
    place = np.column_stack([extras.tau, body[:, :2]]) * widths
    keys = np.column_stack([extras.cycle, np.floor(place).astype(np.int64), body[:, 2] >= 0.0])
    cells, groups = np.unique(keys, axis=0, return_inverse=True)
    return groups.ravel(), cells[:, 0]
