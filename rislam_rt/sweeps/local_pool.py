"""Local pool: runs the cells of a sweep in worker processes on this machine, and tells why a process ended."""

import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from rislam_rt.sweeps.cell_work import DIED, HUNG, LOST, CellOutcome, Task, attempt
from rislam_rt.worker_pool import Lost, open_pool

Run = Callable[[Iterable[tuple[str, Task]]], Iterator[tuple[str, CellOutcome]]]
"""Function that runs named tasks, and yields the name and outcome of each as it ends."""

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "RISLAM_RT_THREADS")
SAME_BITS = {**dict.fromkeys(_THREADS, "1"), "PYTHONHASHSEED": "0"}
"""Environment of every worker process: one thread each, so that results are equal to the last bit, and a fixed hash."""

FROM_OUTSIDE = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Signals that a user, a queue or the kernel sends: the cell is not to blame, and is tried again."""


@contextmanager
def local_pool(jobs: int, limit: float | None) -> Iterator[Run]:
    """Start worker processes for the cells of a sweep, `jobs` at a time; leaving the context ends them."""
    with open_pool(attempt, jobs, limit=limit, environment=SAME_BITS) as run:

        def run_cells(tasks: Iterable[tuple[str, Task]]) -> Iterator[tuple[str, CellOutcome]]:
            for name, found in run((name, (task,)) for name, task in tasks):
                yield name, outcome_of(found, limit)

        yield run_cells


def outcome_of(found: Any, limit: float | None) -> CellOutcome:
    """Outcome of a cell from what its worker process returned, or from how the process ended."""
    if isinstance(found, CellOutcome):
        return found
    assert isinstance(found, Lost)
    code = found.code
    if code is None:
        return CellOutcome(cause=HUNG, message=f"not done after {limit:g} s, its time limit", seconds=found.seconds)
    if code >= 0:
        return CellOutcome(cause=DIED, message=f"its process ended with exit code {code}", seconds=found.seconds)
    name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
    cause = LOST if -code in FROM_OUTSIDE else DIED
    return CellOutcome(cause=cause, message=f"its process was killed by {name}", seconds=found.seconds)
