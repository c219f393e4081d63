"""Progress of work that takes a while."""

from collections.abc import Callable

Tell = Callable[[str, int, int], None]
"""`at` of `total` steps of a stage are done."""


def tell_nobody(stage: str, at: int, total: int) -> None:
    """Nobody wants to know."""
