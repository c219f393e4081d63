"""Reconfigurable intelligent surfaces (RIS): data sheets of panels, their true places, and their phase codes."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal, TypeAlias

import numpy as np
from annotated_types import Ge

from rislam_rt.arrays import Complexes, Floats, cross, freeze
from rislam_rt.errors import ConfigError, SceneError
from rislam_rt.ranges import Count, Share, check_ranges

ElementPattern = Literal["tang", "energy"]
"""Pattern of a RIS panel's elements: the paper's, or that of a perfect plate."""


@dataclass(frozen=True, slots=True, eq=False)
class RisSpec:
    """Data sheet of a RIS panel: all that its controller tells the agent. It does not say where the panel hangs.

    Rows run along `up`, columns along `right = up x normal`; element (n, m) lies at
    `center + (n - (N-1)/2) spacing[1] up + (m - (M-1)/2) spacing[0] right`.
    """

    rows: Count
    cols: Count
    spacing: Floats
    """(2,) [m] distances between columns and between rows."""
    normal: Floats
    """(3,) unit vector out of the panel's front."""
    up: Floats
    """(3,) unit vector along a column, at right angles to `normal`."""
    levels: Annotated[int, Ge(2)] = 4
    """H: number of phase levels, 2 pi / H apart."""
    element: ElementPattern = "tang"
    amplitude: Share = 1.0
    """A: reflection coefficient of an element."""

    def __post_init__(self) -> None:
        freeze(self, np.float64, spacing=(2,), normal=(3,), up=(3,))
        check_ranges("ris", self, SceneError)
        if not (self.spacing > 0.0).all():
            raise SceneError(f"ris.spacing_m: {self.spacing.tolist()} received; give two positive lengths")
        if abs(np.linalg.norm(self.normal) - 1.0) > 1e-9 or abs(np.linalg.norm(self.up) - 1.0) > 1e-9:
            raise SceneError("ris.normal, ris.up: unit vectors needed")
        if abs(self.normal @ self.up) > 1e-9:
            raise SceneError("ris.up: not at right angles to ris.normal")

    @property
    def num_elements(self) -> int:
        """Number N M of elements of a RIS panel."""
        return self.rows * self.cols

    @property
    def right(self) -> Floats:
        """Unit vector (3,) along a row of a RIS panel's elements."""
        return cross(self.up, self.normal)

    @property
    def diagonal(self) -> float:
        """Diagonal D [m] of a RIS panel, each element counted with its full cell."""
        return float(np.hypot(self.cols * self.spacing[0], self.rows * self.spacing[1]))

    @property
    def panels(self) -> "tuple[RisSpec, ...]":
        """Data sheets of the single RIS panels: here this one alone."""
        return (self,)

    def span(self, panel: int) -> slice:
        """Slice of one RIS panel's elements among those of all panels: here all elements, as there is one panel."""
        return slice(0, self.num_elements)

    def parts(self, code: "RisCode") -> "tuple[RisCode, ...]":
        """Phase codes of the single RIS panels in a code for all of them: here the code itself."""
        return (code,)

    def place(self, panel: int, response: Complexes) -> Complexes:
        """Put a RIS panel's element responses (..., N, M) among those of all panels: here they stay as they are."""
        return response

    def offsets(self) -> Floats:
        """Element positions (N, M, 3) [m] of a RIS panel about its centre, in the room's axes; read-only."""
        return _offsets(self)


@lru_cache(maxsize=64)
def _offsets(spec: RisSpec) -> Floats:
    """Element positions (N, M, 3) [m] of a RIS panel about its centre, computed once for each data sheet."""
    n = (np.arange(spec.rows) - (spec.rows - 1) / 2.0) * spec.spacing[1]
    m = (np.arange(spec.cols) - (spec.cols - 1) / 2.0) * spec.spacing[0]
    offsets = n[:, None, None] * spec.up + m[None, :, None] * spec.right
    offsets.flags.writeable = False
    return offsets


