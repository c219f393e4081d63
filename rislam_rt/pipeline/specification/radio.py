"""Settings of the radio, the table `[radio]` of a pipeline file, and their conversion to SI units."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from rislam_rt.errors import ConfigError
from rislam_rt.measurement import with_reference_snr
from rislam_rt.model import Antennas, RadioConfig, RxArray
from rislam_rt.pipeline.specification.section import Carrier, Decibel, Positive, Section, Side

Pattern = Literal["iso", "dipole", "hw_dipole", "tr38901"]
Polarization = Literal["V", "H"]


class ArraySection(Section):
    """Settings of the receive array: antennas, spacing, pattern."""

    rows: Side = 4
    """Number of antennas along the body's x axis, forward."""
    cols: Side = 4
    """Number of antennas along the body's y axis."""
    spacing_wavelengths: Annotated[float, Field(ge=1e-3, le=100.0)] = 0.5
    """Spacing of neighbouring antennas, in wavelengths of the carrier."""
    pattern: Literal["upper", "isotropic"] = "upper"
    """Half-space that the array receives from: all (`isotropic`), or nothing from below its plane (`upper`)."""


class RadioSection(Section):
    """Settings of the radio: carrier, band, antennas, energy, and noise (as a reference SNR or as a density)."""

    carrier_ghz: Carrier = 10.0
    """Carrier frequency."""
    bandwidth_ghz: Positive = 1.0
    """Bandwidth of a flat band; delays are resolved to its inverse."""
    tx_gain_db: Decibel = 0.0
    """Gain of the transmit antenna in all directions, besides its pattern."""
    rx_gain_db: Decibel = 0.0
    """Gain of each receive antenna in all directions that the array receives from, besides its pattern."""
    tx_pattern: Pattern = "iso"
    """Pattern of the transmit antenna: isotropic, short or half-wave dipole (upright), sector of 3GPP TR 38.901
    (ahead)."""
    rx_pattern: Pattern = "iso"
    """Pattern of each receive antenna; `radio.array.pattern` may make it blind below, besides."""
    tx_polarization: Polarization = "V"
    """Polarisation of the transmit antenna: vertical or horizontal."""
    rx_polarization: Polarization | None = None
    """Polarisation of the receive antennas; as the transmit antenna's if not given. A crossed link receives what
    reflections have turned."""
    energy_j: Positive = 1.0
    """Energy of one sounding; SNR follows from its ratio to the noise."""
    power_dbm: Decibel | None = None
    """Transmit power, instead of the energy: that is then power times `sounding_s`. Needs `noise_psd`."""
    sounding_s: Positive | None = None
    """Duration of one sounding, with `power_dbm`."""
    reference_snr_db: Decibel | None = None
    """SNR of the paper's sphere 3 m away, integrated over the signal and over all antennas; 13 if nothing is given."""
    noise_psd: Positive | None = None
    """Noise power spectral density N0 [W/Hz], instead of `reference_snr_db`."""
    array: ArraySection = ArraySection()

    @model_validator(mode="after")
    def _one_noise(self) -> "RadioSection":
        if self.reference_snr_db is not None and self.noise_psd is not None:
            raise ValueError("give 'reference_snr_db' or 'noise_psd', not both")
        return self

    @model_validator(mode="after")
    def _one_energy(self) -> "RadioSection":
        if self.power_dbm is None and self.sounding_s is None:
            return self
        if self.power_dbm is None or self.sounding_s is None:
            raise ValueError("give 'power_dbm' and 'sounding_s' together: energy is power times duration")
        if "energy_j" in self.model_fields_set and self.energy_j != RadioSection.model_fields["energy_j"].default:
            raise ValueError("give 'energy_j' or 'power_dbm', not both")
        if self.noise_psd is None:
            raise ValueError(
                "power_dbm: a reference SNR sets the noise by the energy, whatever that is; give 'noise_psd'"
            )
        return self

    @property
    def energy(self) -> float:
        """Energy [J] of one sounding by the radio's settings, given or power times duration."""
        if self.power_dbm is None or self.sounding_s is None:
            return self.energy_j
        return 1e-3 * linear(self.power_dbm) * self.sounding_s

    @property
    def antennas(self) -> Antennas:
        """Patterns and polarisations of the transmit and receive antennas by the radio's settings."""
        return Antennas(self.tx_pattern, self.rx_pattern, self.tx_polarization, self.rx_polarization or "")


def build_radio(section: RadioSection) -> RadioConfig:
    """Radio configuration in SI units and linear ratios from the table `[radio]` of a pipeline file.

    Raises
    ------
    ConfigError
        A value is out of range.
    """
    if section.bandwidth_ghz >= 2.0 * section.carrier_ghz:
        raise ConfigError(
            f"radio.bandwidth_ghz: {section.bandwidth_ghz:g} received with radio.carrier_ghz = {section.carrier_ghz:g};"
            " keep it below twice the carrier"
        )
    array = RxArray(section.array.rows, section.array.cols, section.array.spacing_wavelengths, section.array.pattern)
    radio = RadioConfig(
        carrier=section.carrier_ghz * 1e9, bandwidth=section.bandwidth_ghz * 1e9, tx_gain=linear(section.tx_gain_db),
        rx_gain=linear(section.rx_gain_db), energy=section.energy, array=array, antennas=section.antennas,
        **({} if section.noise_psd is None else {"noise_psd": section.noise_psd}),
    )  # fmt: skip
    if section.noise_psd is None:
        radio = with_reference_snr(radio, 13.0 if section.reference_snr_db is None else section.reference_snr_db)
    return radio


def linear(decibel: float) -> float:
    """Power ratio of a radio setting in decibels."""
    return float(np.power(10.0, decibel / 10.0))
