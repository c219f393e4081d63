"""Lower bound of the multi-path objective by relaxation: every path at its own best, all at once."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design.objective import Objective
from rislam_rt.design.problem import DesignProblem
from rislam_rt.design.single_path import exact_code


def best_magnitudes(problem: DesignProblem) -> Floats:
    """(B, P): the largest gain that each panel path can reach on its own, exact over the levels."""
    samples, panel = problem.response.shape[:2]
    return exact_code(problem.response.reshape(samples, panel, -1), problem.levels)[1]


def relaxation_bound(objective: Objective, best: Floats) -> float:
    """Bound [m^2] by relaxation, from the paths' own best gains (B, P).

    The information it is made of exceeds that of every code (as matrices), and the trace of the inverse falls with it.
    """
    return float(objective.value(best.reshape(-1).astype(np.complex128)))
