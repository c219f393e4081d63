"""A progress bar a stage, with the time left, on the terminal's error stream."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from rich.progress import TaskID


class Tell(Protocol):
    """Takes news of the work."""

    def __call__(self, stage: str, at: int, total: int) -> None:
        """`at` of `total` steps of a stage are done."""
        ...


@contextmanager
def show_progress() -> Iterator[Tell]:
    """Show a bar for every stage that news comes of."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description:>12}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), refresh_per_second=4) as bars:
        tasks: dict[str, TaskID] = {}

        def tell(stage: str, at: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total)
            bars.update(tasks[stage], completed=at, total=total)

        yield tell
