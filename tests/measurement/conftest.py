"""Paths made by hand, so that the receiver is tested without a channel."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.model import PathKind, Paths, RadioConfig

Direction = tuple[float, float, float]
Row = tuple[PathKind, float, Direction, complex]


def paths_of(rows: Sequence[Row]) -> Paths:
    """One cycle of paths, each given by kind, length [m], direction of arrival (not yet a unit vector) and gain."""
    count = len(rows)
    arrival = np.array([row[2] for row in rows], dtype=np.float64).reshape(1, count, 3)
    return Paths(
        kind=np.array([row[0] for row in rows], dtype=np.int64),
        landmark=np.array([-1 if row[0] in (PathKind.LOS, PathKind.VT) else 0 for row in rows], dtype=np.int64),
        tx_walls=np.full((count, 1), -1),
        rx_walls=np.full((count, 1), -1),
        valid=np.ones((1, count), dtype=bool),
        tau=np.array([[row[1] for row in rows]], dtype=np.float64).reshape(1, count) / SPEED_OF_LIGHT,
        departure=np.zeros((1, count, 3)),
        arrival=arrival / np.linalg.norm(arrival, axis=-1, keepdims=True),
        gain=np.array([[row[3] for row in rows]], dtype=np.complex128).reshape(1, count),
        vertices=np.zeros((1, count, 1, 3)),
        num_vertices=np.ones(count, dtype=np.int64),
        walls=("wall",),
        landmarks=("sphere",),
    )


def gain_of(snr_db: float, radio: RadioConfig, phase: float = 0.0) -> complex:
    """The gain of a path with this SNR over all antennas."""
    amplitude = np.sqrt(10.0 ** (snr_db / 10.0) * radio.noise_psd / (radio.array.num_antennas * radio.energy))
    return complex(amplitude * np.exp(1j * phase))


@pytest.fixture
def make_paths() -> Callable[[Sequence[Row]], Paths]:
    return paths_of


@pytest.fixture
def make_gain() -> Callable[..., complex]:
    return gain_of
