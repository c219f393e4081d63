"""Accuracy of a resolved path's measurement: delay, direction cosines of the planar array, amplitude."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.information.position_bound import range_information
from rislam_rt.model import RadioConfig, RxArray


class MeasurementStd(NamedTuple):
    """Cramér-Rao bounds, as standard deviations, of a resolved path's delay and direction cosines."""

    tau: Floats
    """(...,) [s] delay."""
    cosines: Floats
    """(..., 2) direction cosines along body x and y."""


def measurement_std(snr_integrated: Floats, radio: RadioConfig) -> MeasurementStd:
    """Cramér-Rao bounds of delay and cosines of resolved paths at integrated SNRs (...,), `L E |alpha|^2 / N0`.

    `var tau = 1 / (8 pi^2 zeta^2 SNR)`; `cosine_information` for the angles. Infinite where the SNR is 0 and for a
    cosine along which the array has no extent.
    """
    snr = np.asarray(snr_integrated, dtype=np.float64)
    with np.errstate(divide="ignore"):
        tau = 1.0 / np.sqrt(SPEED_OF_LIGHT**2 * range_information(snr, radio))
        cosines = 1.0 / np.sqrt(cosine_information(snr / radio.array.num_antennas, radio))
    return MeasurementStd(tau, cosines)


def cosine_information(snr_per_antenna: Floats, radio: RadioConfig) -> Floats:
    """Fisher information (..., 2) on the direction cosines along the array's rows and columns, the phase unknown.

    `2 SNR (2 pi / lambda)^2 sum_l x_l^2` with the element positions about their centre. For a line of L elements d
    apart this is the familiar `var(phi) = 6 / (SNR L (L^2 - 1) (2 pi d cos(phi) / lambda)^2)`.
    """
    spread = _aperture(radio.array, radio.wavelength)
    return 2.0 * (2.0 * np.pi / radio.wavelength) ** 2 * np.asarray(snr_per_antenna)[..., None] * spread


@lru_cache(maxsize=64)
def _aperture(array: RxArray, wavelength: float) -> Floats:
    """Second moments (2,) [m^2] `sum_l x_l^2` of the array along both axes, from which accuracy follows; read-only."""
    positions = array.positions(wavelength)[:, :2]
    spread = np.sum((positions - positions.mean(axis=0)) ** 2, axis=0)
    spread.flags.writeable = False
    return np.asarray(spread)


def amplitude_std(radio: RadioConfig) -> float:
    """Standard deviation of a resolved path's measured amplitude |alpha|: `sqrt(N0 / (2 L E))`, whatever its value."""
    return float(np.sqrt(radio.noise_psd / (2.0 * radio.array.num_antennas * radio.energy)))
