"""Pools that run the cells of a sweep in worker processes, on this machine or on a Dask cluster."""

import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from rislam_rt.errors import ConfigError, SetupError
from rislam_rt.sweeps.cell_work import DIED, HUNG, LOST, CellOutcome, Task, attempt
from rislam_rt.worker_pool import Lost, Pool, open_pool

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


CONNECT_SECONDS = 3
"""Time [s] to wait for the Dask scheduler to answer."""

_POOL = Pool(SAME_BITS)
"""Worker processes of the Dask worker that imports this module."""


@contextmanager
def cluster_pool(address: str, limit: float | None) -> Iterator[tuple[Run, int]]:
    """Connect to the Dask cluster at `address`; yields a function that runs a sweep's cells, and the number of threads.

    The cluster's machines need this package, the cells' function and the folders that the settings name.

    Raises
    ------
    ConfigError
        The address is empty.
    SetupError
        Dask is not installed, there is no scheduler at the address, or it has gone.
    """
    try:
        distributed: Any = import_module("distributed")
    except ImportError:
        raise SetupError("--dask needs dask.distributed, which is missing; pip install 'rislam-rt[cluster]'") from None
    if not address.strip():
        raise ConfigError("--dask: no address received; give that of a scheduler, e.g. tcp://127.0.0.1:8786")
    try:
        client = distributed.Client(address, timeout=CONNECT_SECONDS, set_as_default=False)
    except Exception as error:  # an address that is none raises nearly anything
        cause = " ".join(str(error).split())[:120]
        raise SetupError(f"--dask {address}: no scheduler answers ({cause}); start one, or mend the address") from None

    def run(tasks: Iterable[tuple[str, Task]]) -> Iterator[tuple[str, CellOutcome]]:
        futures = {client.submit(do_cell, task, limit, key=f"cell-{name}"): name for name, task in tasks}
        for future in distributed.as_completed(futures, loop=client.loop):
            yield futures[future], _outcome(future, address)
            future.release()

    with client:
        yield run, max(1, sum(client.nthreads().values()))
        client.run(dismiss_idle)


def do_cell(task: Task, limit: float | None) -> tuple[Any, ...]:
    """Run one cell of a sweep in a Dask worker's own process pool, and return its outcome as plain data."""
    return tuple(outcome_of(_POOL.do(attempt, (Task(*task),), limit), limit))


def _outcome(future: Any, address: str) -> CellOutcome:
    """Outcome of a cell from its Dask future; `LOST` if the cluster gave up after losing several workers with it."""
    if future.status == "finished":
        return CellOutcome(*future.result())
    if future.status == "error":
        return CellOutcome(cause=LOST, message=f"its Dask worker was lost ({type(future.exception()).__name__})")
    raise SetupError(f"--dask {address}: the scheduler has gone; start it again, the same command goes on from here")


def dismiss_idle() -> None:
    """End the idle worker processes of a Dask worker."""
    _POOL.dismiss()
