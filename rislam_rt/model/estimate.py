"""The agent's estimate: its pose, and a map of landmarks and walls. Filters write it, phase design reads it."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers, freeze, show_point
from rislam_rt.model.ris import RisCode
from rislam_rt.model.trajectory import Body


@dataclass(frozen=True, slots=True, eq=False)
class MapEstimate:
    """A filter's estimated map: N landmarks (points and mirror images) and W walls.

    A landmark without a parent is a point that scatters from where it is (a scatterer or the panel). One with a parent
    is the parent's mirror image in a wall: its paths run Tx, parent, image, Rx, and the reciprocal.
    """

    ident: Integers
    """(N,) number of the landmark, the same as long as the map holds it."""
    position: Floats
    """(N, 3) [m] estimated positions."""
    covariance: Floats
    """(N, 3, 3) [m^2] of the positions."""
    parent: Integers
    """(N,) row of the landmark whose mirror image this is, -1 for a point."""
    ris_probability: Floats
    """(N,) probability that the landmark is a RIS panel, of several panels the likeliest; 0 for images."""
    strength: Floats
    """(N,) estimated square root of the cross-section [m]; for an image, amplitude ratio to the parent's law."""
    wall_normal: Floats
    """(W, 3) unit normals of the walls, from the room's inside outwards as seen by the agent."""
    wall_offset: Floats
    """(W,) [m] offset of each wall's plane: `normal . x = offset`."""
    wall_std: Floats
    """(W, 2) standard deviations of angle [rad] and offset [m]."""
    panel: Any = None
    """(N,) number of the RIS panel that `ris_probability` is about; None: 0, the only panel."""

    def __post_init__(self) -> None:
        count, walls = len(np.asarray(self.ident)), len(np.asarray(self.wall_offset))
        freeze(self, np.int64, ident=(count,), parent=(count,))
        freeze(self, np.float64, position=(count, 3), covariance=(count, 3, 3))
        freeze(self, np.float64, ris_probability=(count,), strength=(count,))
        freeze(self, np.float64, wall_normal=(walls, 3), wall_offset=(walls,), wall_std=(walls, 2))
        if self.panel is not None:
            freeze(self, np.int64, panel=(count,))

    def __repr__(self) -> str:
        known = int(np.sum(self.ris_probability > 0.5))
        points, panel = int(np.sum(self.parent < 0)), ("panel not known", "panel known")[known > 0]
        panel = f"{known} panels known" if known > 1 else panel
        images = len(self.ident) - points
        return f"MapEstimate: {points} landmarks, {images} images, {len(self.wall_offset)} walls, {panel}"

    @property
    def ris(self) -> int:
        """Row of an estimated map's landmark that is identified as the (first) RIS panel; -1 if none is."""
        return self.panel_row(0)

    def panel_row(self, panel: int) -> int:
        """Row of the map's landmark that is identified as a RIS panel (probability above one half), -1 if none is."""
        number = np.zeros(len(self.ident)) if self.panel is None else self.panel
        probability = np.where(number == panel, self.ris_probability, 0.0)
        best = int(np.argmax(probability)) if len(probability) else -1
        return best if best >= 0 and probability[best] > 0.5 else -1


class PanelCandidate(NamedTuple):
    """Position that may be that of a RIS panel which the map does not hold yet; the search code is aimed at it."""

    position: Floats
    """(3,) [m]."""
    samples: Floats
    """(S, 3) [m] equally likely samples of its place."""
    real: float
    """Probability that it is a path, and not false components one after the other."""
    is_panel: float
    """Probability that, if so, it is the direct path over the panel, and neither a scatterer's nor over walls."""
    again: float = 0.0
    """Probability that, if so, the code under which it was last heard lights it again; 0 where that is not known."""
    code: RisCode | None = None
    """That code, of all panels; None where it is not known."""
    told: bool = False
    """Whether the receiver tells, by alternated codes, that it is over the panel."""
    examined: bool = False
    """Whether what it is was asked already, and left open."""
    panel: int = 0
    """Number of the RIS panel that it may be."""
    clear: float = 1.0
    """Probability that nothing hides it in the next cycle."""


@dataclass(frozen=True, slots=True, eq=False)
class SlamEstimate:
    """Estimated pose and map of a SLAM filter after a cycle, or predicted for the next."""

    position: Floats
    """(3,) [m] of the agent."""
    velocity: Floats
    """(3,) [m/s] of the agent."""
    heading: float
    """[rad]."""
    covariance: Floats
    """(6, 6) covariance of position and velocity."""
    samples: Floats
    """(S, 3) [m] agent positions drawn from the belief, equally likely; design averages over them."""
    body: Body
    map: MapEstimate
    suspects: tuple[PanelCandidate, ...] = ()
    """Panel candidates: at most one for each RIS panel that the map holds no landmark for; empty where no code is to be
    designed (see `slam.predict`)."""
    heading_std: float | None = None
    """[rad] standard deviation of the heading; None where the filter says none."""

    def __post_init__(self) -> None:
        freeze(self, np.float64, position=(3,), velocity=(3,), covariance=(6, 6), samples=(None, 3))

    def __repr__(self) -> str:
        std = float(np.sqrt(np.trace(self.covariance[:2, :2])))
        return f"SlamEstimate: at {show_point(self.position)} m, horizontal deviation {std:.2g} m; {self.map!r}"


def pose_estimate(
    position: Floats, velocity: Floats, heading: float, covariance: Floats, body: Body, known: MapEstimate | None = None
) -> SlamEstimate:
    """`SlamEstimate` of a pose without a filter: position (3,) [m], velocity (3,) [m/s], heading [rad] and covariance
    (6, 6); an empty map if none is given."""
    return SlamEstimate(position, velocity, heading, covariance, np.asarray(position)[None], body, known or empty_map())


def empty_map() -> MapEstimate:
    """Estimated map without landmarks and walls."""
    none: list[Any] = []
    return MapEstimate(
        np.array(none), np.zeros((0, 3)), np.zeros((0, 3, 3)), np.array(none), np.array(none), np.array(none),
        np.zeros((0, 3)), np.array(none), np.zeros((0, 2)),
    )  # fmt: skip
