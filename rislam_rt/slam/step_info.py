"""Diagnostics that a filter's step returns about its cycle (`StepInfo`)."""

from enum import IntEnum, StrEnum
from typing import NamedTuple

from rislam_rt.arrays import Integers

UNUSED, REMOVED = -1, -2
"""Values of `StepInfo.landmark`: clutter or not yet explained; taken for the direct path or a wall return."""


class StepOutcome(StrEnum):
    """How a filter's cycle went. Values, not exceptions: a filter must survive every one of them."""

    OK = "ok"
    """Components were heard, the map holds landmarks, and the filter does not hold itself for lost."""
    NO_MEASUREMENTS = "no measurements"
    """The receiver reported no component."""
    NO_LANDMARKS = "no landmarks"
    """The map holds no landmark."""
    DIVERGED = "diverged"
    """The filter holds itself for lost."""


class LossCause(IntEnum):
    """Why a filter holds itself for lost in a cycle: what speaks most against its map, by the cycle's own evidence."""

    NONE = 0
    """The cycle itself speaks for the map, or the filter gives no reason."""
    START = 1
    """The rates of the first tracks contradict the velocity or the compass that was told of the start."""
    JUMP = 2
    """What is heard fits the map from another position."""
    TRACKS = 3
    """More tracks ended at once than faint ones do."""
    MAP = 4
    """Clutter explains what is heard better than the map does."""
    MOTION = 5
    """Path lengths change as under another motion than the estimated one."""
    RESTART = 6
    """The filter has begun anew with an empty map."""


class StepInfo(NamedTuple):
    """Diagnostics of one cycle of a SLAM filter."""

    landmark: Integers
    """Number (M,) of the landmark to which each measurement was assigned, for an image or two walls that of both
    together; -1 clutter or unused, -2 removed as LOS or wall return."""
    ess: float
    """Effective sample size before resampling."""
    resampled: bool
    """Whether the particles were resampled in this cycle."""
    nis: float
    """Normalised innovation squared of the mean belief."""
    nis_dof: int
    """Degrees of freedom of `nis`."""
    log_evidence: float
    """Log density of the cycle's measurements given all earlier ones."""
    num_landmarks: int
    """Number of landmarks that the map holds."""
    outcome: StepOutcome
    """How the cycle went."""
    cause: LossCause = LossCause.NONE
    """Why the filter holds itself for lost, if it does."""
