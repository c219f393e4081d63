"""A progress bar a stage, with the time left, on the terminal's error stream."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rislam_rt.cli.verbosity import verbosity
from rislam_rt.progress import Tell

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn, TaskID

    from rislam_rt.sweeps import SweepCost, SweepProgress


def _bars(*columns: "ProgressColumn") -> "Progress":
    from rich.console import Console
    from rich.progress import Progress

    return Progress(*columns, console=Console(stderr=True), refresh_per_second=4, disable=verbosity().quiet)


@contextmanager
def show_progress() -> Iterator[Tell]:
    """Show progress as a bar for every stage that news comes of."""
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description:>12}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with _bars(*columns) as bars:
        tasks: dict[str, TaskID] = {}

        def tell(stage: str, at: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total)
            bars.update(tasks[stage], completed=at, total=total)

        yield tell


@contextmanager
def show_sweep() -> "Iterator[Callable[[SweepProgress], None]]":
    """Show a sweep: its cost before it starts, a bar with the time left, and every failure as it comes."""
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
    """Progress of a sweep: how many cells there are, how many are done, and what the rest will cost."""
    there = f"{told.total} cells, {told.done} done" + (f", {told.failed} failed" if told.failed else "")
    if not told.cost.cells:
        return f"{there}; nothing left to do"
    return f"{there}; {told.cost.cells} left at about {told.cost.cell_seconds or 0.0:.3g} s each: {clock(told.cost)}"


def clock(cost: "SweepCost") -> str:
    """Progress: the time that is left as `h:mm:ss`."""
    if cost.seconds is None:
        return "unknown time"
    whole = round(cost.seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"
