"""The agent's radio: carrier, bandwidth, gains, noise, antennas with their patterns and polarisation, receive array."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.errors import ConfigError
from rislam_rt.ranges import Count, Positive, check_ranges

CARRIERS = (1e6, 3e12)
"""Least and largest carrier [Hz], as in a pipeline file."""
Pattern = Literal["iso", "dipole", "hw_dipole", "tr38901"]
"""Antenna patterns: isotropic, short and half-wave dipole along z, sector of 3GPP TR 38.901 (8 dBi, along body x)."""


@dataclass(frozen=True, slots=True)
class Antennas:
    """Antenna patterns of Tx and Rx, turned with the agent's heading, and their polarisation.

    Landmarks are isotropic and re-radiate the polarisation of the Tx; what walls have turned into another one than the
    Rx has is lost.
    """

    tx: Pattern = "iso"
    """Pattern of the Tx."""
    rx: Pattern = "iso"
    """Pattern of the Rx."""
    polarization: Literal["V", "H"] = "V"
    """Polarisation of the Tx, `V` or `H`."""
    rx_polarization: Literal["", "V", "H"] = ""
    """Polarisation of the Rx, `V` or `H`; empty: the Tx's. A crossed link receives only what walls have turned."""

    def __post_init__(self) -> None:
        check_ranges("antennas", self)

    @property
    def of_tx(self) -> tuple[str, str]:
        """Pattern and polarisation of the Tx antenna of the agent's radio."""
        return self.tx, self.polarization

    @property
    def of_rx(self) -> tuple[str, str]:
        """Pattern and polarisation of the Rx antenna of the agent's radio; polarised as the Tx's unless given."""
        return self.rx, self.rx_polarization or self.polarization

    @property
    def of_landmark(self) -> tuple[str, str]:
        """Pattern and polarisation with which a landmark re-radiates what the radio sends: isotropic, polarised as the
        Tx."""
        return "iso", self.polarization

    @property
    def plain(self) -> bool:
        """Whether the radio's antennas, Tx and Rx, are both isotropic and vertically polarised."""
        return self.of_tx == self.of_rx == ("iso", "V")


@dataclass(frozen=True, slots=True)
class RxArray:
    """Receive array of the agent: planar, in the body's x-y plane, boresight up, rows along body x and columns along
    body y.

    Elements are isotropic over the upper hemisphere and blind below it (`upper`), or isotropic (`isotropic`).
    A planar array cannot tell a direction from its mirror image in the array's plane; the blind side settles that.
    """

    rows: Count = 4
    cols: Count = 4
    spacing: Positive = 0.5
    """Distance between neighbouring elements, in wavelengths."""
    pattern: Literal["upper", "isotropic"] = "upper"
    """Element pattern, `upper` or `isotropic`."""

    def __post_init__(self) -> None:
        check_ranges("array", self)

    @property
    def num_antennas(self) -> int:
        """Number L of antennas of the radio's receive array."""
        return self.rows * self.cols

    @property
    def mirrored_signs(self) -> Floats:
        """Factors (2,) of a path's gain at the middle of the radio's array, were its cosine along each axis told
        1 / `spacing` away, where the array hears it alike: the middle of an even number of antennas lies half a
        spacing from the next one."""
        return np.where(np.array([self.rows, self.cols]) % 2 == 0, -1.0, 1.0)

    def receives(self, height: Floats, margin: float = 0.0) -> Booleans:
        """Whether the radio's array receives rays from cosines `height` (...,) to its boresight, to `margin` below its
        plane."""
        return np.asarray((height >= -margin) | (self.pattern != "upper"))

    def positions(self, wavelength: float) -> Floats:
        """Element positions (L, 3) [m] of the radio's receive array in the body frame, about its centre."""
        x = (np.arange(self.rows) - (self.rows - 1) / 2.0) * self.spacing * wavelength
        y = (np.arange(self.cols) - (self.cols - 1) / 2.0) * self.spacing * wavelength
        xx, yy = np.meshgrid(x, y, indexing="ij")
        return np.stack([xx.ravel(), yy.ravel(), np.zeros(xx.size)], axis=-1)


@dataclass(frozen=True, slots=True)
class RadioConfig:
    """Parameters of the agent's radio: carrier, bandwidth, gains, signal energy, noise and receive array. SI units;
    gains and ratios are linear."""

    carrier: Positive = 10e9
    """Carrier frequency [Hz]."""
    bandwidth: Positive = 1e9
    """Bandwidth of the flat band [Hz]."""
    tx_gain: Positive = 1.0
    """Power gain of the Tx antenna, the same in all directions; times the pattern in `antennas`."""
    rx_gain: Positive = 1.0
    """Power gain of the Rx antenna, the same in all directions; times the pattern in `antennas`."""
    energy: Positive = 1.0
    """E: energy of one sounding signal [J]."""
    noise_psd: Positive = 3.52e-11
    """N0: noise power spectral density [W/Hz]; by default the paper's sphere, 3 m away, has 13 dB over 16 antennas."""
    array: RxArray = field(default_factory=RxArray)
    antennas: Antennas = field(default_factory=Antennas)
    """Pattern and polarisation of Tx and Rx; isotropic and vertical by default."""

    def __post_init__(self) -> None:
        check_ranges("radio", self)
        if not CARRIERS[0] <= self.carrier <= CARRIERS[1]:
            wanted = f"{CARRIERS[0]:g} to {CARRIERS[1]:g} Hz, 10e9 for 10 GHz"
            raise ConfigError(f"radio.carrier: {self.carrier:g} Hz received; give {wanted}")
        if self.bandwidth >= 2.0 * self.carrier:
            raise ConfigError(f"radio.bandwidth: {self.bandwidth:g} Hz received; keep it below twice the carrier")

    @property
    def wavelength(self) -> float:
        """Wavelength of the radio's carrier [m]."""
        return SPEED_OF_LIGHT / self.carrier

    @property
    def effective_bandwidth_squared(self) -> float:
        """Square zeta^2 = B^2 / 12 [Hz^2] of the effective bandwidth of the radio's flat band."""
        return self.bandwidth**2 / 12.0

    def integrated_snr(self, gain: Floats | Complexes) -> Floats:
        """Integrated SNR L E |alpha|^2 / N0 (...,) of path gains alpha, over signal and L antennas, linear."""
        return self.array.num_antennas * self.energy * np.abs(gain) ** 2 / self.noise_psd
