"""Running the cells of a sweep on a Dask cluster, each in a process of its own that a Dask worker's thread starts."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from rislam_rt.errors import ConfigError, SetupError
from rislam_rt.sweeps.cell_work import LOST, CellOutcome, Task, attempt
from rislam_rt.sweeps.local_pool import SAME_BITS, Run, outcome_of
from rislam_rt.worker_pool import Pool

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
    """Run one cell of a sweep in a process of a Dask worker, and return its outcome as plain data."""
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
