"""Result of a code design: code, CRLB and bound; and the settings and interface of designers."""

from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np
from annotated_types import Ge

from rislam_rt.arrays import Floats
from rislam_rt.design.design_problem import DesignProblem
from rislam_rt.errors import ConfigError
from rislam_rt.information import Outcome
from rislam_rt.model import RisCode
from rislam_rt.ranges import Count, Probability, check_ranges


@dataclass(frozen=True, slots=True)
class DesignConfig:
    """Settings of the designers of panel codes; each reads its own."""

    population: Annotated[int, Ge(2)] = 50
    """Population size K of CRLB-GA."""
    elite: Annotated[int, Ge(0)] = 10
    """Number Q of individuals that survive in CRLB-GA; K - Q must be even."""
    iterations: Count = 100
    """Number C^A of generations of CRLB-GA."""
    mutation: Probability = 0.02
    """Mutation probability p_m of CRLB-GA."""
    max_steps: Count = 200
    """Largest number of steps of a coordinate descent."""
    starts: Count = 2
    """Number of single-path optima from which coordinate descent starts, the best first."""
    certify: bool = True
    """Whether to compute the relaxation bound and the gap of the direct path's gain to its optimum."""

    def __post_init__(self) -> None:
        check_ranges("design", self)
        if self.elite >= self.population or (self.population - self.elite) % 2:
            raise ConfigError(
                f"design.population, design.elite: {self.population}, {self.elite} received; "
                "give fewer elites than individuals, and an even difference"
            )


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """A designed panel code with its expected CRLB, the direct path's gain and the lower bound over all codes."""

    method: str
    """Name of the designer."""
    code: RisCode
    """(N, M) code; for `continuous` its phases at their nearest levels."""
    xi: Floats
    """(N, M) phases [rad] that the figures below belong to: the code's, save for `continuous`."""
    crlb: float
    """Expected CRLB of the horizontal position [m^2]; infinite if unobservable."""
    gain_db: float
    """Gain of the direct panel path at the belief's first sample [dB]."""
    bound: float
    """Lower bound of the CRLB over all codes [m^2]; 0 if not certified."""
    gap_db: float
    """Exact optimum of the direct path's gain minus `gain_db` [dB]; negative for `continuous`; 0 if not certified."""
    history: Floats
    """Best objective after each iteration [m^2]; one entry for methods that do not iterate."""
    seconds: float
    """Time [s] that the design took."""
    outcome: Outcome
    """Whether the position is observable, and the panel known."""

    @property
    def gap_crlb(self) -> float:
        """Relative gap of the design's CRLB to its lower bound; infinite if not certified or unobservable."""
        return self.crlb / self.bound - 1.0 if self.bound > 0.0 else float("inf")


class Designer(Protocol):
    """Interface of a designer: from a design problem to a panel code."""

    def __call__(self, problem: DesignProblem, *, rng: np.random.Generator, config: DesignConfig = ...) -> Design:
        """Design a panel code for the problem. Deterministic methods leave `rng` alone."""
        ...
