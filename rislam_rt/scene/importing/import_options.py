"""Options of an import: what a user can say about a mesh or floor plan that is to become a room."""

from dataclasses import dataclass, field
from typing import Any

from rislam_rt.constants import SPEED_OF_LIGHT

CONCRETE = {"itu": "concrete", "thickness_m": 0.2}
"""Material of an imported room where nothing is known of it."""


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """Options of an import; lengths that follow from the carrier are said in wavelengths."""

    units: str | None = None
    """Unit of the file; None: metres, if the room then has the size of one."""
    up: str | None = None
    """Axis of the file that points up; None: y for glTF, as its standard says, else z."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """[m] in metres, z up: the point that becomes the room's zero."""
    carrier_ghz: float = 10.0
    detail: float = 3.0
    """[wavelengths] Flat regions narrower than this do not reflect like a plane: they hide."""
    curved: str = "shade"
    """What cylinders become: `shade`, occluders, or `planes`, flat sides that reflect."""
    max_walls: int = 150
    """Most walls that reflect, the widest; the others become occluders: image sources take time with walls."""
    scan: bool | None = None
    """Whether the mesh is a scan, with noise and holes; None: as it looks."""
    fill: float = 1.0
    """[m^2] Holes of a scan up to this are gaps of the scan; larger ones are openings."""
    materials: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Tables of materials by name or pattern of wall, node or material of the file."""
    rest: dict[str, Any] = field(default_factory=lambda: dict(CONCRETE))
    """Material of all walls of which nothing is known."""

    @property
    def wavelength(self) -> float:
        """Wavelength [m] of the carrier that a room is imported for."""
        return SPEED_OF_LIGHT / (1e9 * self.carrier_ghz)

    @property
    def narrow(self) -> float:
        """Width [m] below which a flat region of an imported mesh does not reflect like a plane."""
        return self.detail * self.wavelength
