"""Result of a code design: code, CRLB and bound; and the settings and interface of designers."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design.design_problem import DesignProblem
from rislam_rt.errors import ConfigError
from rislam_rt.information import Outcome
from rislam_rt.model import RisCode


@dataclass(frozen=True, slots=True)
class DesignConfig:
    """Settings of the designers of panel codes; each reads its own."""

    population: int = 50
    """Population size K of CRLB-GA."""
    elite: int = 10
    """Number Q of individuals that survive in CRLB-GA; K - Q must be even."""
    iterations: int = 100
    """Number C^A of generations of CRLB-GA."""
    mutation: float = 0.02
    """Mutation probability p_m of CRLB-GA."""
    max_steps: int = 200
    """Largest number of steps of a coordinate descent."""
    starts: int = 2
    """Number of single-path optima from which coordinate descent starts, the best first."""
    certify: bool = True
    """Whether to compute the relaxation bound and the gap of the direct path's gain to its optimum."""

    def __post_init__(self) -> None:
        if not self.population >= 2 or not 0 <= self.elite < self.population or (self.population - self.elite) % 2:
            raise ConfigError(
                f"design.population, design.elite: {self.population}, {self.elite} received; "
                "give at least 2, fewer elites than individuals, and an even difference"
            )
        if not 0.0 <= self.mutation <= 1.0:
            raise ConfigError(f"design.mutation: {self.mutation} received; give a probability")
        if self.iterations < 1 or self.max_steps < 1 or self.starts < 1:
            raise ConfigError("design.iterations, design.max_steps, design.starts: give at least 1")


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
