"""Progress bars of runs and sweeps on the terminal's error stream, with the time left."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rislam_rt.cli.verbosity import verbosity
from rislam_rt.progress import Tell

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn, TaskID

    from rislam_rt.sweeps import SweepCost, SweepProgress


def _bars(*columns: "ProgressColumn") -> "Progress":
    """Progress bars on the error stream, none with `--quiet`."""
    from rich.console import Console
    from rich.progress import Progress

    return Progress(*columns, console=Console(stderr=True), refresh_per_second=4, disable=verbosity().quiet)


@contextmanager
def show_progress() -> Iterator[Tell]:
    """Show progress bars within this context; yields the function to report a stage's progress with."""
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description:>12}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
        TextColumn("left"), TimeRemainingColumn(),
    )  # fmt: skip
    with _bars(*columns) as bars:
        tasks: dict[str, TaskID] = {}

        def tell(stage: str, at: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total)
            bars.update(tasks[stage], completed=at, total=total)

        yield tell


@contextmanager
def show_sweep() -> "Iterator[Callable[[SweepProgress], None]]":
    """Show the progress of a sweep within this context: estimated cost, a bar with the time left, every failure."""
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn

    columns = (TextColumn("cells"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[left]}"))
    with _bars(*columns) as bar:
        task = bar.add_task("cells", total=None, left="one cell goes first, to tell the cost")

        def tell(told: "SweepProgress") -> None:
            if told.last is None and not verbosity().quiet:
                bar.console.print(describe_cost(told), markup=False, highlight=False)
            elif told.last is not None and told.last.failed:
                cell = told.last.cell
                where = ", ".join([*(f"{key}={v}" for key, v in cell.point.items()), f"repetition {cell.repetition}"])
                text = f"failed: {where}: {told.last.state}: {told.last.message}"
                bar.console.print(text, markup=False, highlight=False, soft_wrap=True)
            failed = f", {told.failed} failed" if told.failed else ""
            left = f"{clock(told.cost)} left" if told.cost.cells else "done"
            bar.update(task, completed=told.done + told.failed, total=told.total, left=left + failed)

        yield tell


def describe_cost(told: "SweepProgress") -> str:
    """Text on the progress of a sweep: numbers of cells in all, done and failed, and the estimated time of the rest."""
    there = f"{told.total} cells, {told.done} done" + (f", {told.failed} failed" if told.failed else "")
    if not told.cost.cells:
        return f"{there}; nothing left to do"
    return f"{there}; {told.cost.cells} left at about {told.cost.cell_seconds or 0.0:.3g} s each: {clock(told.cost)}"


def clock(cost: "SweepCost") -> str:
    """Estimated time left of a sweep as text `h:mm:ss`."""
    if cost.seconds is None:
        return "unknown time"
    whole = round(cost.seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"