@dataclass(frozen=True, slots=True, eq=False)
class RisSpecs:
    """Data sheets of several RIS panels that one controller sets: one code for all their elements.

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
        """Number of rows in which the elements of several RIS panels are counted: 1."""
        return 1

    @property
    def cols(self) -> int:
        """Number E of columns in which the elements of several RIS panels are counted: all stand in one row."""
        return self.num_elements

    @property
    def num_elements(self) -> int:
        """Number E of elements of all RIS panels together."""
        return sum(panel.num_elements for panel in self.panels)

    @property
    def levels(self) -> int:
        """Number H of phase levels, the same for all RIS panels of a room."""
        return self.panels[0].levels

    def span(self, panel: int) -> slice:
        """Slice of one RIS panel's elements in the row of the elements of all panels."""
        first = sum(other.num_elements for other in self.panels[:panel])
        return slice(first, first + self.panels[panel].num_elements)

    def parts(self, code: "RisCode") -> "tuple[RisCode, ...]":
        """Phase code (..., N, M) of each single RIS panel, cut from the code (..., 1, E) for all of them."""
        rows = [code.index[..., 0, self.span(panel)] for panel in range(len(self.panels))]
        shapes = [(*row.shape[:-1], panel.rows, panel.cols) for row, panel in zip(rows, self.panels, strict=True)]
        return tuple(RisCode(row.reshape(shape), code.levels) for row, shape in zip(rows, shapes, strict=True))

    def place(self, panel: int, response: Complexes) -> Complexes:
        """Put a RIS panel's responses (..., N, M) into the row (..., 1, E) of all panels' elements: 0 at the others."""
        whole = np.zeros((*response.shape[:-2], 1, self.num_elements), dtype=response.dtype)
        whole[..., 0, self.span(panel)] = response.reshape(*response.shape[:-2], -1)
        return whole


DataSheet: TypeAlias = RisSpec | RisSpecs
"""Data sheet of one RIS panel, or of several that have one code."""


def join_sheets(sheets: tuple[RisSpec, ...]) -> DataSheet:
    """Join the data sheets of one or more RIS panels into one."""
    return sheets[0] if len(sheets) == 1 else RisSpecs(sheets)


def join_codes(codes: "tuple[RisCode, ...]") -> "RisCode":
    """Join the phase codes (..., N, M) of RIS panels into one for all; a single one stays as it is."""
    if len(codes) == 1:
        return codes[0]
    rows = [code.index.reshape(*code.index.shape[:-2], 1, -1) for code in codes]
    return RisCode(np.concatenate(rows, axis=-1), codes[0].levels)


@dataclass(frozen=True, slots=True, eq=False)
class RisPanel:
    """A RIS panel in its true place: data sheet, centre, and the reflector that it is mounted on."""

    spec: RisSpec
    center: Floats
    """(3,) [m] of the panel's elements."""
    host: str | None = None
    """Name of the reflector behind the panel, if any."""
    name: str = "ris"

    def __post_init__(self) -> None:
        freeze(self, np.float64, center=(3,))

    @property
    def panels(self) -> "tuple[RisPanel, ...]":
        """The RIS panels of the room: here this one alone."""
        return (self,)


@dataclass(frozen=True, slots=True, eq=False)
class RisPanels:
    """Several RIS panels of one room in their true places, in the order of the scene file."""

    panels: tuple[RisPanel, ...]

    def __post_init__(self) -> None:
        names = [panel.name for panel in self.panels]
        if len(set(names)) < len(names):
            raise SceneError(f"ris.name: {', '.join(names)} received; give every panel a name of its own")
        RisSpecs(tuple(panel.spec for panel in self.panels))

    @property
    def spec(self) -> RisSpecs:
        """Data sheets of a room's RIS panels as one."""
        return RisSpecs(tuple(panel.spec for panel in self.panels))


def join_panels(panels: tuple[RisPanel, ...]) -> RisPanel | RisPanels | None:
    """The RIS panels of a room as `Scene.ris` holds them: None, one `RisPanel`, or `RisPanels`."""
    return RisPanels(panels) if len(panels) > 1 else panels[0] if panels else None


@dataclass(frozen=True, slots=True, eq=False)
class RisCode:
    """Phase code of a RIS panel: level index (..., N, M) in 0..H-1 of each element; leading axes, if any, are cycles.

    The code of several panels has all their elements in one row, (..., 1, E): see `RisSpecs`.
    """

    index: Any
    """(..., N, M) integers in 0..H-1."""
    levels: int
    """H: number of phase levels, 2 pi / H apart."""

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
        """Phase shifts (..., N, M) [rad] of a RIS panel's elements; an element multiplies its signal by exp(-j xi)."""
        return self.index * (2.0 * np.pi / self.levels)
