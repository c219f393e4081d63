"""Workers: interpreters of their own that do cells, so that a cell which aborts or hangs takes nothing else with it."""

import json
import os
import select
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from time import monotonic

from rislam_rt.sweeps.work import DIED, HUNG, LOST, CellOutcome, Task

Run = Callable[[Iterable[tuple[str, Task]]], Iterator[tuple[str, CellOutcome]]]
"""Does tasks and gives their outcomes as they come, each with its name."""

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS", "RISLAM_RT_THREADS")
SAME_BITS = {**dict.fromkeys(_THREADS, "1"), "PYTHONHASHSEED": "0"}
"""Environment of every worker: cells share the cores, and sums and sets have one order."""

FROM_OUTSIDE = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGHUP)
"""Signals that a process does not send itself when it breaks: a user, a queue, or a kernel out of memory did."""

LOOK_SECONDS = 1.0
"""Longest time between two looks at whether a worker lives."""


class CellWorker:
    """One interpreter, started fresh (never a fork: numerical libraries keep threads); it does cells one by one."""

    def __init__(self) -> None:
        path = os.pathsep.join(os.path.abspath(part) for part in sys.path)
        self.process = subprocess.Popen(
            [sys.executable, "-c", "from rislam_rt.sweeps.work import main; main()"],
            env={**os.environ, **SAME_BITS, "PYTHONPATH": path},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
        )
        self.fresh = True

    def do(self, task: Task, limit: float | None) -> CellOutcome:
        """One cell, stopped after `limit` [s]; the start of the interpreter does not count."""
        if self.fresh and self._hear(None) is None:
            return self._dead(0.0)
        self.fresh = False
        begin = monotonic()
        try:
            self._say(json.dumps(task).encode() + b"\n")
        except BrokenPipeError:
            return self._dead(0.0)
        try:
            line = self._hear(limit)
        except TimeoutError:
            self.stop()
            return CellOutcome(
                cause=HUNG, message=f"not done after {limit:g} s, its time limit", seconds=monotonic() - begin
            )
        return self._dead(monotonic() - begin) if line is None else CellOutcome(*json.loads(line))

    def _say(self, line: bytes) -> None:
        assert self.process.stdin is not None
        while line:
            line = line[os.write(self.process.stdin.fileno(), line) :]

    def _hear(self, limit: float | None) -> bytes | None:
        """The next line; None if the process ends instead."""
        assert self.process.stdout is not None
        ear, line = self.process.stdout.fileno(), b""
        end = None if limit is None else monotonic() + limit
        waiting = select.poll()
        waiting.register(ear, select.POLLIN)
        while not line.endswith(b"\n"):
            left = LOOK_SECONDS if end is None else min(LOOK_SECONDS, max(end - monotonic(), 0.0))
            if not waiting.poll(1e3 * left):
                if not self.alive:
                    return None  # a child of its own that lives on keeps the pipe open
                if end is not None and monotonic() >= end:
                    raise TimeoutError
                continue
            part = os.read(ear, 1 << 16)
            if not part:
                return None
            line += part
        return line

    def _dead(self, seconds: float) -> CellOutcome:
        code = self.process.wait()
        self.stop()
        if code >= 0:
            return CellOutcome(cause=DIED, message=f"its process ended with exit code {code}", seconds=seconds)
        name = signal.Signals(-code).name if -code in set(signal.Signals) else f"signal {-code}"
        cause = LOST if -code in FROM_OUTSIDE else DIED
        return CellOutcome(cause=cause, message=f"its process was killed by {name}", seconds=seconds)

    def stop(self) -> None:
        """End it at once."""
        self.process.kill()
        self.process.wait()
        for end in (self.process.stdin, self.process.stdout):
            assert end is not None
            end.close()

    @property
    def alive(self) -> bool:
        """Whether it can do another cell."""
        return self.process.poll() is None


class WorkerPool:
    """Workers of this process; as many as cells are done at a time."""

    def __init__(self) -> None:
        self.idle: list[CellWorker] = []
        self.busy: list[CellWorker] = []
        self.over = False

    def do(self, task: Task, limit: float | None) -> CellOutcome:
        """One cell, by an idle worker or a new one."""
        worker = self.idle.pop() if self.idle else CellWorker()
        if not worker.alive:
            worker.stop()
            worker = CellWorker()
        self.busy.append(worker)
        if self.over:
            worker.process.kill()
        try:
            return worker.do(task, limit)
        finally:
            self.busy.remove(worker)
            if worker.alive:
                self.idle.append(worker)

    def dismiss(self) -> None:
        """End the idle workers."""
        while self.idle:
            self.idle.pop().stop()

    def break_off(self) -> None:
        """End the busy workers, and all that come; their threads hear of it, and clean up."""
        self.over = True
        for worker in list(self.busy):
            worker.process.kill()


@contextmanager
def local_pool(jobs: int, limit: float | None) -> Iterator[Run]:
    """Workers on this machine, `jobs` at a time. Leaving ends them, in the middle of their cells if need be."""
    workers = WorkerPool()
    pool = ThreadPoolExecutor(jobs, initializer=_leave_interrupts)

    def run(tasks: Iterable[tuple[str, Task]]) -> Iterator[tuple[str, CellOutcome]]:
        waiting, running = iter(tasks), dict[Future[CellOutcome], str]()
        while True:
            for name, task in islice(waiting, jobs - len(running)):
                running[pool.submit(workers.do, task, limit)] = name
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(future), future.result()

    try:
        yield run
    finally:
        workers.break_off()
        pool.shutdown(cancel_futures=True)
        workers.dismiss()


def _leave_interrupts() -> None:
    """An interrupt from the keyboard reaches the whole group; workers inherit that it is not for them."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
