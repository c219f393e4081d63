"""Hardware faults of a receiver's front end: array errors, leakage residue, I/Q imbalance, phase noise, quantisation.

The chain of one capture, from the paths to the samples that the estimator gets: elements at other places than drawn;
coupling between them; gain and phase of each receive chain; what is left of the leakage after its cancellation, random
over band and antennas and the same in every cycle; phase noise; thermal noise; image of the quadrature mixers; gain
control and clipping; quantisation.
"""

from dataclasses import dataclass
from typing import Annotated, NamedTuple

import numpy as np
import scipy
from annotated_types import Ge, Le, Lt

from rislam_rt.arrays import Complexes, Floats
from rislam_rt.measurement.config import Bounded, ReceiverConfig
from rislam_rt.measurement.received_signal import add_noise, convert, num_tones, to_samples, to_tones
from rislam_rt.model import RadioConfig
from rislam_rt.ranges import check_ranges


@dataclass(frozen=True, slots=True)
class HardwareConfig:
    """Tolerances of a receiver's hardware faults, all 0 for an ideal front end; amplitude ratios: 0.01 is -40 dB."""

    gain_std_db: Bounded = 0.0
    """Standard deviation [dB] of the gain of an element and its receive chain."""
    phase_std_deg: Bounded = 0.0
    """Standard deviation [degrees] of the phase of an element and its receive chain."""
    position_std_m: Bounded = 0.0
    """Standard deviation [m] of an element's position along each axis."""
    coupling: Annotated[float, Ge(0.0), Lt(0.2)] = 0.0
    """Amplitude that an element takes from its nearest neighbours, below -14 dB; it falls with distance, and turns with
    it."""
    leakage_residue: Bounded = 0.0
    """Amplitude of what the cancellation leaves, over that of the leakage before it; independent over tones and
    antennas."""
    iq_image: Bounded = 0.0
    """Amplitude of the mixer's image of the band (I/Q imbalance), of a phase of its own in every receive chain."""
    phase_noise_deg: Bounded = 0.0
    """Root mean square [degrees] of the phase noise of single samples, the same in all chains."""
    phase_step_deg: Bounded = 0.0
    """Root mean square [degrees] of the common phase of one code's signal against the other's."""
    carrier_offset_hz: Annotated[float, Ge(-1e12), Le(1e12)] = 0.0
    """Carrier of the Tx less that of the Rx: turns all paths within the slot."""
    agc_std_db: Bounded = 0.0
    """Standard deviation [dB] of the gain control's gain from cycle to cycle, not reported."""
    clip_rms: Bounded = 0.0
    """Full scale of the converters over the root mean square of real or imaginary part; 0: the largest sample fits."""
    told: bool = False
    """Whether the estimator counts the expected power of all these faults as noise."""
    calibration_cycles: Annotated[int, Ge(0), Le(1_000_000_000_000)] = 0
    """Cycles at the start whose signals are recorded, to calibrate on the direct path and the walls; 0 for none."""

    def __post_init__(self) -> None:
        check_ranges("hardware", self)


class Correction(NamedTuple):
    """Correction of a front end's faults that calibration found, applied to samples (L, M)."""

    matrix: Complexes
    """(L, L) by which antennas are multiplied: the inverse of the array's matrix."""
    residue: Complexes
    """(L, M) [sqrt(J)] leakage residue that is subtracted first, at the energy E."""
    image: Complexes
    """(L,) amplitude of the mixer's image that is subtracted."""
    direct: Complexes
    """(L, M) signal of the direct path, of unit energy, on which the gain control's gain is measured."""
    loudness: float
    """Amplitude [sqrt(J)] of the direct path in the calibration, at the energy E; 0 leaves the gain as it is."""
    left: float
    """Share of the signal's power that the calibrated model leaves unexplained."""


