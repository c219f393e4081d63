"""Calibration of a front end on the direct path and the walls, from signals recorded while the agent moves.

The direct path's delay and direction are known from the body's drawing: it gives every chain's gain and phase. Walls
come from other directions, found by the estimator itself; what the antennas make of them gives the rest of the array's
matrix, in which coupling and misplaced elements show. All other paths turn by many cycles while the agent moves: what
stays is what the cancellation leaves of the leakage, and what turns with the mirrored band is the mixers'.
Ghosts are kept out of the model as in the self-calibration of radio telescopes (Pearson and Readhead, Annu. Rev.
Astron. Astrophys. 22, 1984): strong paths first, fainter ones as the array gets better known.
"""

from collections.abc import Sequence

import numpy as np

from rislam_rt.arrays import Complexes
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.measurement.config import ReceiverConfig
from rislam_rt.measurement.estimation.detect import MatchedFilterGrid, build_grid
from rislam_rt.measurement.estimation.estimate import estimate_paths
from rislam_rt.measurement.estimation.path_signals import Sounding, build_sounding, waves_at
from rislam_rt.measurement.estimation.refine import fit_amplitudes
from rislam_rt.measurement.hardware import Correction, image_spectrum
from rislam_rt.measurement.received_signal import num_tones
from rislam_rt.model import Body, RadioConfig

FAINTEST = (0.3, 0.1, 0.03, 0.01, 0.003)
"""Amplitude ratio to the strongest path within `GHOST_CELLS` below which a path is taken for that one's ghost, round by
round: the better the array is known, the fainter its ghosts."""
GHOST_CELLS = 1.5
"""Resolution cells of delay within which an array's errors make ghosts of a path."""
LOUD = 100.0
"""SNR over all antennas above which a path is used (20 dB): its direction is known to a tenth of a beam."""
MOST = 60
"""Largest number of paths estimated in one cycle."""
STRAY, LEAST_STRAY = 0.1, 1e-3
"""Prior standard deviation of the coupling amplitude between two elements, in the first round and at least; in between
it is as found in the last round."""


def calibrate(
    samples: Sequence[Complexes], body: Body, radio: RadioConfig, config: ReceiverConfig, *, swinging: bool = False
) -> Correction:
    """Calibrate a front end: the correction of its faults from the samples (L, M) of several cycles at full energy.

    Parameters
    ----------
    body
        Offsets of Tx and Rx: length and direction of the direct path.
    swinging
        Whether the gain changes from cycle to cycle; it is then measured on the direct path.
    """
    sounding = build_sounding(num_tones(radio, config), radio)
    window = (config.min_delay * radio.bandwidth, config.max_delay * radio.bandwidth)
    grid, span = build_grid(sounding, window), body.tx_offset - body.rx_offset
    length = float(np.linalg.norm(span))
    place = np.array([[length / SPEED_OF_LIGHT * radio.bandwidth, *(span[:2] / length)]])  # of the direct path
    unit = np.full(1, 1.0 / np.sqrt(sounding.num_samples), dtype=np.complex128)
    direct = waves_at(sounding, place).sum(unit)
    heard = np.array(samples)
    loudness = 0.0
    if swinging:
        level = np.abs(np.einsum("lm,tlm->t", direct.conj(), heard))
        loudness = float(np.median(level))
        heard = heard * (loudness / level)[:, None, None]
    chains = np.sum(heard.mean(axis=0) * direct.conj(), axis=1)
    matrix = np.diag(np.asarray(chains / np.mean(chains)))  # gain and phase of every chain, of mean one
    residue: Complexes = np.zeros_like(heard[0])
    image = np.zeros(len(residue), dtype=np.complex128)
    spread, stray = float(np.mean(np.abs(heard) ** 2)), STRAY
    for faintest in FAINTEST:
        plain, inverse = heard - image[:, None] * image_spectrum(heard) - residue, np.linalg.inv(matrix)
        drawn = np.array(
            [_ideal_samples(inverse @ one, sounding, grid, window, radio.noise_psd, faintest) for one in plain]
        )
        matrix = _array_matrix(plain, drawn, matrix, spread, stray)
        stray = max(float(np.sqrt(np.mean(np.abs(matrix - np.diag(np.diag(matrix))) ** 2))), LEAST_STRAY)
        model = matrix @ drawn
        image = _image(heard - residue - model, heard)
        rest = heard - image[:, None] * image_spectrum(heard) - model
        residue, spread = _constant_residue(rest)
    left = max(spread - radio.noise_psd, 0.0) / float(np.mean(np.abs(heard - residue) ** 2))
    return Correction(np.asarray(np.linalg.inv(matrix)), residue, image, direct, loudness, left)


def _ideal_samples(
    samples: Complexes, sounding: Sounding, grid: MatchedFilterGrid, window: tuple[float, float], noise: float,
    faintest: float,
) -> Complexes:  # fmt: skip
    """Samples (L, M) that an ideal array would receive of the strong paths in calibrated samples, without ghosts."""
    scaled = samples / np.sqrt(noise)
    found = estimate_paths(sounding, grid, scaled, LOUD, window, MOST)
    delay, strength = found.parameters[:, 0], np.abs(found.amplitude)
    near = np.abs(delay[:, None] - delay) < GHOST_CELLS
    # none so much weaker than one of about its delay that it may be its ghost
    kept = found.parameters[strength >= faintest * np.max(near * strength, axis=1, initial=0.0)]
    fit = fit_amplitudes(sounding, kept, scaled)
    return fit.waves.sum(fit.amplitude * np.sqrt(noise))


def _array_matrix(plain: Complexes, drawn: Complexes, matrix: Complexes, spread: float, stray: float) -> Complexes:
    """Array matrix (L, L) of coupling and chain gains by calibration: regularised least squares from ideal to received
    (T, L, M)."""
    # The prior is the diagonal of `matrix`, of deviation `stray` for every entry; `spread` is the variance of a tone's
    # misfit.
    prior = spread / stray**2
    left = np.einsum("tlm,tkm->lk", plain, drawn.conj()) + prior * np.diag(np.diag(matrix))
    right = np.einsum("tlm,tkm->lk", drawn, drawn.conj()) + prior * np.eye(len(matrix))
    return np.asarray(np.linalg.solve(right.T, left.T).T)


def _constant_residue(rest: Complexes) -> tuple[Complexes, float]:
    """Leakage residue (L, M) by calibration, constant part of unexplained samples (T, L, M), and the rest's
    variance."""
    mean = rest.mean(axis=0)
    spread = float(np.mean(np.abs(rest - mean) ** 2)) * len(rest) / max(len(rest) - 1, 1)
    power = float(np.mean(np.abs(mean) ** 2))
    return mean * max(1.0 - spread / len(rest) / power, 0.0), spread


def _image(rest: Complexes, heard: Complexes) -> Complexes:
    """Complex amplitude (L,) of the mixers' image of the band by calibration, from unexplained and received samples (T,
    L, M)."""
    # At rest an image is the same as a chain's gain.
    rest, other = (part - part.mean(axis=0) for part in (rest, image_spectrum(heard)))
    return np.asarray(np.einsum("tlm,tlm->l", rest, other.conj()) / np.sum(np.abs(other) ** 2, axis=(0, 2)))
