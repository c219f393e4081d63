"""Search for new paths in a residual: peaks of the matched filter on a grid, interpolated and taken off one by one."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.measurement.atoms import Sounding, factors

OVERSAMPLING = 2
"""Grid points per resolution cell of the delay."""
ANGLE_POINTS = 3
"""Grid points per beam width of a cosine."""
GRID_LOSS = 0.6
"""A peak between grid points shows at least this share of its power on the grid."""
CLIMB_STEPS = 2
CLIMB_LIMIT = np.array([0.3, 0.12, 0.12])
"""Most that one step of the climb changes (B tau, u, v)."""
BATCH_RANGE = 10.0**-1.2
"""Peaks down to this share of the strongest are taken from the same residual; sidelobes of what is taken lie below."""


class Grid(NamedTuple):
    """Directions and delays at which the matched filter is evaluated."""

    cosines: Floats
    """(G, 2) within the unit disc."""
    antennas: Complexes
    """(G, L) conjugate antenna vectors, in single precision: the grid only says where to look."""
    delays: Integers
    """(T,) indices of delays within the window, in steps of 1 / `OVERSAMPLING` cells."""
    tones: int


def build_grid(sounding: Sounding, window: tuple[float, float]) -> Grid:
    """Grid over the sky and over a window of delays, given in resolution cells."""
    u, v = np.meshgrid(_axis(sounding.row), _axis(sounding.col), indexing="ij")
    step = np.hypot(1.0 / len(_axis(sounding.row)), 1.0 / len(_axis(sounding.col)))
    inside = np.hypot(u, v) <= 1.0 + step
    cosines = np.column_stack([u[inside], v[inside]])
    cosines = cosines / np.maximum(np.linalg.norm(cosines, axis=1, keepdims=True), 1.0)
    x, y = (part.ravel() for part in np.meshgrid(sounding.row, sounding.col, indexing="ij"))
    antennas = np.exp(-2j * np.pi * (cosines[:, :1] * x + cosines[:, 1:] * y)).astype(np.complex64)
    first, last = np.floor(window[0] * OVERSAMPLING), np.ceil(window[1] * OVERSAMPLING)
    count = OVERSAMPLING * len(sounding.frequency)
    delays = np.unique(np.arange(first, last + 1, dtype=np.int64) % count)
    return Grid(cosines, antennas, delays, count)


def spectrum(grid: Grid, residual: Complexes) -> Complexes:
    """Matched filter's output (G, T), up to a phase, for samples (L, M)."""
    return _delay_spectrum(grid, grid.antennas @ residual.astype(np.complex64))


def _delay_spectrum(grid: Grid, beams: Complexes) -> Complexes:
    return np.fft.ifft(beams, n=grid.tones, axis=1, norm="forward")[:, grid.delays]


def pick_peaks(
    sounding: Sounding, grid: Grid, residual: Complexes, threshold: float, window: tuple[float, float], most: int
) -> Floats:
    """Parameters (P, 3) of new paths whose measured SNR in the residual exceeds a linear threshold.

    The strongest first; each is interpolated and taken off before the next is looked for.
    """
    picked: list[Floats] = []
    output = spectrum(grid, residual)
    lowest = GRID_LOSS * threshold * sounding.num_samples
    while len(picked) < most:
        power = output.real**2 + output.imag**2
        best = np.unravel_index(np.argmax(power), power.shape)
        if power[best] < lowest:
            break
        start = np.array([grid.delays[best[1]] / OVERSAMPLING, *grid.cosines[best[0]]])
        parameters = _climb(sounding, start, residual, window)
        parts = factors(sounding, parameters[None])
        antennas = (parts.row[0][:, None] * parts.col[0][None]).reshape(-1, 1)
        amplitude = (antennas[:, 0].conj() @ residual @ parts.delay[0, :, 0].conj()) / sounding.num_samples
        snr = sounding.num_samples * abs(amplitude) ** 2
        if snr < threshold:
            break
        picked.append(parameters)
        lowest = max(lowest, BATCH_RANGE * snr * sounding.num_samples)
        signal = amplitude * parts.delay[0].T
        residual = residual - antennas * signal
        output -= (grid.antennas @ antennas.astype(np.complex64)) * _delay_spectrum(grid, signal.astype(np.complex64))
    return np.array(picked).reshape(-1, 3)


def _climb(sounding: Sounding, start: Floats, residual: Complexes, window: tuple[float, float]) -> Floats:
    """The peak of the matched filter next to a grid point, by Newton steps along each parameter."""
    point = start
    for _ in range(CLIMB_STEPS):
        moves = _newton_moves(sounding, point, residual)
        point = into_range(point + np.clip(moves, -CLIMB_LIMIT, CLIMB_LIMIT), window)
    return point


def _newton_moves(sounding: Sounding, point: Floats, residual: Complexes) -> Floats:
    """Newton steps (3,) of |a^H y|^2, each parameter on its own; uphill where the curvature has the wrong sign."""
    slopes = (-2j * np.pi * sounding.frequency, 2j * np.pi * sounding.row, 2j * np.pi * sounding.col)
    delay, row, col = (np.exp(-slope * value) for slope, value in zip(slopes, point, strict=True))
    beam = (row[:, None] * col).ravel() @ residual
    field = (residual @ delay).reshape(len(row), len(col))
    moves = np.zeros(3)
    for axis, (line, slope) in enumerate(
        zip((beam * delay, field @ col * row, row @ field * col), slopes, strict=True)
    ):
        if len(line) < 2:
            continue
        value, first, second = line.sum(), -(slope @ line), slope**2 @ line
        gradient = np.real(np.conj(value) * first)
        curvature = np.abs(first) ** 2 + np.real(np.conj(value) * second)
        least = 0.2 * np.mean(np.abs(slope) ** 2) * np.abs(value) ** 2
        moves[axis] = gradient / max(-curvature, least)
    return moves


def into_range(parameters: Floats, window: tuple[float, float]) -> Floats:
    """Parameters (..., 3) with the delay within the window and the cosines within the unit disc."""
    delay = np.clip(parameters[..., :1], *window)
    cosines = parameters[..., 1:]
    return np.concatenate([delay, cosines / np.maximum(np.linalg.norm(cosines, axis=-1, keepdims=True), 1.0)], axis=-1)


def _axis(positions: Floats) -> Floats:
    """Cosines along one axis of the array; 0 alone where it has no aperture."""
    if len(positions) < 2:
        return np.zeros(1)
    beam = 1.0 / (len(positions) * (positions[1] - positions[0]))
    count = int(np.ceil(2.0 * ANGLE_POINTS / beam)) + 1
    return np.linspace(-1.0, 1.0, count)
