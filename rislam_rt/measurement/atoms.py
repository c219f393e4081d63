"""Signals of single paths and their inner products, as the estimator sees them: products over delay, rows and columns.

A path's parameters are `(B tau, u, v)`: delay in resolution cells and the two direction cosines. Its signal of unit
amplitude is `a = a_f(B tau) x a_x(u) x a_y(v)`, so every inner product of signals or of their derivatives is a product
of three small ones, and the P x P matrices of P paths cost next to nothing.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.model import RadioConfig
from rislam_rt.waveform import subcarrier_frequencies


class Sounding(NamedTuple):
    """What the estimator knows of the samples that it works on."""

    frequency: Floats
    """(M,) tones over the bandwidth, in [-1/2, 1/2]."""
    row: Floats
    """(R,) element positions along body x [wavelengths]."""
    col: Floats
    """(C,) element positions along body y [wavelengths]."""
    squint: float
    """Bandwidth over carrier where every element has its own delay (`waves`), else 0."""

    @property
    def num_samples(self) -> int:
        """L M: energy of a path's signal of unit amplitude."""
        return len(self.frequency) * len(self.row) * len(self.col)


class Factors(NamedTuple):
    """The three factors of P signals and of their derivatives: each (2, n, P), the derivative second."""

    delay: Complexes
    row: Complexes
    col: Complexes


class Grams(NamedTuple):
    """Inner products of P signals `a` and their derivatives `d` by the three parameters."""

    signal: Complexes
    """(P, P) `a_i^H a_j`."""
    mixed: Complexes
    """(3, P, P) `a_i^H d_j`."""
    slope: Complexes
    """(3, 3, P, P) `d_i^H d_j`."""


def build_sounding(num_tones: int, radio: RadioConfig, *, element_exact: bool = False) -> Sounding:
    """Tones and element positions of a radio."""
    x = radio.array.positions(1.0).reshape(radio.array.rows, radio.array.cols, 3)
    squint = radio.bandwidth / radio.carrier if element_exact else 0.0
    return Sounding(subcarrier_frequencies(num_tones, 1.0), x[:, 0, 0], x[0, :, 1], squint)


def factors(sounding: Sounding, parameters: Floats) -> Factors:
    """Factors of the signals of P paths (P, 3)."""
    delay = tone_response(sounding.frequency, parameters[:, 0])
    row = np.exp(2j * np.pi * sounding.row[:, None] * parameters[:, 1])
    col = np.exp(2j * np.pi * sounding.col[:, None] * parameters[:, 2])
    slopes = (-sounding.frequency, sounding.row, sounding.col)
    return Factors(
        *(
            np.stack([signal, (2j * np.pi * slope)[:, None] * signal])
            for signal, slope in zip((delay, row, col), slopes, strict=True)
        )
    )


def tone_response(frequency: Floats, delay: Floats) -> Complexes:
    """`exp(-j 2 pi f tau)` (M, P); of evenly spaced tones: a coarse and a fine factor save most exponentials."""
    count = len(frequency)
    fine = next(size for size in range(int(np.sqrt(count)), 0, -1) if count % size == 0)
    coarse = np.exp(-2j * np.pi * frequency[::fine, None] * delay)
    offset = np.exp(-2j * np.pi * (frequency[:fine] - frequency[0])[:, None] * delay)
    return (coarse[:, None] * offset).reshape(count, len(delay))


def synthesise(parts: Factors, amplitude: Complexes) -> Complexes:
    """Sum (R C, M) of P signals of amplitudes (P,)."""
    antennas = _antennas(parts.row[0], parts.col[0])
    return (antennas * amplitude) @ parts.delay[0].T


def correlate(parts: Factors, samples: Complexes) -> tuple[Complexes, Complexes]:
    """`a^H y` (P,) and `d^H y` (3, P) of samples (R C, M)."""
    row, col = parts.row, parts.col
    plain, steep = samples @ parts.delay[0].conj(), samples @ parts.delay[1].conj()
    antennas = _antennas(row[0], col[0]).conj()
    slopes = [
        np.sum(antennas * steep, axis=0),
        np.sum(_antennas(row[1], col[0]).conj() * plain, axis=0),
        np.sum(_antennas(row[0], col[1]).conj() * plain, axis=0),
    ]
    return np.sum(antennas * plain, axis=0), np.stack(slopes)


def inner_products(parts: Factors) -> Grams:
    """All inner products of the signals and their derivatives."""
    one, two, three = (_gram(part) for part in parts)
    signal = one[0, 0] * two[0, 0] * three[0, 0]
    orders = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    mixed = np.array([one[0, b[0]] * two[0, b[1]] * three[0, b[2]] for b in orders])
    slope = np.array([[one[a[0], b[0]] * two[a[1], b[1]] * three[a[2], b[2]] for b in orders] for a in orders])
    return Grams(signal, mixed, slope)


def _gram(part: Complexes) -> Complexes:
    """(2, 2, P, P) inner products of the columns (2, n, P) of one factor."""
    flat = np.concatenate([part[0], part[1]], axis=1)
    count = part.shape[2]
    product = flat.conj().T @ flat
    return product.reshape(2, count, 2, count).transpose(0, 2, 1, 3)


def _antennas(row: Complexes, col: Complexes) -> Complexes:
    """(R C, P) antenna vectors."""
    return (row[:, None] * col[None]).reshape(len(row) * len(col), row.shape[1])
