"""Inner products of the signals of many paths and of their derivatives, as products over tones, rows and columns.

Every inner product of signals or of their derivatives is a product of three small ones, so that the P x P matrices of P
paths cost little. Tones and elements lie evenly about their middles: an inner product over one axis is a sum of
cosines, half the axis says all, and real matrices do.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers, phasor
from rislam_rt.measurement.estimation.sounding import Sounding, tone_response


class PathSignals(NamedTuple):
    """Plane-wave signals of P paths of unit amplitude, as factors over tones, rows and columns."""

    parameters: Floats
    """(P, 3) of (B tau, u, v)."""
    delay: Complexes
    """(M, P) factors over the tones."""
    row: Complexes
    """(R, P) factors over the array's rows."""
    col: Complexes
    """(C, P) factors over the array's columns."""

    def take(self, rows: Booleans | Integers) -> "PathSignals":
        """Select the signals of some paths."""
        return PathSignals(self.parameters[rows], self.delay[:, rows], self.row[:, rows], self.col[:, rows])

    @property
    def antennas(self) -> Complexes:
        """Antenna vectors (L, P) of the paths."""
        return (self.row[:, None] * self.col).reshape(len(self.row) * len(self.col), -1)

    def correlate(self, sounding: Sounding, samples: Complexes) -> Complexes:
        """Correlate signals and their derivatives d by the three parameters with samples (L, M): `a^H y`, `d^H y` (4,
        P)."""
        count = len(samples)
        beams = np.concatenate([samples, samples * sounding.frequency]) @ self.delay.conj()
        antennas = self.antennas.conj()
        fields = (antennas * beams.reshape(2, count, -1)).reshape(2, len(self.row), len(self.col), -1)
        by_row = fields.sum(axis=2)
        matched, steep = by_row.sum(axis=1)
        seen = np.stack([matched, steep, -(sounding.row @ by_row[0]), -(sounding.col @ fields[0].sum(axis=0))])
        seen[1:] *= 2j * np.pi
        return seen

    def sum(self, amplitude: Complexes) -> Complexes:
        """Samples (L, M) as the sum of all paths' signals with amplitudes (P,)."""
        return np.asarray((self.antennas * amplitude) @ self.delay.T)


class InnerProducts(NamedTuple):
    """Inner products of the signals `a` of P paths and their derivatives `d` by (B tau, u, v); all are real."""

    signal: Floats
    """(P, P) `a_i^H a_j`."""
    mixed: Floats
    """(P, 3, P) `a_i^H d_j`."""
    slope: Floats
    """(3, P, 3, P) `d_i^H d_j`."""

    def take(self, keep: Booleans | Integers) -> "InnerProducts":
        """Select the inner products of some paths."""
        return InnerProducts(self.signal[keep][:, keep], self.mixed[keep][..., keep], self.slope[:, keep][..., keep])


def waves_at(sounding: Sounding, parameters: Floats) -> PathSignals:
    """Plane-wave signals of paths at parameters (P, 3), as factors over tones, rows and columns."""
    delay, u, v = parameters.T
    row, col = (phasor(2.0 * np.pi * np.multiply.outer(x, c)) for x, c in ((sounding.row, u), (sounding.col, v)))
    return PathSignals(parameters, tone_response(sounding.frequency, delay), row, col)


def inner_of(sounding: Sounding, waves: PathSignals) -> InnerProducts:
    """Inner products of the paths' signals and of their derivatives by delay and both cosines."""
    (f0, f1, f2), (x0, x1, x2), (y0, y1, y2) = (
        _axis_products(wave, place)
        for wave, place in ((waves.delay, -sounding.frequency), (waves.row, sounding.row), (waves.col, sounding.col))
    )
    count = len(f0)
    fx, fy, xy = f0 * x0, f0 * y0, x0 * y0
    mixed, slope = np.empty((count, 3, count)), np.empty((3, count, 3, count))
    mixed[:, 0], mixed[:, 1], mixed[:, 2] = f1 * xy, x1 * fy, y1 * fx
    slope[0, :, 0], slope[1, :, 1], slope[2, :, 2] = f2 * xy, x2 * fy, y2 * fx
    for a, b, value in ((0, 1, f1 * x1.T * y0), (0, 2, f1 * y1.T * x0), (1, 2, x1 * y1.T * f0)):
        slope[b, :, a], slope[a, :, b] = value, value.T
    return InnerProducts(fx * y0, mixed, slope)


def _axis_products(wave: Complexes, place: Floats) -> tuple[Floats, Floats, Floats]:
    """Inner products (P, P) along one axis of the signals (n, P): of signals with derivatives, and of derivatives."""
    count, size = wave.shape
    half = wave[: count // 2] if count % 2 == 0 else wave
    flat = np.concatenate([half, (2j * np.pi * place[: len(half)])[:, None] * half], axis=1)
    stacked = np.concatenate([flat.real, flat.imag])
    product = stacked.T @ stacked * (1.0 if len(half) == count else 2.0)
    return product[:size, :size], product[:size, size:], product[size:, size:]
