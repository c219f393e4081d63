"""Floor 3: waveforms of the sounding. Flat-band pulse and multicarrier: autocorrelation, spectrum, samples."""

from rislam_rt.waveform.flat import (
    autocorrelation,
    delay_response,
    effective_bandwidth,
    flat_pulse,
    subcarrier_frequencies,
)

__all__ = ["autocorrelation", "delay_response", "effective_bandwidth", "flat_pulse", "subcarrier_frequencies"]
