"""The dual bound: below every code, above the plain relaxation, and its slope."""

import itertools
from dataclasses import replace

import convex_dual as dual_module
import numpy as np
import pytest
from convex_dual import dual_bound

from rislam_rt.design import DESIGNERS, build_objective


@pytest.mark.parametrize("levels", [2, 4])
def test_dual_bound_lies_between_relaxation_and_brute_force(levels, make_problem):
    relaxed, dual = [], []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        problem = make_problem(rng, rows=2, cols=3, levels=levels, samples=1 + seed % 2, panel=4, static=1, prior=0.2)
        every = np.array(list(itertools.product(range(levels), repeat=6)))
        least = build_objective(problem).of_index(every).min()
        design = DESIGNERS["coordinate"](problem, rng=rng)
        bound = dual_bound(problem, design.code.index, iterations=80)
        assert bound <= least * (1 + 1e-9)
        relaxed.append(least / design.bound - 1)
        dual.append(least / bound - 1)
    assert np.median(dual) < 0.7 * np.median(relaxed)


def test_dual_bound_certifies_fine_phases_of_one_path(make_problem, rng):
    problem = make_problem(rng, rows=3, cols=3, levels=4, panel=1)
    design = DESIGNERS["exact"](problem, rng=rng)
    assert dual_bound(problem, design.code.index) == pytest.approx(design.crlb, rel=1e-4)


@pytest.mark.parametrize("silent", ["gains", "gradients"])
@pytest.mark.filterwarnings("error")
def test_dual_bound_of_paths_that_say_nothing(silent, make_problem, rng):
    """Panel paths without a gain, or across the plane: what is left is known without a code, and no logarithm of 0."""
    problem = make_problem(rng, rows=2, cols=2, panel=2, static=2)
    gradient, response = problem.gradient.copy(), problem.response.copy()
    if silent == "gains":
        response[:] = 0.0
    else:
        gradient[:, :2] = 0.0
    problem = replace(problem, gradient=gradient, response=response)
    every = build_objective(problem).of_index(np.zeros(4, dtype=np.int64))
    assert dual_bound(problem, np.zeros(4, dtype=np.int64)) == pytest.approx(float(every), rel=1e-6)


def test_dual_bound_holds_from_any_start(make_problem, rng):
    problem = make_problem(rng, rows=2, cols=2, panel=3)
    least = build_objective(problem).of_index(np.array(list(itertools.product(range(4), repeat=4)))).min()
    for _ in range(5):
        assert dual_bound(problem, rng.integers(4, size=(2, 2)), iterations=20) <= least * (1 + 1e-9)


def test_slope_of_the_dual_equals_differences(rng):
    response = rng.normal(size=(6, 9)) + 1j * rng.normal(size=(6, 9))
    setting = dual_module._Setting(
        response, rng.normal(size=(2, 3, 2)), np.array([np.eye(2), 2.0 * np.eye(2)]), 0.3, rng.exponential(size=6)
    )
    free, step = rng.normal(size=6 + 6 + 9), 1e-6
    _, slope = dual_module._negative_bound(free, setting, 5.0)
    for n, unit in enumerate(step * np.eye(len(free))):
        upper, lower = (dual_module._negative_bound(free + s * unit, setting, 5.0)[0] for s in (1, -1))
        assert slope[n] == pytest.approx((upper - lower) / (2 * step), abs=1e-7 * np.abs(slope).max())
