"""Multicarrier sounding: M equal tones, B/M apart, over one symbol of M/B seconds."""

import numpy as np

from rislam_rt.arrays import Complexes, Floats


def subcarrier_frequencies(num_subcarriers: int, bandwidth: float) -> Floats:
    """Baseband frequencies (M,) [Hz], centred on 0: the spectrum of the flat band, sampled."""
    return (np.arange(num_subcarriers) - (num_subcarriers - 1) / 2.0) * bandwidth / num_subcarriers


def multicarrier_bandwidth(num_subcarriers: int, bandwidth: float) -> float:
    """Root of zeta^2 [Hz]: `(B / sqrt 12) sqrt(1 - 1/M^2)`, the flat band's in the limit of many tones."""
    return float(np.sqrt(np.mean(subcarrier_frequencies(num_subcarriers, bandwidth) ** 2)))


def delay_response(tau: Floats, frequencies: Floats) -> Complexes:
    """`exp(-j 2 pi f tau)` (..., M): what delays (...,) [s] do to tones at baseband frequencies (M,) [Hz]."""
    return np.exp(-2j * np.pi * np.asarray(tau)[..., None] * frequencies)


def multicarrier_autocorrelation(
    tau: Floats, num_subcarriers: int, bandwidth: float, energy: float = 1.0, *, derivative: int = 0
) -> Floats:
    """R_s (...,) of the sounding symbol, periodic with M/B, or its derivative of any order.

    Units as in `autocorrelation`, which is the limit of many tones.
    """
    omega = 2.0 * np.pi * subcarrier_frequencies(num_subcarriers, bandwidth)
    phase = np.asarray(tau, dtype=np.float64)[..., None] * omega + derivative * np.pi / 2.0
    return energy * np.mean(omega**derivative * np.cos(phase), axis=-1)
