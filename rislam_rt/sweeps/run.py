"""Running a sweep: does the cells that have no file yet, estimates their cost, and keeps the table of results."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

from rislam_rt.errors import ConfigError
from rislam_rt.sweeps import store
from rislam_rt.sweeps.cell_work import LOST, CellOutcome, Task, find_function
from rislam_rt.sweeps.pools import Run, cluster_pool, local_pool
from rislam_rt.sweeps.sweep import Cell, Sweep, build_cells


class SweepCost(NamedTuple):
    """Estimated time of the cells of a sweep that are left."""

    cells: int
    """Number of cells left."""
    cell_seconds: float | None
    """Mean time of one cell [s]; None before any is done."""
    seconds: float | None
    """Time until all are done [s]; None before any is done."""


def estimate_cost(left: Sequence[Cell], known: Sequence[Mapping[str, Any]], width: int) -> SweepCost:
    """Estimate the time of a sweep's cells left, run `width` at a time, each from the mean of done cells of similar
    settings.

    The most similar cells share the most values along the axes: if the number of particles is an axis, cells with the
    same number count rather than others.
    """
    if not left:
        return SweepCost(0, None, 0.0)
    if not known:
        return SweepCost(len(left), None, None)
    points = {repr(cell.point): cell.point for cell in left}
    counts = Counter(repr(cell.point) for cell in left)
    each = [(_similar(points[key], known), count) for key, count in counts.items()]
    total = sum(seconds * count for seconds, count in each)
    return SweepCost(
        len(left), total / len(left), max(total / min(width, len(left)), max(seconds for seconds, _ in each))
    )


def _similar(point: Mapping[str, Any], known: Sequence[Mapping[str, Any]]) -> float:
    """Mean time [s] of the known cells most alike to a point along the axes, to estimate the sweep's cost."""
    shared = [sum(other["point"].get(key) == value for key, value in point.items()) for other in known]
    most = max(shared)
    seconds = [float(other["seconds"]) for other, number in zip(known, shared, strict=True) if number == most]
    return sum(seconds) / len(seconds)


TABLE_SECONDS = 1.0
"""Least time [s] between two updates of the table of results."""
TABLE_SHARE = 0.1
"""Largest share of the time spent on updates of the table, and of figures drawn from it."""


@dataclass(frozen=True, slots=True)
class SweepOptions:
    """How a sweep is run: number of processes, cluster, time limit; the results do not depend on it."""

    jobs: int = 1
    """Number of cells at a time on this machine."""
    dask: str | None = None
    """Address of a Dask scheduler, whose workers run the cells instead."""
    time_limit: float | None = None
    """Longest time a cell may take [s]; a cell that is stopped counts as failed, in the results as well."""
    retry: bool = False
    """Whether cells that failed before are run again; those killed by a signal from outside always are."""
    only_estimate: bool = False
    """Whether to stop once the cost is estimated, which may take one cell."""

    def __post_init__(self) -> None:
        if self.jobs < 1:
            raise ConfigError(f"--jobs: {self.jobs} received; give at least 1")
        if self.time_limit is not None and not self.time_limit > 0.0:
            raise ConfigError(f"--time-limit: {self.time_limit:g} received; give a positive number of seconds")


class SweepProgress(NamedTuple):
    """Progress of a sweep: numbers of cells done and failed, and the estimated time left."""

    done: int
    """Number of cells done without failure, in this run or before."""
    failed: int
    """Number of cells that failed."""
    total: int
    cost: SweepCost
    """Estimated cost of the cells left."""
    last: store.Row | None
    """The cell that just ended; None at the start."""


@dataclass(frozen=True, slots=True)
class SweepReport:
    """Result of a sweep: state and result of every cell in its order, and the estimated cost of those left."""

    rows: tuple[store.Row, ...]
    cost: SweepCost
    """Estimated cost of the cells left, if the sweep was to stop at the estimate."""

    @property
    def failed(self) -> tuple[store.Row, ...]:
        """Cells that failed, in this run of the sweep or before."""
        return tuple(row for row in self.rows if row.failed)


