"""Gain curves over the distance of the direct panel path under designed, random and optimal codes (Fig. 4(a))."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design.design_problem import DesignProblem
from rislam_rt.design.design_result import DesignConfig
from rislam_rt.design.designers import designer
from rislam_rt.design.single_path import exact_code


class GainInterval(NamedTuple):
    """Gain [dB] at K places: middle, and lower and upper end of an interval (K,)."""

    middle: Floats
    """(K,) [dB] median or root mean square."""
    low: Floats
    """(K,) [dB] lower quantile."""
    high: Floats
    """(K,) [dB] upper quantile."""


class GainCurves(NamedTuple):
    """Gain [dB] of the direct panel path at K places under designed, random and optimal codes."""

    optimized: GainInterval
    """Gain under the designer's codes: median and quantiles over its seeds."""
    random: GainInterval
    """Gain under random codes: root mean square (exact), and quantiles over draws."""
    exact: Floats
    """(K,) [dB] largest gain that any code of the panel's levels reaches."""
    continuous: Floats
    """(K,) [dB] largest gain with continuous phases."""


_SINGLE = DesignConfig(certify=False)


def gain_curves(
    problems: Sequence[DesignProblem], *, rng: np.random.Generator, method: str = "genetic", seeds: int = 10,
    draws: int = 1000, coverage: float = 0.9, config: DesignConfig = _SINGLE,
) -> GainCurves:  # fmt: skip
    """Gain curves of the direct panel path under designed, random and optimal codes, as in Fig. 4(a).

    Parameters
    ----------
    problems
        One design problem a place (`problem_from_paths`, `direct_only`).
    seeds
        Number of runs of the designer at each place.
    draws
        Number of random codes that give the interval; their root mean square is `sqrt(sum |h_n|^2)`, no draw needed.
    coverage
        Probability of both intervals.
    """
    tail = np.array([0.5, (1.0 - coverage) / 2.0, (1.0 + coverage) / 2.0])
    run = designer(method)
    optimized, random = np.empty((len(problems), 3)), np.empty((len(problems), 3))
    exact, continuous = np.empty(len(problems)), np.empty(len(problems))
    for place, problem in enumerate(problems):
        gains = [run(problem, rng=child, config=config).gain_db for child in rng.spawn(seeds)]
        optimized[place] = np.quantile(gains, tail)
        target = problem.target
        turns = rng.integers(problem.levels, size=(draws, target.size))
        drawn = _db(np.abs(np.exp(-2j * np.pi / problem.levels * turns) @ target))
        random[place] = _db(np.sqrt(np.sum(np.abs(target) ** 2))), *np.quantile(drawn, tail[1:])
        exact[place] = _db(exact_code(target, problem.levels)[1])
        continuous[place] = _db(np.abs(target).sum())
    return GainCurves(GainInterval(*optimized.T), GainInterval(*random.T), exact, continuous)


def direct_only(problem: DesignProblem) -> DesignProblem:
    """Design problem of a gain curve: the same with the direct panel path alone, as Fig. 4(a) optimises it."""
    return DesignProblem(
        problem.response[:, :1], problem.static_gain[:, :0], problem.gradient[:, :1], problem.prior, problem.scale,
        problem.levels, least_power=problem.least_power,
    )  # fmt: skip


def _db(magnitude: Floats) -> Floats:
    """Gain in decibels of a gain curve, 20 log10 (...,)."""
    return 20.0 * np.log10(magnitude)
