"""Antennas of the agent, as Sionna RT has them."""

from dataclasses import dataclass

from rislam_rt.errors import ConfigError

PATTERNS = ("iso", "dipole", "hw_dipole", "tr38901")
"""Isotropic, short dipole, half-wave dipole (both along z), and the sector of 3GPP TR 38.901 (8 dBi, along body x)."""


@dataclass(frozen=True, slots=True)
class Antennas:
    """Patterns of Tx and Rx, turned with the agent's heading, and the polarisation of both.

    Landmarks are isotropic and re-radiate the same polarisation; what walls have turned into the other one is lost.
    """

    tx: str = "iso"
    rx: str = "iso"
    polarization: str = "V"
    """`V` or `H`."""

    def __post_init__(self) -> None:
        for name in ("tx", "rx"):
            if getattr(self, name) not in PATTERNS:
                raise ConfigError(
                    f"antennas.{name}: '{getattr(self, name)}' received; give one of {', '.join(PATTERNS)}"
                )
        if self.polarization not in ("V", "H"):
            raise ConfigError(f"antennas.polarization: '{self.polarization}' received; give 'V' or 'H'")

    @property
    def isotropic(self) -> bool:
        """Whether neither end prefers a direction."""
        return self.tx == self.rx == "iso"
