"""Coordinate descent over the elements' phase levels: the strongest designer of codes for several panel paths."""

import numpy as np

from rislam_rt.arrays import Complexes, Floats, Integers
from rislam_rt.design.design_problem import DesignProblem
from rislam_rt.design.objective import Objective
from rislam_rt.design.single_path import exact_code

LARGE = 100
"""Number of elements above which changes are first ranked by the objective's slope instead of their exact values."""
_WORTHWHILE = 1e-7
"""Relative improvement of the objective below which descent stops; rounding is 1e-15, one element of 4096 gives
1e-4."""


def coordinate_descent(objective: Objective, index: Integers, levels: int, max_steps: int) -> tuple[Integers, Floats]:
    """Improve a code (N M,) by coordinate descent until no change of one element lowers the expected CRLB; and the
    objective by step.

    Each step values every change of one element, ranks the elements by what their best change gains, and applies the
    first m of them for the m = 1, 2, 4, ... that turns out best: never worse than the best single change.
    """
    gain = objective.gains(objective.table[index])
    history = [float(objective.value(gain))]
    rank = _rank_by_slope if len(index) > LARGE else _rank_by_value
    for _ in range(max_steps):
        order, change = rank(objective, objective.table[index], gain, history[-1])
        improved = False
        if len(order):
            trials = _first_changes(index, order, change, levels)
            gains = objective.gains(objective.table[trials])
            values = objective.value(gains)
            best = int(np.argmin(values))
            improved = bool(values[best] < history[-1] * (1.0 - _WORTHWHILE))
        if improved:
            index, gain = trials[best], gains[best]
            history.append(float(values[best]))
        elif rank is _rank_by_slope:
            rank = _rank_by_value
        else:
            break
    return index, np.array(history)


def _rank_by_value(objective: Objective, weight: Complexes, gain: Complexes, now: float) -> tuple[Integers, Integers]:
    """Elements for coordinate descent whose best change lowers the objective, best first, and that change less one."""
    shift = objective.table[1:] - 1.0
    value = objective.value(gain + (weight[:, None] * objective.matrix) * shift[:, None, None])
    change = np.argmin(value, axis=0)
    least = value[change, np.arange(len(weight))]
    order = np.argsort(least, kind="stable")
    return order[least[order] < now * (1.0 - _WORTHWHILE)], change


def _rank_by_slope(objective: Objective, weight: Complexes, gain: Complexes, now: float) -> tuple[Integers, Integers]:
    """Elements for coordinate descent as `_rank_by_value` ranks them, but to first order in the powers."""
    size = 1e-6
    slope = (objective.value(gain * (1.0 + 0.5 * size * np.eye(len(gain)))) - now) / size
    shift = objective.table[1:] - 1.0
    # by alpha -> alpha + delta, log |alpha|^2 grows by (2 Re(conj(alpha) delta) + |delta|^2) / |alpha|^2
    relative = slope / np.maximum(np.abs(gain) ** 2, 1e-300)
    linear = weight * (objective.matrix @ (2.0 * relative * gain.conj()))
    square = (objective.matrix.real**2 + objective.matrix.imag**2) @ relative
    value = np.real(shift[:, None] * linear) + np.abs(shift[:, None]) ** 2 * square
    change = np.argmin(value, axis=0)
    least = value[change, np.arange(len(weight))]
    order = np.argsort(least, kind="stable")
    return order[least[order] < 0.0], change


def _first_changes(index: Integers, order: Integers, change: Integers, levels: int) -> Integers:
    """Codes (T, N M) with the level changes of the first 1, 2, 4, ... elements of `order` applied."""
    trials = []
    count = 1
    while True:
        chosen = order[:count]
        trial = index.copy()
        trial[chosen] = (trial[chosen] + change[chosen] + 1) % levels
        trials.append(trial)
        if count >= len(order):
            return np.stack(trials)
        count *= 2


def exact_codes(problem: DesignProblem) -> Integers:
    """Start of coordinate descent: code (N M,) with every panel at the exact optimum of its direct path's gain."""
    return np.concatenate([exact_code(target, problem.levels)[0] for target in problem.targets])


def coordinate_search(
    problem: DesignProblem, objective: Objective, starts: int, max_steps: int
) -> tuple[Integers, Floats]:
    """Best code (N M,) of coordinate descents from the best `starts` single-path optima at the belief's first sample,
    and the objective after each step."""
    paths = problem.response.shape[1]
    own, _ = exact_code(problem.response[0].reshape(paths, -1), problem.levels)
    codes = np.tile(exact_codes(problem), (paths, 1))  # what a path leaves open, the other panels, is at their optimum
    for path, panel in enumerate(problem.owner()):
        span = problem.panels[panel][1]
        codes[path, span] = own[path, span]
    rank = np.argsort(objective.of_index(codes), kind="stable")[:starts]
    found = [coordinate_descent(objective, codes[row], problem.levels, max_steps) for row in rank]
    return min(found, key=lambda result: result[1][-1])
