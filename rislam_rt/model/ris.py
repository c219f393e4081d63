"""Reconfigurable surfaces (RIS): what their controller tells the agent, where they hang, and the code they are set
to."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeAlias

import numpy as np

from rislam_rt.arrays import Complexes, Floats, freeze
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
        """N M, elements of a RIS."""
        return self.rows * self.cols

    @property
    def right(self) -> Floats:
        """(3,) unit vector along a row of a RIS."""
        return np.cross(self.up, self.normal)

    @property
    def diagonal(self) -> float:
        """D [m]: diagonal of the panel, each element counted with its full cell."""
        return float(np.hypot(self.cols * self.spacing[0], self.rows * self.spacing[1]))

    @property
    def panels(self) -> "tuple[RisSpec, ...]":
        """This RIS panel alone."""
        return (self,)

    def span(self, panel: int) -> slice:
        """Where a RIS panel's elements stand among all, row by row: everywhere."""
        return slice(0, self.num_elements)

    def parts(self, code: "RisCode") -> "tuple[RisCode, ...]":
        """The code of each panel: the code itself."""
        return (code,)

    def place(self, panel: int, response: Complexes) -> Complexes:
        """Element responses (..., N, M) of a panel among those of all: themselves."""
        return response

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
class RisSpecs:
    """Data sheets of several panels that one controller sets: one code for all their elements.

    The code is one row of elements (1, E): those of the first panel row by row, then those of the next. A path over a
    panel has response 0 at the elements of the others, so that all that is linear in `exp(-j xi)` stays as it is.
    """

    panels: tuple[RisSpec, ...]

    def __post_init__(self) -> None:
        if len(self.panels) < 2:
            raise SceneError(f"ris: {len(self.panels)} panels received; give two or more, or the panel itself")
        levels = [panel.levels for panel in self.panels]
        if len(set(levels)) > 1:
            raise SceneError(f"ris.levels: {levels} received; give all panels of a room the same number of levels")

    @property
    def rows(self) -> int:
        """1: the elements stand in one row."""
        return 1

    @property
    def cols(self) -> int:
        """E."""
        return self.num_elements

    @property
    def num_elements(self) -> int:
        """E, elements of all RIS panels."""
        return sum(panel.num_elements for panel in self.panels)

    @property
    def levels(self) -> int:
        """H: phase levels, the same for all panels."""
        return self.panels[0].levels

    def span(self, panel: int) -> slice:
        """Where one RIS panel's elements stand in the row of all."""
        first = sum(other.num_elements for other in self.panels[:panel])
        return slice(first, first + self.panels[panel].num_elements)

    def parts(self, code: "RisCode") -> "tuple[RisCode, ...]":
        """The code (..., N, M) of each RIS panel."""
        rows = [code.index[..., 0, self.span(panel)] for panel in range(len(self.panels))]
        shapes = [(*row.shape[:-1], panel.rows, panel.cols) for row, panel in zip(rows, self.panels, strict=True)]
        return tuple(RisCode(row.reshape(shape), code.levels) for row, shape in zip(rows, shapes, strict=True))

    def place(self, panel: int, response: Complexes) -> Complexes:
        """Element responses (..., N, M) of a panel among those of all (..., 1, E): 0 at the others."""
        whole = np.zeros((*response.shape[:-2], 1, self.num_elements), dtype=response.dtype)
        whole[..., 0, self.span(panel)] = response.reshape(*response.shape[:-2], -1)
        return whole


DataSheet: TypeAlias = RisSpec | RisSpecs
"""What the agent is told of the panel, or of the panels."""


def join_sheets(sheets: tuple[RisSpec, ...]) -> DataSheet:
    """One data sheet of one or more RIS panels."""
    return sheets[0] if len(sheets) == 1 else RisSpecs(sheets)


def join_codes(codes: "tuple[RisCode, ...]") -> "RisCode":
    """One code of all RIS panels from the code (..., N, M) of each; that of a single panel is taken as it is."""
    if len(codes) == 1:
        return codes[0]
    rows = [code.index.reshape(*code.index.shape[:-2], 1, -1) for code in codes]
    return RisCode(np.concatenate(rows, axis=-1), codes[0].levels)


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

    @property
    def panels(self) -> "tuple[RisPanel, ...]":
        """This panel alone."""
        return (self,)


@dataclass(frozen=True, slots=True, eq=False)
class RisPanels:
    """Several panels of one room (truth), in the order of the scene file."""

    panels: tuple[RisPanel, ...]

    def __post_init__(self) -> None:
        names = [panel.name for panel in self.panels]
        if len(set(names)) < len(names):
            raise SceneError(f"ris.name: {', '.join(names)} received; give every panel a name of its own")
        RisSpecs(tuple(panel.spec for panel in self.panels))

    @property
    def spec(self) -> RisSpecs:
        """Their data sheets."""
        return RisSpecs(tuple(panel.spec for panel in self.panels))


def join_panels(panels: tuple[RisPanel, ...]) -> RisPanel | RisPanels | None:
    """The RIS panels of a room as a scene holds them: none, one, or several."""
    return RisPanels(panels) if len(panels) > 1 else panels[0] if panels else None


@dataclass(frozen=True, slots=True, eq=False)
class RisCode:
    """A setting of the panel: level index (..., N, M) in 0..H-1; leading axes, if any, are cycles.

    One of several panels has all their elements in one row, (..., 1, E): see `RisSpecs`.
    """

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
