"""Progress bars of runs and sweeps on the error stream, with the time left; plain lines where it is no terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

from rislam_rt.cli.verbosity import verbosity
from rislam_rt.progress import Tell, hours, plain_lines, tell_nobody

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn, TaskID

    from rislam_rt.sweeps import SweepCost, SweepProgress


def _bars(*columns: "ProgressColumn") -> "Progress":
    """Progress bars on the error stream, none with `--quiet`."""
    from rich.console import Console
    from rich.progress import Progress

    return Progress(*columns, console=Console(stderr=True), refresh_per_second=4, disable=verbosity().quiet)


def _lines(bars: "Progress") -> Tell:
    """Plain lines beside progress bars that are drawn at their end alone, as the error stream is no terminal."""
    if bars.disable or bars.console.is_terminal:
        return tell_nobody
    return plain_lines(partial(bars.console.print, markup=False, highlight=False, soft_wrap=True))


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
        say = _lines(bars)

        def tell(stage: str, at: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total)
            bars.update(tasks[stage], completed=at, total=total)
            say(stage, at, total)

        yield tell


@contextmanager
def show_sweep() -> "Iterator[Callable[[SweepProgress], None]]":
    """Show the progress of a sweep within this context: estimated cost, a bar with the time left, every failure."""
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn

    columns = (TextColumn("cells"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[left]}"))
    with _bars(*columns) as bar:
        task = bar.add_task("cells", total=None, left="one cell goes first, to tell the cost")
        say = _lines(bar)

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
            say("cells", told.done + told.failed, told.total)

        yield tell


def describe_cost(told: "SweepProgress") -> str:
    """Text on the progress of a sweep: numbers of cells in all, done and failed, and the estimated time of the rest."""
    there = f"{told.total} cells, {told.done} done" + (f", {told.failed} failed" if told.failed else "")
    if not told.cost.cells:
        return f"{there}; nothing left to do"
    return f"{there}; {told.cost.cells} left at about {told.cost.cell_seconds or 0.0:.3g} s each: {clock(told.cost)}"


def clock(cost: "SweepCost") -> str:
    """Estimated time left of a sweep as text `h:mm:ss`."""
    return "unknown time" if cost.seconds is None else hours(cost.seconds)
