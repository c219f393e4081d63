"""All designers of panel codes by name, behind one interface: genetic, exact, coordinate descent, random, ..."""

import time
from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.design.coordinate_descent import coordinate_search, exact_codes
from rislam_rt.design.design_problem import DesignProblem
from rislam_rt.design.design_result import Design, DesignConfig, Designer
from rislam_rt.design.genetic import genetic_search
from rislam_rt.design.objective import Objective, build_objective, relaxation_bound
from rislam_rt.design.single_path import continuous_phases, exact_code, nearest_code
from rislam_rt.errors import ConfigError
from rislam_rt.information import Outcome
from rislam_rt.model import RisCode

_Search = Callable[[DesignProblem, Objective, np.random.Generator, DesignConfig], tuple[Integers | Floats, Floats]]
"""Search for a code: returns levels, or for continuous methods phases [rad], (N M,), and the objective's history."""
_NO_HISTORY = np.zeros(0)
_DEFAULT = DesignConfig()


_SEARCHES: Mapping[str, _Search] = {
    "genetic": lambda p, o, rng, c: genetic_search(o, p.target.size, p.levels, rng=rng, config=c),
    "exact": lambda p, o, rng, c: (exact_codes(p), _NO_HISTORY),
    "coordinate": lambda p, o, rng, c: coordinate_search(p, o, c.starts, c.max_steps),
    "random": lambda p, o, rng, c: (rng.integers(p.levels, size=p.target.size), _NO_HISTORY),
    "zero": lambda p, o, rng, c: (np.zeros(p.target.size, dtype=np.int64), _NO_HISTORY),
    "nearest": lambda p, o, rng, c: (np.concatenate([nearest_code(one, p.levels) for one in p.targets]), _NO_HISTORY),
    "continuous": lambda p, o, rng, c: (np.concatenate([continuous_phases(one) for one in p.targets]), _NO_HISTORY),
}


def _designer(name: str, search: _Search) -> Designer:
    """Make a designer by name of a search: one that builds the objective, times the search and values its code."""

    def design(problem: DesignProblem, *, rng: np.random.Generator, config: DesignConfig = _DEFAULT) -> Design:
        begin = time.perf_counter()
        objective = build_objective(problem)
        found, history = search(problem, objective, rng, config)
        seconds = time.perf_counter() - begin
        return _describe(name, problem, objective, found, history, seconds, config.certify)

    return design


def _describe(
    name: str, problem: DesignProblem, objective: Objective, found: Integers | Floats, history: Floats,
    seconds: float, certify: bool,
) -> Design:  # fmt: skip
    """Last step of all designers: value the code or phases found, against the direct path's optimum and the relaxation
    bound."""
    step = 2.0 * np.pi / problem.levels
    discrete = np.issubdtype(found.dtype, np.integer)
    xi = np.asarray(found * step if discrete else found, dtype=np.float64)
    index = found if discrete else np.floor(xi / step + 0.5).astype(np.int64) % problem.levels
    gain = objective.gains(np.exp(-1j * xi))
    value = float(objective.value(gain))
    observable = objective.outcome is Outcome.OK
    bound = gap_db = 0.0
    if certify:
        best = best_magnitudes(problem)
        bound = relaxation_bound(objective, best) if observable else 0.0
        gap_db = float(_db(best[0, 0]) - _db(np.abs(gain[0])))
    return Design(
        method=name, code=RisCode(index.reshape(problem.shape), problem.levels), xi=xi.reshape(problem.shape),
        crlb=value if observable else float("inf"), gain_db=float(_db(np.abs(gain[0]))), bound=bound, gap_db=gap_db,
        history=history if len(history) else np.array([value]), seconds=seconds, outcome=objective.outcome,
    )  # fmt: skip


def _db(magnitude: Floats) -> Floats:
    """Decibels 20 log10 (...,) of the gain magnitudes by which designers are valued, a gain of zero as -400 dB."""
    return 20.0 * np.log10(np.maximum(magnitude, 1e-20))


DESIGNERS: Mapping[str, Designer] = MappingProxyType({name: _designer(name, one) for name, one in _SEARCHES.items()})
"""Every designer of panel codes by name. `continuous` breaks the panel's levels and is a reference only."""


def designer(method: str) -> Designer:
    """The designer of panel codes of a name.

    Raises
    ------
    ConfigError
        No designer has this name.
    """
    if method not in DESIGNERS:
        raise ConfigError(f"design.method: '{method}' received; give one of {', '.join(DESIGNERS)}")
    return DESIGNERS[method]


def blind_design(method: str, code: RisCode) -> Design:
    """Wrap a search code as a designer's `Design` of outcome `NO_PATHS`, while nothing is known of the panel."""
    infinite = float("inf")
    return Design(method, code, code.xi, infinite, -infinite, 0.0, 0.0, np.array([infinite]), 0.0, Outcome.NO_PATHS)


def best_magnitudes(problem: DesignProblem) -> Floats:
    """Largest gain magnitude (B, P) that each panel path of a design can reach by a code of its own, exactly."""
    samples, panel = problem.response.shape[:2]
    return exact_code(problem.response.reshape(samples, panel, -1), problem.levels)[1]
