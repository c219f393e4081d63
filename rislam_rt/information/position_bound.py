"""Fisher information of resolved paths on the position (Proposition 1), gradients of path lengths, position bound."""

from enum import IntEnum
from typing import Literal, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.constants import SPEED_OF_LIGHT
from rislam_rt.geometry.angles import unit
from rislam_rt.model import RadioConfig


class Outcome(IntEnum):
    """Outcome of a bound or a code design: whether it exists, and why not."""

    OK = 0
    """The bound exists."""
    UNOBSERVABLE = 1
    """The information is singular: some direction is not seen at all, and the bound is infinite."""
    DEGENERATE = 2
    """Two paths coincide in delay and angle, so that their own gains cannot be told apart."""
    NO_PATHS = 3
    """No path carries any power: for a design, none of them meets the panel."""


SINGULAR = 1e-13
"""Ratio of smallest to largest eigenvalue below which float64 cannot tell an information matrix from a singular one."""


class PositionBound(NamedTuple):
    """Cramér-Rao bound of the agent's position, and whether it exists."""

    variance: Floats
    """(...,) trace of the inverse information [m^2]; infinite where it does not exist."""
    outcome: Integers
    """(...,) values of `Outcome`."""

    @property
    def rms(self) -> Floats:
        """Position error bound (...,) [m]: root of the trace of the covariance bound."""
        return np.sqrt(self.variance)


def range_information(snr: Floats, radio: RadioConfig) -> Floats:
    """Fisher information (...,) [1/m^2] on a resolved path's length from its SNR (...,) over all antennas, linear.

    `8 pi^2 zeta^2 / c^2 SNR`, the factor before `g g^T` in eq. `derived`.
    """
    return 8.0 * np.pi**2 * radio.effective_bandwidth_squared / SPEED_OF_LIGHT**2 * np.asarray(snr)


def position_information(gradient: Floats, snr: Floats, radio: RadioConfig) -> Floats:
    """Fisher information `J_p` (..., D, D) [1/m^2] on the position of eq. `derived`, from paths that do not overlap.

    Parameters
    ----------
    gradient
        (..., P, D) of the path lengths; D = 2 for the paper's horizontal position.
    snr
        (..., P) `L E |alpha|^2 / N0`, linear; 0 for a path that is not there.
    """
    weighted = gradient * range_information(snr, radio)[..., None]
    return np.swapaxes(weighted, -1, -2) @ gradient


def position_bound(information: Floats, prior: Floats | float = 0.0) -> PositionBound:
    """Cramér-Rao bound `tr((J + J_prior)^-1)` of a position from information matrices (..., D, D) [1/m^2] and a prior.

    Outcomes: `NO_PATHS` where there is no information at all, `UNOBSERVABLE` where it is singular.
    """
    value = np.linalg.eigvalsh(information + np.asarray(prior))
    largest, smallest = value[..., -1], value[..., 0]
    outcome = np.where(smallest > SINGULAR * largest, int(Outcome.OK), int(Outcome.UNOBSERVABLE))
    outcome = np.where(largest > 0.0, outcome, int(Outcome.NO_PATHS))
    usable = (outcome == Outcome.OK)[..., None]
    variance = np.where(usable[..., 0], (1.0 / np.where(usable, value, 1.0)).sum(axis=-1), np.inf)
    return PositionBound(variance, outcome)


GradientMode = Literal["exact", "paper", "paper_legs", "appendix"]
"""Forms of a path length's gradient by the agent's position (see `vertex_gradient`)."""


def vertex_gradient(
    tx: Floats, rx: Floats, vertices: Floats, num_vertices: Integers, *, mode: GradientMode = "exact",
    landmark: Integers | int = 0,
) -> Floats:  # fmt: skip
    """Gradients (..., P, 3) of path lengths by the agent's position, from the paths' interaction points.

    Parameters
    ----------
    tx, rx
        (..., 3) [m].
    vertices
        (..., P, V, 3) [m] in the order of travel.
    num_vertices
        (P,) number of vertices of each path; 0 is the line of sight.
    mode
        `exact`; `paper`: sum of all segments' unit vectors in the sense of travel (nu, kappa of eq. `derived`);
        `paper_legs`: the same sum, the segments of both legs pointing from the landmark to the agent, as eq. `derived`
        names no sense; `appendix`: the last segment alone (H of Appendix B).
    landmark
        (P,) position of the landmark among each path's vertices, for `paper_legs`: the number of walls on its Tx leg.
    """
    tx, rx = (np.broadcast_to(end[..., None, :], (*vertices.shape[:-2], 3)) for end in (tx, rx))
    points = np.concatenate([tx[..., None, :], vertices, rx[..., None, :]], axis=-2)
    count = np.asarray(num_vertices)
    # the Rx closes the path right after its last vertex
    step = np.arange(points.shape[-2])
    points = np.where((step > count[:, None])[..., None], rx[..., None, :], points)
    segment = unit(np.diff(points, axis=-2))
    if mode == "paper":
        return segment.sum(axis=-2)
    if mode == "paper_legs":
        before = step[:-1] <= np.broadcast_to(landmark, count.shape)[:, None]
        return np.where(before[..., None], -segment, segment).sum(axis=-2)
    last = np.take_along_axis(segment, np.broadcast_to(count[:, None, None], (*vertices.shape[:-2], 1, 3)), axis=-2)
    if mode == "appendix":
        return last[..., 0, :]
    return last[..., 0, :] - segment[..., 0, :]
