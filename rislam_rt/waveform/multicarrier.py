"""Multicarrier sounding: M equal tones, B/M apart, over one symbol of M/B seconds."""

import numpy as np

from rislam_rt.arrays import Complexes, Floats, phasor


def subcarrier_frequencies(num_subcarriers: int, bandwidth: float) -> Floats:
    """Baseband frequencies (M,) [Hz], centred on 0: the spectrum of the flat band, sampled."""
    return (np.arange(num_subcarriers) - (num_subcarriers - 1) / 2.0) * bandwidth / num_subcarriers


def delay_response(tau: Floats, frequencies: Floats) -> Complexes:
    """`exp(-j 2 pi f tau)` (..., M): what delays (...,) [s] do to tones at baseband frequencies (M,) [Hz]."""
    return phasor(-2.0 * np.pi * np.asarray(tau)[..., None] * frequencies)
