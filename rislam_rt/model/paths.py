"""Propagation paths over a trajectory: one column for each path identity, one row for each cycle."""

from copy import copy
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats, Integers, freeze, frozen
from rislam_rt.geometry.angles import angles_from_direction


class PathKind(IntEnum):
    """Kinds of propagation paths: direct (LOS), over walls alone (VT), over a point scatterer (PS) or a RIS panel
    (RIS), and the last two with walls as well (VS, VRIS). VS and VRIS hold the reciprocal (walls on the Tx leg) and the
    class with walls on both legs."""

    LOS = 0
    VT = 1
    PS = 2
    VS = 3
    RIS = 4
    VRIS = 5


COURSE = ("valid", "tau", "departure", "arrival", "gain", "vertices")
"""Fields of `Paths` that have a row for each cycle."""


@dataclass(frozen=True, slots=True, eq=False)
class RisLegs:
    """Response of each RIS element on the legs of paths over a panel, from the Tx and to the Rx; 0 at elements of other
    panels.

    With the code's phases xi the gain of the path over Tx leg i and Rx leg j is
    `sum_nm tx[k, i, n, m] exp(-j xi[n, m]) rx[k, j, n, m]`: linear in exp(-j xi), so a new code needs no new trace.
    """

    tx: Complexes
    """(K, I, N, M) of the I legs between Tx and panel."""
    rx: Complexes
    """(K, J, N, M) of the J legs between panel and Rx."""
    tx_leg: Integers
    """(P,) Tx leg of each path, -1 where the path does not meet a panel."""
    rx_leg: Integers
    """(P,) Rx leg of each path, -1 where the path does not meet a panel."""
    spans: tuple[slice, ...] = (slice(None),)
    """Slice of each RIS panel's elements among the elements of all panels, counted row by row."""

    def __post_init__(self) -> None:
        freeze(self, np.complex128, tx=(None, None, None, None), rx=(None, None, None, None))
        freeze(self, np.int64, tx_leg=(None,), rx_leg=(len(self.tx_leg),))


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """Propagation paths of P identities over K cycles. Where `valid` is False the other entries are zero and mean
    nothing.

    A path's identity is (kind, landmark, tx_walls, rx_walls), walls in the order of travel; no two columns share one.
    """

    kind: Integers
    """(P,) values of `PathKind`."""
    landmark: Integers
    """(P,) index into `landmarks`, -1 for LOS and VT."""
    tx_walls: Integers
    """(P, D) walls between Tx and landmark (for VT: all walls), padded with -1."""
    rx_walls: Integers
    """(P, D) walls between landmark and Rx, padded with -1."""
    valid: Booleans
    """(K, P) whether the path exists in the cycle."""
    tau: Floats
    """(K, P) delay [s]."""
    departure: Floats
    """(K, P, 3) unit vector away from the Tx (AoD)."""
    arrival: Floats
    """(K, P, 3) unit vector from the Rx towards the arriving ray (AoA)."""
    gain: Complexes
    """(K, P), carrier phase exp(-j 2 pi f tau) included; panel paths under the code last applied (zero at first)."""
    vertices: Floats
    """(K, P, V, 3) [m] interaction points in the order of travel; `num_vertices` of them count."""
    num_vertices: Integers
    """(P,) number of interaction points."""
    walls: tuple[str, ...]
    """Names of the walls; a wall is a reflector's plane, `name` or `name#facet`."""
    landmarks: tuple[str, ...]
    """Names of the landmarks: the scatterers, then the RIS panels."""
    ris: RisLegs | None = None
    """Element responses of the paths over RIS panels; None in a room without one."""
    source: str = ""
    """How the set was found: `traced`, `traced, refined` or `image source`, and among which wall sequences."""
    num_panels: int = 1
    """Number of RIS panels of the room, the last of `landmarks`; 1 in a room without one, where it plays no part."""

    def __post_init__(self) -> None:
        cycles, paths = np.shape(self.valid)
        freeze(self, np.int64, kind=(paths,), landmark=(paths,), tx_walls=(paths, None), rx_walls=(paths, None))
        freeze(self, np.bool_, valid=(cycles, paths))
        freeze(self, np.float64, tau=(cycles, paths), departure=(cycles, paths, 3), arrival=(cycles, paths, 3))
        freeze(self, np.complex128, gain=(cycles, paths))
        freeze(self, np.float64, vertices=(cycles, paths, None, 3))
        freeze(self, np.int64, num_vertices=(paths,))

    def __repr__(self) -> str:
        classes = ", ".join(f"{kind.name} {count}" for kind in PathKind if (count := int(np.sum(self.kind == kind))))
        present = self.valid.sum(axis=1)
        at_once = f"{present.min()} to {present.max()} at a time" if len(present) else "no cycle"
        source = f" ({self.source})" if self.source else ""
        return f"Paths{source}: {self.num_cycles} cycles, {self.num_paths} identities ({classes}), {at_once}"

    @property
    def num_cycles(self) -> int:
        """Number K of cycles of the propagation paths."""
        return self.valid.shape[0]

    @property
    def num_paths(self) -> int:
        """Number P of path identities, the columns of a set of propagation paths."""
        return self.valid.shape[1]

    @property
    def aod(self) -> tuple[Floats, Floats]:
        """Angles of departure theta_t, phi_t (K, P) [rad] of propagation paths."""
        return angles_from_direction(self.departure)

    @property
    def aoa(self) -> tuple[Floats, Floats]:
        """Angles of arrival theta_r, phi_r (K, P) [rad] of propagation paths."""
        return angles_from_direction(self.arrival)

    @property
    def panel(self) -> Integers:
        """(P,) number of the RIS panel that each propagation path meets, -1 for none."""
        over_panel = (self.kind == PathKind.RIS) | (self.kind == PathKind.VRIS)
        first = len(self.landmarks) - self.num_panels if self.num_panels > 1 else self.landmark
        return np.where(over_panel, self.landmark - first, -1)

    def identity(self, path: int) -> tuple[int, int, tuple[int, ...], tuple[int, ...]]:
        """Identity (kind, landmark, tx_walls, rx_walls) of one propagation path, without padding."""
        tx = tuple(w for w in self.tx_walls[path].tolist() if w >= 0)
        rx = tuple(w for w in self.rx_walls[path].tolist() if w >= 0)
        return int(self.kind[path]), int(self.landmark[path]), tx, rx

    def label(self, path: int) -> str:
        """Text of a path's identity, e.g. `VS wall_y0 sphere | wall_x0`: walls of the Rx leg after the bar."""
        kind, landmark, tx, rx = self.identity(path)
        names = [self.walls[w] for w in tx] + ([self.landmarks[landmark]] if landmark >= 0 else [])
        text = " ".join([PathKind(kind).name, *names])
        return f"{text} | {' '.join(self.walls[w] for w in rx)}" if rx else text

    def of_cycle(self, cycle: int) -> "Paths":
        """Propagation paths of one cycle alone, as views: nothing is copied and checked again."""
        one, paths = slice(cycle, cycle + 1), copy(self)
        for name in COURSE:
            object.__setattr__(paths, name, getattr(self, name)[one])
        if self.ris is not None:
            legs = copy(self.ris)
            for name in ("tx", "rx"):
                object.__setattr__(legs, name, getattr(self.ris, name)[one])
            object.__setattr__(paths, "ris", legs)
        return paths

    def with_gain(self, gain: Any) -> "Paths":
        """The same propagation paths with other gains (K, P); all else is shared, not copied and checked again."""
        paths = copy(self)
        object.__setattr__(paths, "gain", frozen(gain, np.complex128, self.valid.shape, "Paths.gain"))
        return paths
