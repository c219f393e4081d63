"""Antennas of the agent: pattern and polarisation of Tx and Rx."""

from dataclasses import dataclass

from rislam_rt.errors import ConfigError

PATTERNS = ("iso", "dipole", "hw_dipole", "tr38901")
"""Antenna patterns: isotropic, short and half-wave dipole along z, sector of 3GPP TR 38.901 (8 dBi, along body x)."""


@dataclass(frozen=True, slots=True)
class Antennas:
    """Antenna patterns of Tx and Rx, turned with the agent's heading, and their polarisation.

    Landmarks are isotropic and re-radiate the polarisation of the Tx; what walls have turned into another one than the
    Rx has is lost.
    """

    tx: str = "iso"
    """Pattern of the Tx, one of `PATTERNS`."""
    rx: str = "iso"
    """Pattern of the Rx, one of `PATTERNS`."""
    polarization: str = "V"
    """Polarisation of the Tx, `V` or `H`."""
    rx_polarization: str = ""
    """Polarisation of the Rx, `V` or `H`; empty: the Tx's. A crossed link receives only what walls have turned."""

    def __post_init__(self) -> None:
        for name in ("tx", "rx"):
            pattern = getattr(self, name)
            if pattern not in PATTERNS:
                raise ConfigError(f"antennas.{name}: '{pattern}' received; give one of {', '.join(PATTERNS)}")
        if self.polarization not in ("V", "H"):
            raise ConfigError(f"antennas.polarization: '{self.polarization}' received; give 'V' or 'H'")
        if self.rx_polarization not in ("", "V", "H"):
            raise ConfigError(f"antennas.rx_polarization: '{self.rx_polarization}' received; give 'V' or 'H'")

    @property
    def of_tx(self) -> tuple[str, str]:
        """Pattern and polarisation of the agent's Tx antenna."""
        return self.tx, self.polarization

    @property
    def of_rx(self) -> tuple[str, str]:
        """Pattern and polarisation of the agent's Rx antenna."""
        return self.rx, self.rx_polarization or self.polarization

    @property
    def of_landmark(self) -> tuple[str, str]:
        """Pattern and polarisation with which a landmark re-radiates: isotropic, polarised as the Tx."""
        return "iso", self.polarization

    @property
    def plain(self) -> bool:
        """Whether the antennas of Tx and Rx are both isotropic and vertically polarised."""
        return self.of_tx == self.of_rx == ("iso", "V")