class FrontEnd(NamedTuple):
    """One receiver's front end with the hardware faults that were drawn for it."""

    config: HardwareConfig
    offset: Floats
    """(L, 3) [wavelengths] offsets of the elements from their drawn positions."""
    matrix: Complexes
    """(L, L) coupling, gains and phases."""
    residue: Complexes
    """(L, M) left of a leakage of unit gain and unit energy a tone."""
    image: Complexes
    """(L,) amplitude of the mixer's image of the band."""
    correction: Correction | None = None
    """Correction by calibration, None if the front end is not calibrated."""


class SentSignal(NamedTuple):
    """Energy share, leakage and gain of one code's signal in a slot, for the front end that receives it."""

    unit: float
    """Root of the share of the slot's energy that the code's signal has."""
    leakage: complex
    """Gain of the direct path before its cancellation, times the root of the signal's energy a tone [sqrt(J)]."""
    swing: float = 1.0
    """Amplitude ratio of the gain control in this cycle."""


def build_front_end(
    config: HardwareConfig, radio: RadioConfig, receiver: ReceiverConfig, *, rng: np.random.Generator
) -> FrontEnd:
    """Draw the hardware faults of a receiver's front end within their tolerances, each with draws of its own."""
    array, count = radio.array, radio.array.num_antennas
    offset = config.position_std_m / radio.wavelength * rng.standard_normal((count, 3))
    loud = 10.0 ** (config.gain_std_db * rng.standard_normal(count) / 20.0)
    chain = loud * np.exp(1j * np.radians(config.phase_std_deg) * rng.standard_normal(count))
    turn = rng.uniform(-np.pi, np.pi)
    nothing = np.zeros((count, num_tones(radio, receiver)), dtype=np.complex128)
    residue = config.leakage_residue * add_noise(nothing, 1.0, rng=rng)
    image = config.iq_image * np.exp(1j * rng.uniform(-np.pi, np.pi, count))
    coupled = np.eye(count) + config.coupling * np.exp(1j * turn) * _neighbours(array.positions(1.0), array.spacing)
    return FrontEnd(config, offset, chain[:, None] * coupled, residue, image)


def digitise(
    clean: Complexes, sent: SentSignal, radio: RadioConfig, receiver: ReceiverConfig, front_end: FrontEnd | None,
    *, rng: np.random.Generator,
) -> tuple[Complexes, float]:  # fmt: skip
    """Received tones (L, M) after noise and hardware faults, from noiseless ones, and the noise variance [J] a tone
    that the estimator assumes."""
    if front_end is None:
        samples, extra = convert(add_noise(clean, radio.noise_psd, rng=rng), receiver.converter_bits, radio)
        return samples, radio.noise_psd + extra
    config, leakage = front_end.config, sent.leakage
    heard = front_end.matrix @ clean + leakage * front_end.residue
    noisy = add_noise(_with_phase_noise(heard, config, radio, rng), radio.noise_psd, rng=rng)
    mixed = sent.swing * (noisy + front_end.image[:, None] * image_spectrum(noisy))
    samples, extra = convert(mixed, receiver.converter_bits, radio, config.clip_rms)
    level = radio.noise_psd + extra
    if config.told:
        power = max(float(np.mean(np.abs(samples) ** 2)) - level, 0.0)
        left = None if front_end.correction is None else front_end.correction.left
        level += power * _distortion(config, radio, left)
        level += 0.0 if front_end.correction is not None else abs(leakage) ** 2 * config.leakage_residue**2
    if front_end.correction is not None:
        samples = correct(samples, sent.unit, front_end.correction)
    return samples, level


def correct(samples: Complexes, unit: float, correction: Correction) -> Complexes:
    """Correct received tones (L, M) by calibration: leakage residue, mixer's image, array errors and gain control.

    `unit` is the root of the energy a tone over that of a whole sounding.
    """
    plain = samples - correction.image[:, None] * image_spectrum(samples)
    if correction.loudness:
        direct = abs(np.vdot(correction.direct, plain))
        plain = plain * (unit * correction.loudness / max(direct, np.finfo(np.float64).tiny))
    return np.asarray(correction.matrix @ (plain - unit * correction.residue))


