"""What a filter's step says of its cycle (`StepInfo`)."""

from enum import StrEnum
from typing import NamedTuple

from rislam_rt.arrays import Integers

UNUSED, REMOVED = -1, -2
"""In `StepInfo.landmark`: clutter or not yet explained; taken for LOS or a wall return."""


class StepOutcome(StrEnum):
    """How a cycle went. Values, not exceptions: a filter must survive every one of them."""

    OK = "ok"
    NO_MEASUREMENTS = "no measurements"
    NO_LANDMARKS = "no landmarks"
    DIVERGED = "diverged"


class StepInfo(NamedTuple):
    """Diagnostics of one cycle."""

    landmark: Integers
    """(M,) ident that each measurement went to, of an image or two walls by a number of both; -1 clutter or unused,
    -2 removed as LOS or wall return."""
    ess: float
    """Effective sample size before resampling."""
    resampled: bool
    nis: float
    """Normalised innovation squared of the mean belief."""
    nis_dof: int
    log_evidence: float
    num_landmarks: int
    outcome: StepOutcome
