"""Noise level and SNR: by a reference path, and as the paper defines it."""

from dataclasses import replace

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.received_paths import receive
from rislam_rt.model import Paths, RadioConfig
from rislam_rt.waveform import delay_response, subcarrier_frequencies

REFERENCE_RADIUS = 0.05
"""Radius [m] of the paper's sphere, the scatterer of the reference SNR."""
REFERENCE_DISTANCE = 3.0
"""Distance [m] of the reference SNR's sphere from Tx and Rx."""


def reference_gain(radio: RadioConfig) -> float:
    """Path gain |alpha| of the reference for the SNR, a sphere 3 m away: `lambda sqrt(Gt Gr sigma) / ((4 pi)^1.5
    d^2)`."""
    rcs = np.pi * REFERENCE_RADIUS**2
    free_space = radio.wavelength * np.sqrt(radio.tx_gain * radio.rx_gain * rcs)
    return float(free_space / ((4.0 * np.pi) ** 1.5 * REFERENCE_DISTANCE**2))


def with_reference_snr(radio: RadioConfig, snr_db: float) -> RadioConfig:
    """The radio with the noise at which the reference sphere has this SNR [dB] over signal and all L antennas."""
    snr = float(radio.integrated_snr(np.array(reference_gain(radio))))
    return replace(radio, noise_psd=radio.noise_psd * snr / 10.0 ** (snr_db / 10.0))


def paper_snr_db(
    paths: Paths, radio: RadioConfig, config: ReceiverConfig | None = None, *, heading: Floats | float = 0.0,
    num_samples: int = 128,
) -> Floats:  # fmt: skip
    """SNR (K,) [dB] of the received signal as the paper defines it, `||Y||^2 / (L U sigma_n^2)` without the noise in Y.

    It counts the leakage and the wall returns, and falls with the number of samples U that one sounding is spread over.

    Parameters
    ----------
    config
        For the leakage's cancellation; the default cancels nothing.
    heading
        Of the body, one or (K,) [rad].
    num_samples
        U: samples at rate B, one sounding of U/B seconds.
    """
    config = config or ReceiverConfig()
    headings = np.broadcast_to(np.asarray(heading, dtype=np.float64), (paths.num_cycles,))
    tones = subcarrier_frequencies(num_samples, radio.bandwidth)
    elements = 2.0 * np.pi * radio.array.positions(1.0)
    mean_power = np.zeros(paths.num_cycles)
    for cycle in range(paths.num_cycles):
        heard = receive(paths, cycle, float(headings[cycle]), radio, config)
        response = (np.exp(1j * elements @ heard.direction.T) * heard.gain) @ delay_response(heard.tau, tones)
        mean_power[cycle] = np.mean(np.abs(response) ** 2)
    with np.errstate(divide="ignore"):
        return 10.0 * np.log10(mean_power * radio.energy / (num_samples * radio.noise_psd))
