"""The agent's trajectory, and its body: the offsets of Tx and Rx."""

from dataclasses import dataclass, field

import numpy as np

from rislam_rt.arrays import Floats, Integers, freeze, show_point
from rislam_rt.errors import GeometryError


def _default_offset() -> Floats:
    """Default offset (3,) [m] of the Rx in the body: half of 0.1 m, turned 0.5 rad, or paths would hit edges."""
    return np.array([0.05 * np.cos(0.5), 0.05 * np.sin(0.5), 0.0])


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """The agent's body: offsets (3,) [m] of Tx and Rx array centre from its position, in the body frame (x forward).

    Those of the paper if left out: Rx at (0.0439, 0.0240, 0), Tx opposite; an agent of another make is given its own.
    """

    tx_offset: Floats = field(default_factory=lambda: -_default_offset())
    rx_offset: Floats = field(default_factory=_default_offset)

    def __post_init__(self) -> None:
        freeze(self, np.float64, tx_offset=(3,), rx_offset=(3,))
        if np.linalg.norm(self.tx_offset - self.rx_offset) < 1e-6:
            raise GeometryError("tx_offset_m, rx_offset_m: Tx and Rx coincide; keep them apart")

    def ends(self, position: Floats, heading: Floats) -> tuple[Floats, Floats]:
        """Positions (..., 3) [m] of Tx and Rx for agent positions (..., 3) [m] and headings (...,) [rad]."""
        cos, sin = np.cos(heading), np.sin(heading)
        turned = np.empty((2, *np.shape(heading), 3))
        for found, (x, y, z) in zip(turned, (self.tx_offset, self.rx_offset), strict=True):
            found[..., 0], found[..., 1], found[..., 2] = cos * x - sin * y, sin * x + cos * y, z
        return position + turned[0], position + turned[1]


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Trajectory of the agent over K cycles; `position` is the midpoint of Tx and Rx when the offsets are opposite."""

    time: Floats
    """(K,) [s]."""
    position: Floats
    """(K, 3) [m]."""
    velocity: Floats
    """(K, 3) [m/s]."""
    heading: Floats
    """(K,) [rad], about z."""
    body: Body = field(default_factory=Body)

    def __post_init__(self) -> None:
        freeze(self, np.float64, time=(None,))
        count = len(self.time)
        freeze(self, np.float64, position=(count, 3), velocity=(count, 3), heading=(count,))

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        if not len(self):
            return "Trajectory: no cycles"
        length = np.linalg.norm(np.diff(self.position, axis=0), axis=1).sum()
        ends = f"from {show_point(self.position[0])} to {show_point(self.position[-1])} m"
        return f"Trajectory: {len(self)} cycles, {self.time[0]:g} to {self.time[-1]:g} s, {length:.3g} m {ends}"

    def __getitem__(self, cycles: slice | Integers) -> "Trajectory":
        return Trajectory(
            self.time[cycles], self.position[cycles], self.velocity[cycles], self.heading[cycles], self.body
        )

    @property
    def elapsed(self) -> Floats:
        """Times (K,) [s] since a trajectory's first cycle; time stamps may count from the epoch."""
        return np.asarray(self.time - self.time[:1])

    @property
    def tx(self) -> Floats:
        """Positions (K, 3) [m] of the Tx along a trajectory."""
        return self.body.ends(self.position, self.heading)[0]

    @property
    def rx(self) -> Floats:
        """Positions (K, 3) [m] of the Rx along a trajectory."""
        return self.body.ends(self.position, self.heading)[1]
