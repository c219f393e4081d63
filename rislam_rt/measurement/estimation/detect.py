"""Detection of paths in a residual signal: matched-filter peaks on a grid, interpolated, subtracted one by one."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers, phasor
from rislam_rt.measurement.estimation.path_signals import Sounding

OVERSAMPLING = 2
"""Grid points per resolution cell of the delay."""
ANGLE_POINTS = 3
"""Grid points per beam width of a cosine."""
GRID_LOSS = 0.6
"""Least share of a peak's power that shows on the grid when the peak lies between its points."""
CLIMB_STEPS = 2
"""Number of Newton steps from a grid point to the peak of the matched filter."""
CLIMB_LIMIT = np.array([0.3, 0.12, 0.12])
"""Largest change of (B tau, u, v) by one Newton step to a peak."""
BATCH_RANGE = 10.0**-1.2
"""Power relative to the strongest peak down to which peaks are picked from the same residual; sidelobes lie below."""


class MatchedFilterGrid(NamedTuple):
    """Grid of directions and delays on which the matched filter is evaluated."""

    cosines: Floats
    """(G, 2) within the unit disc."""
    antennas: Complexes
    """(G, L) conjugate antenna vectors, in single precision: the grid only says where to look."""
    delays: Integers
    """(T,) indices of delays within the window, in steps of 1 / `OVERSAMPLING` cells, modulo the period."""
    tones: int
    """Length of the Fourier transform over tones: `OVERSAMPLING` times their number."""
    places: tuple[Floats, Floats, Floats]
    """Tones, rows and columns times 2 pi; the tones' sign is turned."""
    powers: tuple[Complexes, Complexes, Complexes]
    """(3, n) over tones, rows and columns: weights of `a^H y` for its value and its first two derivatives."""


def build_grid(sounding: Sounding, window: tuple[float, float]) -> MatchedFilterGrid:
    """Build the matched filter's grid over all directions and a window of delays, given in resolution cells."""
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
    places = (-2.0 * np.pi * sounding.frequency, 2.0 * np.pi * sounding.row, 2.0 * np.pi * sounding.col)
    tones, row, col = (np.stack([np.ones(len(x)), -1j * x, -(x**2)]) for x in places)
    return MatchedFilterGrid(cosines, antennas, delays, count, places, (tones, row, col))


def spectrum(grid: MatchedFilterGrid, residual: Complexes) -> Complexes:
    """Output (G, T) of the matched filter on its grid, up to a phase, for samples (L, M)."""
    return np.asarray(grid.antennas @ _delay_spectrum(grid, residual.astype(np.complex64)))


def _delay_spectrum(grid: MatchedFilterGrid, beams: Complexes) -> Complexes:
    """Fourier transform of tones (G, M) to the grid's delays (G, T)."""
    return np.fft.ifft(beams, n=grid.tones, axis=1, norm="forward")[:, grid.delays]


def pick_peaks(
    sounding: Sounding, grid: MatchedFilterGrid, residual: Complexes, threshold: float, window: tuple[float, float],
    most: int,
) -> Floats:  # fmt: skip
    """Detect paths (P, 3) as peaks of the matched filter on a residual, of a measured SNR above a linear threshold.

    The strongest first; each is interpolated and subtracted before the next is looked for.
    """
    picked: list[Floats] = []
    output = spectrum(grid, residual)
    lowest = GRID_LOSS * threshold * sounding.num_samples
    first = int(
        np.floor(window[0] * OVERSAMPLING)
    )  # the transform repeats after a period, the window may begin below 0
    delays = ((grid.delays - first) % grid.tones + first) / OVERSAMPLING
    while len(picked) < most:
        power = output.real**2 + output.imag**2
        best = np.unravel_index(np.argmax(power), power.shape)
        if power[best] < lowest:
            break
        start = np.array([delays[best[1]], *grid.cosines[best[0]]])
        parameters, matched, antennas, tones = _climb(grid, start, residual, window)
        snr = abs(matched) ** 2 / sounding.num_samples
        if snr < threshold:
            break
        picked.append(parameters)
        lowest = max(lowest, BATCH_RANGE * snr * sounding.num_samples)
        signal = matched / sounding.num_samples * tones
        residual = residual - np.multiply.outer(antennas, signal)
        beams = grid.antennas @ antennas.astype(np.complex64)
        single: Complexes = signal[None].astype(np.complex64)
        output -= np.multiply.outer(beams, _delay_spectrum(grid, single)[0])
    return np.array(picked).reshape(-1, 3)


def _climb(
    grid: MatchedFilterGrid, start: Floats, residual: Complexes, window: tuple[float, float]
) -> tuple[Floats, complex, Complexes, Complexes]:
    """Interpolate a peak of the matched filter from its grid point (3,), by Newton steps along each parameter."""
    # Also returns `a^H y` there, and the signal's factors over antennas (L,) and tones (M,).
    point = start
    for _ in range(CLIMB_STEPS):
        moves = _newton_moves(_moments(grid, _signals(grid, point), residual), grid)
        point = into_range(point + np.minimum(np.maximum(moves, -CLIMB_LIMIT), CLIMB_LIMIT), window)
    tones, row, col = _signals(grid, point)
    antennas = np.multiply.outer(row, col).ravel()
    return point, complex(antennas.conj() @ (residual @ tones.conj())), antennas, tones


def _signals(grid: MatchedFilterGrid, point: Floats) -> list[Complexes]:
    """Signal of a path at a point (3,) of the detection grid, as factors over tones, rows and columns."""
    return [phasor(value * place) for place, value in zip(grid.places, point, strict=True)]


def _moments(grid: MatchedFilterGrid, signal: list[Complexes], residual: Complexes) -> Complexes:
    """Matched filter's output `a^H y` near a peak with its first two derivatives by each of (B tau, u, v): (3, 3)."""
    tones, row, col = (weight * factor.conj() for weight, factor in zip(grid.powers, signal, strict=True))
    field = residual @ tones.T
    beam = field[:, 0].reshape(row.shape[1], col.shape[1])
    return np.array([np.multiply.outer(row[0], col[0]).ravel() @ field, row @ (beam @ col[0]), col @ (row[0] @ beam)])


def _newton_moves(moments: Complexes, grid: MatchedFilterGrid) -> Floats:
    """Newton steps (3,) to a detected peak of |a^H y|^2, each parameter alone; uphill for either curvature."""
    value, first, second = moments.T
    power = value.real**2 + value.imag**2
    gradient = value.real * first.real + value.imag * first.imag
    curvature = first.real**2 + first.imag**2 + value.real * second.real + value.imag * second.imag
    least = 0.2 * np.array([x @ x / len(x) for x in grid.places]) * power
    return np.where(least > 0.0, gradient / np.maximum(np.maximum(-curvature, least), 1e-300), 0.0)


def into_range(parameters: Floats, window: tuple[float, float]) -> Floats:
    """Clip parameters (..., 3) of detected paths: the delay to the window, the direction cosines to the unit disc."""
    delay = np.clip(parameters[..., :1], *window)
    cosines = parameters[..., 1:]
    return np.concatenate([delay, cosines / np.maximum(np.linalg.norm(cosines, axis=-1, keepdims=True), 1.0)], axis=-1)


def _axis(positions: Floats) -> Floats:
    """Direction cosines of the matched filter's grid along one axis of the array; 0 alone where it has no aperture."""
    if len(positions) < 2:
        return np.zeros(1)
    beam = 1.0 / (len(positions) * (positions[1] - positions[0]))
    count = int(np.ceil(2.0 * ANGLE_POINTS / beam)) + 1
    return np.linspace(-1.0, 1.0, count)
