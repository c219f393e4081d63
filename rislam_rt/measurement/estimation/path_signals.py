"""Signals of many paths over tones and array as the estimator knows them, their derivatives and inner products.

A path's parameters are `(B tau, u, v)`: delay in resolution cells and the two direction cosines. Its plane-wave signal
of unit amplitude is `a = a_f(B tau) x a_x(u) x a_y(v)`, a product over tones, rows and columns. So is every inner
product of signals or of their derivatives, and the P x P matrices of P paths cost little. Tones and elements lie evenly
about their middles: an inner product over one axis is a sum of cosines, half the axis says all, and real matrices do.

At 1 GHz around 10 GHz the phase across four elements changes by a few tenths of a radian from one end of the band to
the other, and a wall a metre away bends the wave front by as much: plane waves then leave a hundredth of a wall's
energy behind, which is 40 dB above a panel's. Spherical waves (`wave_signals`) give every element its own delay. The
wave front's radius is taken as the whole path, true of leakage and wall returns, the only ones strong enough to matter.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers, phasor
from rislam_rt.model import RadioConfig
from rislam_rt.waveform import subcarrier_frequencies


class Sounding(NamedTuple):
    """Sounding as the estimator knows it: frequencies of the tones and positions of the array's elements."""

    frequency: Floats
    """(M,) tones over the bandwidth, in [-1/2, 1/2]."""
    row: Floats
    """(R,) element positions along body x [wavelengths]."""
    col: Floats
    """(C,) element positions along body y [wavelengths]."""
    squint: float
    """Bandwidth over carrier where every element has its own delay (`wave_signals`), else 0."""

    @property
    def num_samples(self) -> int:
        """Number of samples L M of a sounding, which is the energy of a path's signal of unit amplitude."""
        return len(self.frequency) * len(self.row) * len(self.col)


def build_sounding(num_tones: int, radio: RadioConfig, *, element_exact: bool = False) -> Sounding:
    """Sounding in which paths' signals are computed: frequencies of a radio's `num_tones` tones, and positions of its
    array's elements."""
    x = radio.array.positions(1.0).reshape(radio.array.rows, radio.array.cols, 3)
    squint = radio.bandwidth / radio.carrier if element_exact else 0.0
    return Sounding(subcarrier_frequencies(num_tones, 1.0), x[:, 0, 0], x[0, :, 1], squint)


def tone_response(frequency: Floats, delay: Floats) -> Complexes:
    """Response (M, P) of evenly spaced tones to delays, `exp(-j 2 pi f tau)`, by coarse and fine factors."""
    count = len(frequency)
    fine = next(size for size in range(int(np.sqrt(count)), 0, -1) if count % size == 0)
    coarse = phasor(-2.0 * np.pi * frequency[::fine, None] * delay)
    offset = phasor(-2.0 * np.pi * (frequency[:fine] - frequency[0])[:, None] * delay)
    return (coarse[:, None] * offset).reshape(count, len(delay))


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
        """Antenna vectors (L, P) of the paths' signals."""
        return (self.row[:, None] * self.col).reshape(len(self.row) * len(self.col), -1)

    def correlate(self, sounding: Sounding, samples: Complexes) -> Complexes:
        """Correlate signals and their derivatives d by the parameters with samples (L, M): `a^H y`, `d^H y` (4, P)."""
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


SHORTEST_RADIUS = 0.5
"""Smallest radius of a wave front [wavelengths]; smaller ones are taken for this."""


def wave_signals(sounding: Sounding, parameters: Floats) -> Complexes:
    """Spherical-wave signals (L M, P) of paths (P, 3), antenna by antenna, of unit amplitude at the array's centre."""
    excess = _excess(sounding, parameters)
    delay = parameters[:, 0] + sounding.squint * excess
    tones = tone_response(sounding.frequency, delay.ravel()).reshape(len(sounding.frequency), *excess.shape)
    waves = np.exp(-2j * np.pi * excess) * tones
    return waves.transpose(1, 0, 2).reshape(sounding.num_samples, len(parameters))


def correlate_waves(sounding: Sounding, waves: Complexes, samples: Complexes) -> tuple[Complexes, Complexes]:
    """Correlate spherical-wave signals and their derivatives with samples (L, M): `a^H y` (P,) and `d^H y` (3, P)."""
    product = waves.conj() * samples.reshape(-1, 1)
    x, y = (part.ravel() for part in np.meshgrid(sounding.row, sounding.col, indexing="ij"))
    stretch = 1.0 + sounding.squint * sounding.frequency
    weights = np.stack([np.ones((len(x), 1)) * sounding.frequency, -x[:, None] * stretch, -y[:, None] * stretch])
    slopes = 2j * np.pi * weights.reshape(3, -1) @ product
    return product.sum(axis=0), slopes


def _excess(sounding: Sounding, parameters: Floats) -> Floats:
    """Excess length (L, P) [wavelengths] of each path's signal to each element over that to the array's centre."""
    x, y = (part.reshape(-1, 1) for part in np.meshgrid(sounding.row, sounding.col, indexing="ij"))
    radius = np.maximum(parameters[:, 0] / sounding.squint, SHORTEST_RADIUS)
    along = x * parameters[:, 1] + y * parameters[:, 2]
    square = x**2 + y**2 - 2.0 * radius * along
    return square / (np.sqrt(np.maximum(radius**2 + square, 0.0)) + radius)
