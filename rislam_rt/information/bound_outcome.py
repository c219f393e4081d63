"""Outcome of a bound: whether it exists. It is a value, as a bound that does not exist is an answer, not an error."""

from enum import IntEnum


class Outcome(IntEnum):
    """Outcome of a bound or a code design: whether it exists, and why not."""

    OK = 0
    """The bound exists."""
    UNOBSERVABLE = 1
    """The information is singular: some direction is not seen at all, and the bound is infinite."""
    DEGENERATE = 2
    """Two paths coincide in delay and angle, so that their own gains cannot be told apart."""
    NO_PATHS = 3
    """No path carries any power: for a design, none of them meets the panel."""