def run_sweep(
    sweep: Sweep, folder: Path, effort: SweepOptions | None = None, *,
    tell: Callable[[SweepProgress], None] | None = None, grow: Callable[[Sequence[store.Row]], object] | None = None,
) -> SweepReport:  # fmt: skip
    """Run all cells of a sweep that have no file in `folder` yet, and write a file for each.

    A sweep that was stopped in any way goes on from the cells that are there when it is called again; the files are the
    same, byte for byte, as those of a sweep that was never stopped, on one process or many, here or on a cluster.

    Parameters
    ----------
    tell
        Called when the cost is known and after every cell.
    grow
        Called with all rows whenever the table is written, after the last cell too: to draw figures of the results.

    Raises
    ------
    ConfigError, ResultError
        The settings are unusable, the folder holds something else, or another sweep is at work in it.
    StoreError
        The disk refused.
    SetupError
        Dask is asked for and not there.
    """
    effort = effort or SweepOptions()
    find_function(sweep.function)
    cells = build_cells(sweep)
    with ExitStack() as stack:
        store.check_folder(folder)
        left = any(store.read_row(folder, cell).state != store.DONE for cell in cells)
        # a cluster first: one that is not there leaves no folder behind
        hired = _hire(stack, effort) if left and effort.dask is not None else None
        shown = effort.only_estimate and (folder / "table.csv").is_file()  # tables of what was run stay as they are
        stack.enter_context(store.open_folder(folder, sweep, keep=shown))
        board = _SweepState(sweep, folder, effort, cells, keep=shown, tell=tell, grow=grow)
        stack.callback(board.write)
        if board.left:
            run, board.width = hired or _hire(stack, effort)
            for share in _shares(board):
                for ident, outcome in run(share):
                    board.take(ident, outcome)
        else:
            board.show(None)
    return SweepReport(tuple(board.rows.values()), board.cost())


def _hire(stack: ExitStack, effort: SweepOptions) -> tuple[Run, int]:
    """Start the local or Dask workers of a sweep; return the function that runs cells, and how many run at a time."""
    if effort.dask is None:
        return stack.enter_context(local_pool(effort.jobs, effort.time_limit)), effort.jobs
    return stack.enter_context(cluster_pool(effort.dask, effort.time_limit))


def _shares(board: "_SweepState") -> Iterator[list[tuple[str, Task]]]:
    """Cells of a sweep that are to be run, in batches: one alone first if no known time tells the cost."""
    tasks = list(board.left.items())
    if board.cost().seconds is None:
        yield tasks[:1]
        tasks = tasks[1:]
    board.show(None)
    if tasks and not board.effort.only_estimate:
        yield tasks


class _SweepState:
    """State of a running sweep: results of its cells, cells left and their cost; writes them and reports progress."""

    def __init__(
        self, sweep: Sweep, folder: Path, effort: SweepOptions, cells: Sequence[Cell], *, keep: bool,
        tell: Callable[[SweepProgress], None] | None, grow: Callable[[Sequence[store.Row]], object] | None,
    ) -> None:  # fmt: skip
        self.keep = keep
        self.sweep, self.folder, self.effort, self.tell, self.grow = sweep, folder, effort, tell, grow
        self.rows = {cell.ident: store.read_row(folder, cell) for cell in cells}
        self.left = {
            cell.ident: Task(sweep.function, {**cell.settings, **sweep.local}, cell.seed)
            for cell in cells
            if self.rows[cell.ident].state in (store.MISSING, LOST) or (effort.retry and self.rows[cell.ident].failed)
        }
        self.width = effort.jobs
        self.timings = store.read_timings(folder)
        self.due = 0.0
        self.written = False
        self.known: tuple[float, SweepCost] | None = None

    def take(self, ident: str, outcome: CellOutcome) -> None:
        """Store the outcome of a sweep's cell that has ended, and report progress."""
        cell = self.rows[ident].cell
        self.rows[ident] = row = store.write_cell(self.folder, cell, self.sweep.function, outcome)
        store.append_timing(self.folder, cell, outcome)
        self.timings.append({"point": cell.point, "seconds": outcome.seconds})
        self.left.pop(ident)
        self.written = False
        if monotonic() >= self.due:
            self.write()
        self.show(row)

    def cost(self) -> SweepCost:
        """Estimated cost of the cells left, computed anew at most once in `TABLE_SECONDS`."""
        if self.known is None or self.known[1].seconds is None or not self.left or monotonic() >= self.known[0]:
            left = [self.rows[ident].cell for ident in self.left]
            self.known = monotonic() + TABLE_SECONDS, estimate_cost(left, self.timings, self.width)
        return self.known[1]

    def show(self, last: store.Row | None) -> None:
        """Report the sweep's progress; `last` is the cell that just ended."""
        if self.tell is not None:
            states = [row.state for row in self.rows.values()]
            done = states.count(store.DONE)
            failed = len(states) - done - sum(row.cell.ident in self.left for row in self.rows.values())
            self.tell(SweepProgress(done, failed, len(states), self.cost(), last))

    def write(self) -> None:
        """Write, while a sweep runs, the table of all its cells, and draw the figures of the results so far, unless the
        old ones are kept or no cell has ended since."""
        if self.keep or self.written:
            return
        begin = monotonic()
        rows = list(self.rows.values())
        store.write_table(self.folder, rows)
        if self.grow is not None:
            self.grow(rows)
        self.written = True
        taken = monotonic() - begin
        self.due = monotonic() + max(TABLE_SECONDS, taken / TABLE_SHARE)
