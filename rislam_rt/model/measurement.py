"""Measurement of one cycle: the components that the receiver reports, and, kept apart, the true path of each."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Floats, Integers, freeze
from rislam_rt.geometry.angles import angles_from_direction


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """Measurement of one cycle: M multipath components, in no particular order. All that the agent gets to see.

    The angle of arrival is held as direction cosines along the array's axes (body frame): the errors of a planar array
    are Gaussian in them, the same at every angle, and do not wrap. The third cosine is not negative (array looks up).
    """

    tau: Floats
    """(M,) delay [s]."""
    cosines: Floats
    """(M, 2) direction cosines of the arriving ray along body x and y."""
    amplitude: Floats
    """(M,) magnitude |alpha| of the estimated path gain."""
    tau_std: Floats
    """(M,) standard deviation [s] of the delay, from the measured amplitude through the bound."""
    cosines_std: Floats
    """(M, 2) standard deviations of the direction cosines, likewise."""
    amplitude_std: Floats
    """(M,) standard deviation of the amplitude."""
    from_panel: Floats | None = None
    """(M,) probability that a component ran over a RIS panel, given that a path made it: what is found in the
    difference of a code and its phase-reversed partner did, unless motion within the slot left it there. None where the
    receiver does not alternate."""
    panel: Integers | None = None
    """(M,) number of the RIS panel that `from_panel` is about, the likeliest of several; None where there is one."""

    def __post_init__(self) -> None:
        count = len(np.asarray(self.tau))
        freeze(self, np.float64, tau=(count,), cosines=(count, 2), amplitude=(count,))
        freeze(self, np.float64, tau_std=(count,), cosines_std=(count, 2), amplitude_std=(count,))
        if self.from_panel is not None:
            freeze(self, np.float64, from_panel=(count,))
        if self.panel is not None:
            freeze(self, np.int64, panel=(count,))

    def __len__(self) -> int:
        return len(self.tau)

    def __repr__(self) -> str:
        span = f", {1e9 * self.tau.min():.3g} to {1e9 * self.tau.max():.3g} ns" if len(self) else ""
        return f"Measurement: {len(self)} components{span}"

    @property
    def arrival(self) -> Floats:
        """Unit vectors (M, 3) of a measurement's components in the body frame, from the Rx towards the arriving ray."""
        z = np.sqrt(np.clip(1.0 - np.sum(self.cosines**2, axis=-1), 0.0, None))
        vector = np.concatenate([self.cosines, z[:, None]], axis=-1)
        return vector / np.linalg.norm(vector, axis=-1, keepdims=True)

    @property
    def aoa(self) -> tuple[Floats, Floats]:
        """Measured angles of arrival theta_r, phi_r (M,) [rad] in the body frame."""
        return angles_from_direction(self.arrival)


@dataclass(frozen=True, slots=True, eq=False)
class PathTruth:
    """True path of each component of a measurement: its column among the paths (M,), -1 for clutter. For scoring only,
    never shown to the agent."""

    path: Integers

    def __post_init__(self) -> None:
        freeze(self, np.int64, path=(None,))
