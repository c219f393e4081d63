"""Coordinate descent over levels, all elements looked at together: the strong heuristic for several panel paths."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.design.objective import Objective
from rislam_rt.design.problem import DesignProblem
from rislam_rt.design.single import exact_code


def coordinate_descent(objective: Objective, index: Integers, levels: int, max_steps: int) -> tuple[Integers, Floats]:
    """Improve a code (N M,) until no change of a single element helps; the objective after each step.

    Each step values every change of one element, ranks the elements by what their best change gains, and applies the
    first m of them for the m = 1, 2, 4, ... that turns out best: never worse than the best single change.
    """
    index = index.copy()
    shift = objective.table[1:] - 1.0
    weight = objective.table[index]
    gain = objective.gains(weight)
    history = [float(objective.value(gain))]
    for _ in range(max_steps):
        moved = (weight[:, None] * objective.matrix) * shift[:, None, None]
        value = objective.value(gain + moved)
        change = np.argmin(value, axis=0)
        least = value[change, np.arange(len(index))]
        order = np.argsort(least, kind="stable")
        order = order[least[order] < history[-1] * (1.0 - _WORTHWHILE)]
        if not len(order):
            break
        trials = _first_changes(index, order, change, levels)
        values = objective.of_index(trials)
        best = int(np.argmin(values))
        index = trials[best]
        weight = objective.table[index]
        gain = objective.gains(weight)
        history.append(float(objective.value(gain)))
    return index, np.array(history)


_WORTHWHILE = 1e-12
"""Relative improvement below which a change is rounding."""


def _first_changes(index: Integers, order: Integers, change: Integers, levels: int) -> Integers:
    """Codes (T, N M) with the best changes of the first 1, 2, 4, ... elements of `order` applied."""
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


def coordinate_search(
    problem: DesignProblem, objective: Objective, starts: int, max_steps: int
) -> tuple[Integers, Floats]:
    """Descend from the single-path optima at the belief's first sample; the best `starts` of them are tried."""
    panel = problem.response.shape[1]
    codes, _ = exact_code(problem.response[0].reshape(panel, -1), problem.levels)
    rank = np.argsort(objective.of_index(codes), kind="stable")[:starts]
    found = [coordinate_descent(objective, codes[row], problem.levels, max_steps) for row in rank]
    return min(found, key=lambda result: result[1][-1])