def draw_gain_variation(config: HardwareConfig, *, rng: np.random.Generator) -> float:
    """Draw a hardware fault: the gain control's gain in one cycle, an amplitude ratio."""
    return float(10.0 ** (config.agc_std_db * rng.standard_normal() / 20.0)) if config.agc_std_db else 1.0


def scaled_to_fit(samples: Complexes, other: Complexes) -> Complexes:
    """Scale samples (L, M) of a faulty front end by the complex factor that fits `other` best; both share direct path
    and wall returns."""
    return np.asarray(samples * (np.vdot(samples, other) / np.vdot(samples, samples)))


def image_spectrum(spectrum: Complexes) -> Complexes:
    """Image of a spectrum (..., M) by I/Q imbalance of the mixers: the conjugate tones in reverse order."""
    return np.conj(spectrum[..., ::-1])


def _with_phase_noise(
    spectrum: Complexes, config: HardwareConfig, radio: RadioConfig, rng: np.random.Generator
) -> Complexes:
    """Tones (L, M) with a hardware fault, the oscillator's phase noise from sample to sample and its phase step from
    code to code."""
    if config.phase_step_deg:
        spectrum = spectrum * np.exp(1j * np.radians(config.phase_step_deg) * rng.standard_normal())
    if not config.phase_noise_deg:
        return spectrum
    tremble = np.radians(config.phase_noise_deg) * rng.standard_normal(spectrum.shape[-1])
    return to_tones(to_samples(spectrum, radio) * np.exp(1j * tremble), radio)


def _neighbours(positions: Floats, spacing: float) -> Complexes:
    """Hardware fault of mutual coupling (L, L) of antennas relative to nearest neighbours': as one over the distance,
    with its phase."""
    distance = np.linalg.norm(positions[:, None] - positions, axis=-1)
    apart = np.where(distance > 0.0, distance, np.inf)
    phase = np.exp(-2j * np.pi * (np.where(distance > 0.0, distance, spacing) - spacing))
    return np.asarray(spacing / apart * phase)


def expected_distortion(
    config: HardwareConfig, radio: RadioConfig, receiver: ReceiverConfig, power: Floats, direct: Floats
) -> Floats:
    """Expected power (K,) [J] a tone of hardware faults, counted as noise where their tolerances are known.

    Of a calibrated front end only what no calibration takes out: phase noise and clipping.

    Parameters
    ----------
    power
        (K,) of all paths that the array hears, the sum of their squared gains.
    direct
        (K,) squared gain of the direct path before its cancellation.
    """
    share = _distortion(config, radio, 0.0 if config.calibration_cycles else None) * power
    residue = 0.0 if config.calibration_cycles else config.leakage_residue**2 * direct
    halves = 0.5 if receiver.alternation else 1.0  # each code has half of the energy
    return np.asarray(halves * radio.energy / num_tones(radio, receiver) * (share + residue))


def _distortion(config: HardwareConfig, radio: RadioConfig, left: float | None) -> float:
    """Power of multiplicative hardware faults relative to the signal's: by tolerances, or `left` by calibration."""
    trembling = np.radians(config.phase_noise_deg) ** 2 + _clipped(config.clip_rms)
    if left is not None:
        return float(trembling + left)
    gain = (np.log(10.0) / 20.0 * config.gain_std_db) ** 2 + np.radians(config.phase_std_deg) ** 2
    place = (2.0 * np.pi * config.position_std_m / radio.wavelength) ** 2
    neighbours = np.abs(_neighbours(radio.array.positions(1.0), radio.array.spacing)) ** 2
    return float(gain + place + config.coupling**2 * neighbours.sum(axis=1).mean() + config.iq_image**2 + trembling)


def _clipped(level: float) -> float:
    """Power of clipping errors of a converter (hardware), of a Gaussian signal clipped above `level` deviations,
    relative to its own."""
    if not level:
        return 0.0
    tail = 0.5 * scipy.special.erfc(level / np.sqrt(2.0))
    return float(2.0 * ((1.0 + level**2) * tail - level * np.exp(-0.5 * level**2) / np.sqrt(2.0 * np.pi)))
