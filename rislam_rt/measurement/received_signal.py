"""The received signal, eq. `all`: one sounding per antenna, as tones or as samples of the flat pulse.

A sounding of M tones carries E / M each; tone m at antenna l is
`y[l, m] = sqrt(E / M) sum_i alpha_i b_l(i) exp(-j 2 pi f_m tau_i) + n`, n of variance N0. That is the unitary transform
of M samples at rate B, scaled by 1 / sqrt(B), whose noise has the variance N0 B.
"""

import numpy as np

from rislam_rt.arrays import Complexes, Floats, phasor
from rislam_rt.errors import ConfigError
from rislam_rt.measurement.config import MOST_TONES, ReceiverConfig
from rislam_rt.measurement.estimation.path_signals import tone_response
from rislam_rt.measurement.received_paths import Received
from rislam_rt.model import RadioConfig
from rislam_rt.waveform import delay_response, subcarrier_frequencies

SPARE = 1.25
"""Ratio of the sounding's period to the last delay, where the number of tones is not set: a quarter is left of room."""
FEWEST_TONES = 16
"""Smallest number of tones of a sounding that is not set."""


def num_tones(radio: RadioConfig, config: ReceiverConfig) -> int:
    """Number M of tones of a sounding: as set, or the power of two that leaves a quarter period beside the delays
    that are looked for.

    Raises
    ------
    ConfigError
        The last delay takes more than `MOST_TONES`.
    """
    if config.num_subcarriers:
        return config.num_subcarriers
    needed = max(SPARE * radio.bandwidth * (config.max_delay - min(config.min_delay, 0.0)), FEWEST_TONES)
    count = int(2 ** np.ceil(np.log2(needed)))
    if count > MOST_TONES:
        raise ConfigError(
            f"receiver.max_delay: {config.max_delay:g} s received, which take {count} tones over "
            f"{radio.bandwidth / 1e9:g} GHz, more than {MOST_TONES}; give less"
        )
    return count


def tones(received: Received, radio: RadioConfig, config: ReceiverConfig, elements: Floats | None = None) -> Complexes:
    """Noiseless received signal as tones (L, M) [sqrt(J)]; `elements` (L, 3) [wavelengths] are true positions."""
    count = num_tones(radio, config)
    frequencies = subcarrier_frequencies(count, radio.bandwidth)
    scale = np.sqrt(radio.energy / count)
    elements = radio.array.positions(1.0) if elements is None else elements
    if config.element_exact:
        return scale * _element_exact(received, radio, frequencies, elements)
    antennas = phasor(2.0 * np.pi * elements @ received.direction.T)
    return scale * (antennas * received.gain) @ tone_response(frequencies, received.tau).T


def to_tones(samples: Complexes, radio: RadioConfig) -> Complexes:
    """Transform received samples (..., M) [sqrt(W)] at rate B to tones (..., M) [sqrt(J)]; noise N0 B becomes N0."""
    count = samples.shape[-1]
    advance = np.exp(1j * np.pi * (count - 1) / count * np.arange(count))
    return np.fft.fft(samples * advance, axis=-1, norm="ortho") / np.sqrt(radio.bandwidth)


def to_samples(spectrum: Complexes, radio: RadioConfig) -> Complexes:
    """Transform tones (..., M) [sqrt(J)] to received samples (..., M) [sqrt(W)] at rate B; undoes `to_tones`."""
    count = spectrum.shape[-1]
    delay = np.exp(-1j * np.pi * (count - 1) / count * np.arange(count))
    return np.fft.ifft(spectrum, axis=-1, norm="ortho") * delay * np.sqrt(radio.bandwidth)


def add_noise(signal: Complexes, variance: float, *, rng: np.random.Generator) -> Complexes:
    """Add white circular Gaussian noise of this variance per complex sample: N0 for tones, N0 B for samples."""
    parts = rng.standard_normal((2, *signal.shape))
    return signal + np.sqrt(variance / 2.0) * (parts[0] + 1j * parts[1])


def convert(spectrum: Complexes, bits: int, radio: RadioConfig, clip_rms: float = 0.0) -> tuple[Complexes, float]:
    """Quantise the received signal's tones (L, M) by converters of `bits` bits for real and imaginary part, 0 for none.

    The converters see samples in time. Full scale is the largest sample of all, or `clip_rms` times the root mean
    square of a component; what lies above is cut off. Also returns the variance [J] that the steps add to a tone: a
    sixth of the squared step, which the receiver knows.
    """
    if not bits and not clip_rms:
        return spectrum, 0.0
    samples = to_samples(spectrum, radio)
    scale = max(float(np.abs(samples.real).max()), float(np.abs(samples.imag).max()), np.finfo(np.float64).tiny)
    if clip_rms:
        scale = clip_rms * float(np.sqrt(0.5 * np.mean(np.abs(samples) ** 2)))
    step = 2.0 * scale / 2**bits if bits else 0.0
    real, imag = (_mid_rise(np.clip(part, -scale, scale), step, bits) for part in (samples.real, samples.imag))
    return to_tones(real + 1j * imag, radio), step**2 / 6.0 / radio.bandwidth


def _mid_rise(value: Floats, step: float, bits: int) -> Floats:
    """Quantise values of the received signal to the levels of a mid-rise converter; 0 bits leave them as they are."""
    if not bits:
        return value
    level = np.clip(np.floor(value / step), -(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    return np.asarray((level + 0.5) * step)


def _element_exact(received: Received, radio: RadioConfig, frequencies: Floats, elements: Floats) -> Complexes:
    """Received signal (L, M) as a sum of spherical waves, each element at its own distance from the wave's source."""
    # No plane-wave and no narrow-band approximation: the phase is `-2 pi (f_c + f) (delay at the element)`, and the
    # part at the array's centre and the carrier is in the gain.
    source = received.direction * (received.wave_radius / radio.wavelength)[:, None]
    excess = np.linalg.norm(source - elements[:, None], axis=-1) - np.linalg.norm(source, axis=-1)
    response = np.zeros((len(elements), len(frequencies)), dtype=np.complex128)
    centre = received.gain * delay_response(received.tau, frequencies).T
    for row, longer in enumerate(excess):  # one antenna at a time keeps the phases of all paths in the cache
        phase = (1.0 + frequencies[:, None] / radio.carrier) * longer
        response[row] = np.sum(centre * np.exp(-2j * np.pi * phase), axis=-1)
    return response
