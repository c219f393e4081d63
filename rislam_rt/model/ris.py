"""The reconfigurable surface: what its controller tells the agent, where it hangs, and the code it is set to."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from rislam_rt.arrays import Floats, freeze
from rislam_rt.errors import ConfigError, SceneError


@dataclass(frozen=True, slots=True, eq=False)
class RisSpec:
    """Data sheet of a panel: all that its controller tells the agent. It does not say where the panel hangs.

    Rows run along `up`, columns along `right = up x normal`; element (n, m) lies at
    `center + (n - (N-1)/2) spacing[1] up + (m - (M-1)/2) spacing[0] right`.
    """

    rows: int
    cols: int
    spacing: Floats
    """(2,) [m]: between columns, between rows."""
    normal: Floats
    """(3,) unit vector out of the panel's front."""
    up: Floats
    """(3,) unit vector along a column, at right angles to `normal`."""
    levels: int = 4
    """H: number of phase levels, 2 pi / H apart."""
    element: str = "tang"
    """Element pattern: `tang` or `energy`."""
    amplitude: float = 1.0
    """A: reflection coefficient of an element."""

    def __post_init__(self) -> None:
        for name, shape in (("spacing", (2,)), ("normal", (3,)), ("up", (3,))):
            freeze(self, name, np.float64, shape)
        if self.rows < 1 or self.cols < 1:
            raise SceneError(f"ris.rows, ris.cols: {self.rows} x {self.cols} received; give at least 1 x 1")
        if not (self.spacing > 0.0).all():
            raise SceneError(f"ris.spacing_m: {self.spacing.tolist()} received; give two positive lengths")
        if self.levels < 2:
            raise SceneError(f"ris.levels: {self.levels} received; give at least 2")
        if self.element not in ("tang", "energy"):
            raise SceneError(f"ris.element: '{self.element}' received; give 'tang' or 'energy'")
        if not 0.0 < self.amplitude <= 1.0:
            raise SceneError(f"ris.amplitude: {self.amplitude} received; give a number in (0, 1]")
        if abs(np.linalg.norm(self.normal) - 1.0) > 1e-9 or abs(np.linalg.norm(self.up) - 1.0) > 1e-9:
            raise SceneError("ris.normal, ris.up: unit vectors needed")
        if abs(self.normal @ self.up) > 1e-9:
            raise SceneError("ris.up: not at right angles to ris.normal")

    @property
    def num_elements(self) -> int:
        """N M."""
        return self.rows * self.cols

    @property
    def right(self) -> Floats:
        """(3,) unit vector along a row."""
        return np.cross(self.up, self.normal)

    @property
    def diagonal(self) -> float:
        """D [m]: diagonal of the panel, each element counted with its full cell."""
        return float(np.hypot(self.cols * self.spacing[0], self.rows * self.spacing[1]))

    def offsets(self) -> Floats:
        """Element positions (N, M, 3) [m] about the panel's centre, in the room's axes; read-only."""
        return _offsets(self)


@lru_cache(maxsize=64)
def _offsets(spec: RisSpec) -> Floats:
    n = (np.arange(spec.rows) - (spec.rows - 1) / 2.0) * spec.spacing[1]
    m = (np.arange(spec.cols) - (spec.cols - 1) / 2.0) * spec.spacing[0]
    offsets = n[:, None, None] * spec.up + m[None, :, None] * spec.right
    offsets.flags.writeable = False
    return offsets


@dataclass(frozen=True, slots=True, eq=False)
class RisPanel:
    """A panel in its place (truth): data sheet, centre and the reflector it is mounted on."""

    spec: RisSpec
    center: Floats
    """(3,) [m]."""
    host: str | None = None
    """Name of the reflector behind the panel, if any."""
    name: str = "ris"

    def __post_init__(self) -> None:
        freeze(self, "center", np.float64, (3,))


@dataclass(frozen=True, slots=True, eq=False)
class RisCode:
    """A setting of the panel: level index (..., N, M) in 0..H-1; leading axes, if any, are cycles."""

    index: Any
    levels: int

    def __post_init__(self) -> None:
        index = np.array(self.index)
        if index.ndim < 2 or index.dtype.kind not in "iu":
            raise ConfigError(f"code: integer array (..., N, M) needed, {index.dtype} of shape {index.shape} received")
        if index.size and (index.min() < 0 or index.max() >= self.levels):
            raise ConfigError(f"code: levels {index.min()}..{index.max()} received; give 0..{self.levels - 1}")
        index = index.astype(np.int64)
        index.flags.writeable = False
        object.__setattr__(self, "index", index)

    @property
    def xi(self) -> Floats:
        """Phase shifts (..., N, M) [rad]; an element multiplies its signal by exp(-j xi)."""
        return self.index * (2.0 * np.pi / self.levels)
