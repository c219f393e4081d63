"""Relaxation bound of the code design: CRLB if every panel path had its own optimal code at the same time."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design.objective import Objective
from rislam_rt.design.problem import DesignProblem
from rislam_rt.design.single_path import exact_code


def best_magnitudes(problem: DesignProblem) -> Floats:
    """Largest gain magnitude (B, P) that each panel path can reach by a code of its own, exact over the levels."""
    samples, panel = problem.response.shape[:2]
    return exact_code(problem.response.reshape(samples, panel, -1), problem.levels)[1]


def relaxation_bound(objective: Objective, best: Floats) -> float:
    """Lower bound [m^2] of the expected CRLB over all codes, from the panel paths' own best gains (B, P).

    The information of these gains exceeds that of every code (as matrices), and the trace of the inverse falls with it.
    """
    return float(objective.value(best.reshape(-1).astype(np.complex128)))
