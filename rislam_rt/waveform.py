"""Floor 3: waveforms of the sounding. The flat-band pulse `s(t) = sqrt(E B) sinc(B t)`, equal power over |f| < B/2, and
the tones that sample its band."""

import numpy as np
import scipy

from rislam_rt.arrays import Complexes, Floats, phasor


def autocorrelation(tau: Floats, bandwidth: float, energy: float = 1.0, *, derivative: int = 0) -> Floats:
    """Autocorrelation `int s(t) s(t - tau) dt` of the flat-band pulse (Appendix B), or its 1st or 2nd derivative.

    Parameters
    ----------
    tau
        Delay differences (...,) [s].
    bandwidth
        B [Hz].
    energy
        R_s(0) [J].
    derivative
        0, 1 or 2: the result is in J, J/s or J/s^2.

    With x = pi B tau, R_s = E j0(x), R_s' = -E pi B j1(x) and R_s'' = E (pi B)^2 (2 j2(x) - j0(x)) / 3: spherical
    Bessel functions, so that nothing cancels near 0.
    """
    scale = np.pi * bandwidth
    x = scale * np.asarray(tau, dtype=np.float64)
    if derivative == 0:
        return energy * np.sinc(x / np.pi)
    if derivative == 1:
        return -energy * scale * scipy.special.spherical_jn(1, x)
    if derivative == 2:
        return energy * scale**2 * (2.0 * scipy.special.spherical_jn(2, x) - np.sinc(x / np.pi)) / 3.0
    raise ValueError(f"derivative: {derivative} received; give 0, 1 or 2")


def subcarrier_frequencies(num_subcarriers: int, bandwidth: float) -> Floats:
    """Baseband frequencies (M,) [Hz] of the tones of the multicarrier waveform, evenly spaced over the flat band,
    centred on 0."""
    return (np.arange(num_subcarriers) - (num_subcarriers - 1) / 2.0) * bandwidth / num_subcarriers


def delay_response(tau: Floats, frequencies: Floats) -> Complexes:
    """Phase factors `exp(-j 2 pi f tau)` (..., M) of the pulse's tones (M,) [Hz] after delays (...,) [s]."""
    return phasor(-2.0 * np.pi * np.asarray(tau)[..., None] * frequencies)
