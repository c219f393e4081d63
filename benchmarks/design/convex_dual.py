"""A tighter lower bound of the multi-path objective: what paths cost each other, by convex duality.

For every symmetric Y, `tr J^-1 >= 2 tr Y - tr(Y J Y)`, with equality at Y = J^-1. With J = J_0 + sum_p s |r_p w|^2 g g'
a code w takes away at most the largest value of `sum_p c_p |r_p w|^2`, c_p = s |Y g_p|^2. A share of each c_p is met by
the path's own discrete optimum, the rest by `(sum_n d_n) lambda_max(A D^-1 A^H)`, the dual of the semidefinite
relaxation over phases. Y, the shares and d are free: every choice gives a valid bound, and the largest is sought.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.design.design_problem import DesignProblem
from rislam_rt.design.designers import best_magnitudes
from rislam_rt.design.objective import build_objective

_TINY = 1e-300


def dual_bound(problem: DesignProblem, index: Integers, *, iterations: int = 300) -> float:
    """Lower bound [m^2] of the expected CRLB of every code; takes about a second, `relaxation_bound` microseconds.

    Parameters
    ----------
    index
        (N, M) or (N M,) the best code known, where the search for the bound starts.
    iterations
        Of each of three rounds of the search; the bound is valid after any number.

    Detection and the landmarks' uncertainty are left out, which can only lower the bound.
    """
    from scipy.optimize import minimize  # half a second of import that no other designer needs

    objective = build_objective(problem)
    code = objective.table[np.ravel(index)]
    power = np.abs(objective.gains(code)) ** 2
    samples, paths, _ = objective.outer.shape
    information = _matrix(np.einsum("bp,bpk->bk", power.reshape(samples, paths), objective.outer) + objective.fixed)
    value = float(np.trace(np.linalg.inv(information), axis1=1, axis2=2).mean())
    # lengths in units of the code's own bound, so that everything the search sees is of order one
    setting = _Setting(
        response=problem.response.reshape(samples * paths, -1),
        gradient=problem.gradient[:, :paths],
        fixed=_matrix(objective.fixed) * value,
        scale=problem.scale * value / samples,
        best=best_magnitudes(problem).ravel() ** 2,
    )
    inverse: Floats = np.linalg.inv(information * value).astype(np.float64)
    free = _start(setting, inverse, code)
    least = 0.0
    for sharpness in (30.0, 300.0, 3000.0):
        found = minimize(
            _negative_bound, free, (setting, sharpness), jac=True, method="L-BFGS-B", options={"maxiter": iterations}
        )
        free = found.x
        least = max(least, -_negative_bound(free, setting, np.inf)[0])
    return least * value


def _matrix(packed: Floats) -> Floats:
    """Symmetric matrices (..., 2, 2) of the dual from xx, xy, yy (..., 3)."""
    return packed[..., [[0, 1], [1, 2]]]


class _Setting(NamedTuple):
    """What is given: panel paths of all samples, the information without them, and each path's own optimum."""

    response: Complexes
    gradient: Floats
    fixed: Floats
    scale: float
    best: Floats


def _start(setting: _Setting, inverse: Floats, code: Complexes) -> Floats:
    """Start of the dual's search at a code: Y its inverse information, half of every path relaxed, d its share of the
    sum."""
    weight = setting.scale * np.sum((setting.gradient @ inverse) ** 2, axis=-1).ravel()
    pull = (weight[:, None] * setting.response.conj()).T @ (setting.response @ code)
    spread = np.maximum(np.real(code.conj() * pull), 1e-3 * np.abs(pull).mean() + _TINY)
    return np.concatenate([inverse[:, [0, 0, 1], [0, 1, 1]].ravel(), np.zeros(weight.size), np.log(spread)])


def _negative_bound(free: Floats, setting: _Setting, sharpness: float) -> tuple[float, Floats]:
    """Minus the dual bound and its slope in Y (3 a sample), logits of the relaxed shares, and log weights."""
    samples, paths = setting.gradient.shape[:2]
    packed, split, log_spread = np.split(free, [3 * samples, 3 * samples + samples * paths])
    half = _matrix(packed.reshape(samples, 3))
    moved = setting.gradient @ half
    weight = setting.scale * np.sum(moved**2, axis=-1).ravel()
    share = 0.5 * (1.0 + np.tanh(0.5 * split))
    relaxed, path_slope, spread_slope = _relaxed_optimum(
        weight * share, np.exp(log_spread), setting.response, sharpness
    )
    sided = half @ setting.fixed
    gained = np.mean(2.0 * np.trace(half, axis1=1, axis2=2) - np.einsum("bij,bji->b", half, sided))
    value = float(gained - np.sum(weight * (1.0 - share) * setting.best) - relaxed)
    by_weight = (1.0 - share) * setting.best + share * path_slope
    by_split = weight * share * (1.0 - share) * (setting.best - path_slope)
    curve = (2.0 * np.eye(2) - sided - np.swapaxes(sided, 1, 2)) / samples
    weighted = by_weight.reshape(samples, paths, 1) * moved
    curve = curve - 2.0 * setting.scale * np.swapaxes(weighted, 1, 2) @ setting.gradient
    by_half = np.stack([curve[:, 0, 0], curve[:, 0, 1] + curve[:, 1, 0], curve[:, 1, 1]], axis=-1)
    return -value, -np.concatenate([by_half.ravel(), by_split, -spread_slope])


def _relaxed_optimum(
    weight: Floats, spread: Floats, response: Complexes, sharpness: float
) -> tuple[float, Floats, Floats]:
    """Relaxed optimum in the dual of `sum_p c_p |r_p w|^2` over phases, and slopes in c (Q,), log d (N M,).

    lambda_max is smoothed from above: by a log-sum-exp whose width is its own value over `sharpness`.
    """
    root = np.sqrt(weight)[:, None] * response
    pairs = (root / spread) @ root.conj().T
    level, vector = np.linalg.eigh(pairs)
    lead = max(level[-1], _TINY)
    if np.isinf(sharpness):
        top, soft = lead, (np.arange(len(level)) == len(level) - 1).astype(np.float64)
    else:
        soft = np.exp(sharpness * (level - level[-1]) / lead)  # all of them 1 where nothing is relaxed and all are 0
        width = np.log(soft.sum()) / sharpness
        soft = soft / soft.sum()
        top = lead * (1.0 + width)
        soft[-1] += width + 1.0 - np.sum(soft * level) / lead
    projector = (vector * soft) @ vector.conj().T
    total = spread.sum()
    by_path = total * np.real(np.sum(pairs * projector.T, axis=1)) / np.maximum(weight, _TINY)
    along = np.real(np.sum(root.conj() * (projector @ root), axis=0))
    return total * top, by_path, spread * top - total * along / spread
