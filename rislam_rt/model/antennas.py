"""Antennas of the agent: pattern and polarisation of either end."""

from dataclasses import dataclass

from rislam_rt.errors import ConfigError

PATTERNS = ("iso", "dipole", "hw_dipole", "tr38901")
"""Isotropic, short dipole, half-wave dipole (both along z), and the sector of 3GPP TR 38.901 (8 dBi, along body x)."""


@dataclass(frozen=True, slots=True)
class Antennas:
    """Patterns of Tx and Rx, turned with the agent's heading, and their polarisation.

    Landmarks are isotropic and re-radiate the polarisation of the Tx; what walls have turned into another one than the
    Rx has is lost.
    """

    tx: str = "iso"
    rx: str = "iso"
    polarization: str = "V"
    """`V` or `H`, of the Tx,"""
    rx_polarization: str = ""
    """...and of the Rx, where it is another: a crossed link hears only what walls have turned."""

    def __post_init__(self) -> None:
        for name in ("tx", "rx"):
            if getattr(self, name) not in PATTERNS:
                raise ConfigError(
                    f"antennas.{name}: '{getattr(self, name)}' received; give one of {', '.join(PATTERNS)}"
                )
        if self.polarization not in ("V", "H"):
            raise ConfigError(f"antennas.polarization: '{self.polarization}' received; give 'V' or 'H'")
        if self.rx_polarization not in ("", "V", "H"):
            raise ConfigError(f"antennas.rx_polarization: '{self.rx_polarization}' received; give 'V' or 'H'")

    @property
    def of_tx(self) -> tuple[str, str]:
        """Pattern and polarisation of the Tx."""
        return self.tx, self.polarization

    @property
    def of_rx(self) -> tuple[str, str]:
        """Pattern and polarisation of the Rx."""
        return self.rx, self.rx_polarization or self.polarization

    @property
    def of_landmark(self) -> tuple[str, str]:
        """Pattern and polarisation of what re-radiates."""
        return "iso", self.polarization

    @property
    def plain(self) -> bool:
        """Whether both ends are isotropic and vertical."""
        return self.of_tx == self.of_rx == ("iso", "V")
