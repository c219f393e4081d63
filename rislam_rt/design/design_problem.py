"""The design problem of a panel's code: responses of paths over the panel, gains of others, gradients, prior."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers, freeze
from rislam_rt.errors import ConfigError
from rislam_rt.information import range_information
from rislam_rt.model import RadioConfig


@dataclass(frozen=True, slots=True, eq=False)
class DesignProblem:
    """Design problem of a panel's code: minimise the agent's expected horizontal position CRLB over B samples of the
    belief, the mean of `tr((J_prior + sum_p w_p g_p g_p^T)^-1)`.

    `w_p = scale |alpha_p|^2 / (1 + scale |alpha_p|^2 variance_p)`: the information on the length of path p, where what
    the path's landmark and walls are not known to (`variance`) is added to its own error. With `least_power`,
    |alpha|^2 is multiplied by `1 / (1 + (least_power / |alpha|^2)^4)`, about the chance of detecting the path:
    information spread over paths that are then missed is worth nothing. With both left at zero this is Proposition 1.
    Path 0 of the panel paths is the direct one; it is the target of the single-target designers, which set the elements
    of each of several panels for its own direct path (`panels`). Elements of other panels have response 0.
    """

    response: Complexes
    """(B, P, N, M) gain of panel path p over element (n, m) at level 0: `alpha = sum response exp(-j xi)`."""
    static_gain: Complexes
    """(B, S) gains of the landmark paths that do not meet the panel."""
    gradient: Floats
    """(B, P + S, 2) horizontal gradients of the path lengths, panel paths first."""
    prior: Floats
    """(2, 2) prior information [1/m^2]."""
    scale: float
    """Information on a path's length per |alpha|^2 [1/m^2]: `8 pi^2 zeta^2 L E / (c^2 N0)`."""
    levels: int
    """Number H of phase levels."""
    variance: Any = None
    """(B, P + S) variance [m^2] of a path's predicted length; None is zero."""
    least_power: float = 0.0
    """|alpha|^2 at which a path is detected with probability one half; 0: all are."""
    panels: tuple[tuple[int, slice], ...] = ((0, slice(None)),)
    """For each panel the row of its direct path, and the span of its elements among all N M."""

    def __post_init__(self) -> None:
        freeze(self, np.complex128, response=(None, None, None, None))
        samples, panel = self.response.shape[:2]
        freeze(self, np.complex128, static_gain=(samples, None))
        count = panel + self.static_gain.shape[1]
        freeze(self, np.float64, gradient=(samples, count, 2), prior=(2, 2))
        if self.variance is not None:
            freeze(self, np.float64, variance=(samples, count))
        if samples < 1 or panel < 1:
            raise ConfigError(f"design: {samples} belief samples and {panel} panel paths received; give at least one")
        if not self.least_power >= 0.0:
            raise ConfigError(f"design: least power {self.least_power} received; give 0 or more")
        if self.levels < 2:
            raise ConfigError(f"design: {self.levels} levels received; give at least 2")

    @property
    def shape(self) -> tuple[int, int]:
        """Rows N and columns M of the panel's elements in a design problem."""
        return self.response.shape[2], self.response.shape[3]

    @property
    def target(self) -> Complexes:
        """Element responses (N M,) of a design problem's direct panel path at the first sample of the belief."""
        return self.response[0, 0].ravel()

    @property
    def targets(self) -> list[Complexes]:
        """For each panel of a design problem its elements' responses to its direct path, at the first sample."""
        return [self.response[0, row].ravel()[span] for row, span in self.panels]

    def owner(self) -> Integers:
        """Number (P,) of the panel over which each panel path of a design problem runs: whose elements respond."""
        elements = np.abs(self.response[0].reshape(self.response.shape[1], -1))
        return np.argmax([elements[:, span].max(axis=1) for _, span in self.panels], axis=0)


def problem_from_arrays(
    response: Complexes, static_gain: Complexes, gradient: Floats, radio: RadioConfig, levels: int,
    prior: Floats | None = None, least_snr: float = 0.0, panels: tuple[tuple[int, slice], ...] = ((0, slice(None)),),
) -> DesignProblem:  # fmt: skip
    """Design problem of a panel's code at one position of the agent, from plain arrays.

    Parameters
    ----------
    response
        (P, N, M) element responses of the panel paths, the direct one first.
    static_gain
        (S,) gains of the landmark paths that do not meet the panel.
    gradient
        (P + S, 2) horizontal gradients of the path lengths, panel paths first.
    prior
        (2, 2) information [1/m^2] beforehand; none by default.
    least_snr
        SNR over all antennas, linear, at which a path is detected with probability one half; 0: all paths count.
    panels
        Where there are several: as in `DesignProblem`.
    """
    unit_snr = float(radio.integrated_snr(np.ones(())))
    prior = np.zeros((2, 2)) if prior is None else prior
    return DesignProblem(
        response[None], static_gain[None], gradient[None], prior, float(range_information(np.array(unit_snr), radio)),
        levels, least_power=least_snr / unit_snr, panels=panels,
    )  # fmt: skip
