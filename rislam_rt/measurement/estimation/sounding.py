"""Sounding: frequencies of the tones and positions of the antennas that the estimator knows, and the tones' response.

A path's parameters are `(B tau, u, v)`: delay in resolution cells and the two direction cosines. Its signal of unit
amplitude is `a = a_f(B tau) x a_x(u) x a_y(v)`, a product over tones, rows and columns (`inner_products`).
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, phasor
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
    """Bandwidth over carrier where every element has its own delay (`spherical_waves`), else 0."""

    @property
    def num_samples(self) -> int:
        """Number of samples L M, which is the energy of a path's signal of unit amplitude."""
        return len(self.frequency) * len(self.row) * len(self.col)


def build_sounding(num_tones: int, radio: RadioConfig, *, element_exact: bool = False) -> Sounding:
    """Sounding of a radio: frequencies of `num_tones` tones, and element positions of its array."""
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
