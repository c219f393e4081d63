"""Objective of the code design, the expected CRLB of the position, laid out to value many codes by one matrix
product."""

from dataclasses import dataclass

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.design.design_problem import DesignProblem
from rislam_rt.information import Outcome


@dataclass(frozen=True, slots=True, eq=False)
class Objective:
    """Expected CRLB of a `DesignProblem` as a function of the code, with all that no code changes precomputed."""

    matrix: Complexes
    """(N M, B P) from element weights to gains of the panel paths."""
    outer: Floats
    """(B, P, 3) xx, xy, yy of scale g g^T: information of a panel path of unit power."""
    fixed: Floats
    """(B, 3) xx, xy, yy of the information of prior and static paths."""
    spread: Floats | None
    """(B P,) scale times variance of the panel paths; None where all are zero."""
    least_power: float
    """|alpha|^2 at which a path is detected with probability one half; 0: all are."""
    table: Complexes
    """(H,) element weights exp(-j xi) of the levels."""
    outcome: Outcome
    """`UNOBSERVABLE` if no code makes the information regular: then the objective is `1 / tr J`."""

    def gains(self, weight: Complexes) -> Complexes:
        """Gains (..., B P) of panel paths, for the objective, at all samples under element weights (..., N M)."""
        return weight @ self.matrix

    def value(self, gain: Complexes) -> Floats:
        """Objective, the expected CRLB (...,) [m^2], of the panel paths' gains (..., B P)."""
        power = detected_power(gain.real**2 + gain.imag**2, self.least_power)
        if self.spread is not None:
            power = power / (1.0 + power * self.spread)
        return self.value_of_power(power)

    def value_of_power(self, power: Floats) -> Floats:
        """Objective, the expected CRLB (...,) [m^2], of the panel paths' (discounted) powers (..., B P)."""
        samples, paths, _ = self.outer.shape
        if samples == 1:
            information = power @ self.outer[0] + self.fixed[0]
            return self._inverse_trace(information)
        information = np.swapaxes(power.reshape(*power.shape[:-1], samples, 1, paths) @ self.outer, -1, -2)[..., 0]
        return self._inverse_trace(information + self.fixed).mean(axis=-1)

    def of_index(self, index: Integers) -> Floats:
        """Objective, the expected CRLB (...,) [m^2], of codes (..., N M) given as levels."""
        return self.value(self.gains(self.table.take(index)))

    def _inverse_trace(self, information: Floats) -> Floats:
        """Objective from information matrices (..., 3): the trace (...,) of the inverse; 1 / trace of them where
        unobservable."""
        xx, xy, yy = information[..., 0], information[..., 1], information[..., 2]
        trace = xx + yy
        if self.outcome is Outcome.UNOBSERVABLE:
            return 1.0 / np.maximum(trace, _TINY)
        # rounding may push the determinant of a nearly singular matrix below zero
        return trace / np.maximum(xx * yy - xy * xy, _RELATIVE * trace * trace + _TINY)


_TINY = 1e-280
_RELATIVE = 1e-14
SINGULAR = 1e-12
"""det / tr^2 below which the best reachable information still counts as singular."""


def build_objective(problem: DesignProblem) -> Objective:
    """Precompute the objective of a design problem; the outcome tells whether a code makes the position observable."""
    samples, panel = problem.response.shape[:2]
    matrix = np.ascontiguousarray(problem.response.reshape(samples * panel, -1).T)
    x, y = problem.gradient[..., 0], problem.gradient[..., 1]
    outer = problem.scale * np.stack([x * x, x * y, y * y], axis=-1)
    power = detected_power(np.abs(problem.static_gain) ** 2, problem.least_power)
    spread = None
    if problem.variance is not None and np.any(problem.variance > 0.0):
        spread = problem.scale * problem.variance
        power = power / (1.0 + power * spread[:, panel:])
        spread = np.ascontiguousarray(spread[:, :panel].reshape(-1))
    prior = problem.prior[[0, 0, 1], [0, 1, 1]]
    fixed = prior + np.einsum("bs,bsk->bk", power, outer[:, panel:])
    most = np.abs(problem.response).sum(axis=(2, 3)) ** 2
    best = fixed + np.einsum("bp,bpk->bk", most, outer[:, :panel])
    determinant = best[:, 0] * best[:, 2] - best[:, 1] ** 2
    regular = determinant > SINGULAR * (best[:, 0] + best[:, 2]) ** 2
    return Objective(
        matrix, np.ascontiguousarray(outer[:, :panel]), fixed, spread, problem.least_power,
        np.exp(-2j * np.pi / problem.levels * np.arange(problem.levels)),
        Outcome.OK if regular.all() else Outcome.UNOBSERVABLE,
    )  # fmt: skip


def detected_power(power: Floats, least: float) -> Floats:
    """Path powers (...,) in the objective times about the detection probability, `1 / (1 + (least / power)^4)`."""
    if least == 0.0:
        return power
    ratio = (power / least) ** 2
    ratio = ratio * ratio
    return power * (ratio / (1.0 + ratio))


def relaxation_bound(objective: Objective, best: Floats) -> float:
    """Lower bound [m^2] of the expected CRLB over all codes, against which designers are valued, from the paths' own
    best gains (B, P).

    The information of these gains exceeds that of every code (as matrices), and the trace of the inverse falls with it.
    """
    return float(objective.value(best.reshape(-1).astype(np.complex128)))
