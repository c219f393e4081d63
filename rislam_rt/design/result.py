"""The result of a design, and the settings that a designer is given."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.design.problem import DesignProblem
from rislam_rt.errors import ConfigError
from rislam_rt.information import Outcome
from rislam_rt.model import RisCode


@dataclass(frozen=True, slots=True)
class DesignConfig:
    """Settings of all designers; each reads its own."""

    population: int = 50
    """K of CRLB-GA."""
    elite: int = 10
    """Q of CRLB-GA; K - Q must be even."""
    iterations: int = 100
    """C^A of CRLB-GA."""
    mutation: float = 0.02
    """p_m of CRLB-GA."""
    max_steps: int = 200
    """Most steps of a coordinate descent."""
    starts: int = 2
    """How many of the single-path optima coordinate descent starts from, the best first."""
    certify: bool = True
    """Whether to work out the relaxation bound and the gap of the target's gain."""

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
    """A code and how good it is."""

    method: str
    code: RisCode
    """(N, M); for `continuous` its phases at their nearest levels."""
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
    outcome: Outcome

    @property
    def gap_crlb(self) -> float:
        """How far the CRLB lies above its bound, relative; infinite if not certified or unobservable."""
        return self.crlb / self.bound - 1.0 if self.bound > 0.0 else float("inf")


class Designer(Protocol):
    """All designers look like this."""

    def __call__(self, problem: DesignProblem, *, rng: np.random.Generator, config: DesignConfig = ...) -> Design:
        """A code for the problem. Deterministic methods leave `rng` alone."""
        ...
