"""Multicarrier sounding: M equal tones, B/M apart, over one symbol of M/B seconds."""

import numpy as np

from rislam_rt.arrays import Complexes, Floats, phasor


def subcarrier_frequencies(num_subcarriers: int, bandwidth: float) -> Floats:
    """Baseband frequencies (M,) [Hz] of a multicarrier sounding's tones, evenly spaced over the band, centred on 0."""
    return (np.arange(num_subcarriers) - (num_subcarriers - 1) / 2.0) * bandwidth / num_subcarriers


def delay_response(tau: Floats, frequencies: Floats) -> Complexes:
    """Phase factors `exp(-j 2 pi f tau)` (..., M) of tones at baseband frequencies (M,) [Hz] after delays (...,)
    [s]."""
    return phasor(-2.0 * np.pi * np.asarray(tau)[..., None] * frequencies)
