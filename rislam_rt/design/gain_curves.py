"""Designs place by place: the gain curves of Fig. 4(a)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design.designers import designer
from rislam_rt.design.problem import DesignProblem
from rislam_rt.design.result import DesignConfig
from rislam_rt.design.single_path import exact_code


class GainInterval(NamedTuple):
    """A curve over K places with its spread."""

    middle: Floats
    """(K,)."""
    low: Floats
    """(K,)."""
    high: Floats
    """(K,)."""


class GainCurves(NamedTuple):
    """Gain of the direct panel path at K places [dB]."""

    optimized: GainInterval
    """Under the designer's codes: median and quantiles over its seeds."""
    random: GainInterval
    """Under random codes: root mean square (exact), and quantiles over draws."""
    exact: Floats
    """(K,) largest gain that any code of the panel's levels reaches."""
    continuous: Floats
    """(K,) largest gain at all."""


_SINGLE = DesignConfig(certify=False)


def gain_curves(
    problems: Sequence[DesignProblem],
    *,
    rng: np.random.Generator,
    method: str = "genetic",
    seeds: int = 10,
    draws: int = 1000,
    coverage: float = 0.9,
    config: DesignConfig = _SINGLE,
) -> GainCurves:
    """The panel's curves of Fig. 4(a) from one design problem a place (`problem_from_paths`, `direct_only`).

    Parameters
    ----------
    seeds
        How often the designer is run at each place.
    draws
        How many random codes give the interval; their root mean square is `sqrt(sum |h_n|^2)`, no draw needed.
    coverage
        Of both intervals.
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
    """The same design problem with the direct panel path alone: what Fig. 4(a) optimises."""
    return DesignProblem(
        problem.response[:, :1], problem.static_gain[:, :0], problem.gradient[:, :1], problem.prior, problem.scale,
        problem.levels, least_power=problem.least_power,
    )  # fmt: skip


def _db(magnitude: Floats) -> Floats:
    """Gain in decibels, 20 log10 (...,)."""
    return 20.0 * np.log10(magnitude)
