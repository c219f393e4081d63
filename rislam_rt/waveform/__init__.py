"""Floor 3: the sounding signal. Flat-band pulse and multicarrier: autocorrelation, spectrum, samples."""

from rislam_rt.waveform.flat import autocorrelation, effective_bandwidth, flat_pulse, pulse_spectrum
from rislam_rt.waveform.multicarrier import (
    delay_response,
    multicarrier_autocorrelation,
    multicarrier_bandwidth,
    subcarrier_frequencies,
)

__all__ = [
    "autocorrelation",
    "delay_response",
    "effective_bandwidth",
    "flat_pulse",
    "multicarrier_autocorrelation",
    "multicarrier_bandwidth",
    "pulse_spectrum",
    "subcarrier_frequencies",
]
