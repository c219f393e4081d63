"""Callbacks that report the progress of long computations."""

from collections.abc import Callable

Tell = Callable[[str, int, int], None]
"""Callback to which a computation reports its progress: a stage's name, the steps done, and their total."""


def tell_nobody(stage: str, at: int, total: int) -> None:
    """Ignore a report of progress: the callback for computations whose progress nobody shows."""
