"""A pool of worker processes, each a Python interpreter of its own, so that a task which aborts or hangs takes nothing
else with it.

Workers are started fresh, never forked (numerical libraries keep threads), and do one task after the other: a function
that is importable by name, called with its arguments and a callback for its progress. A worker ends with the process
that started it, in the middle of a task if need be: nobody is left to hear the result.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import islice
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from queue import SimpleQueue
from threading import Thread
from time import monotonic
from typing import Any, NamedTuple

from rislam_rt.errors import RislamError
from rislam_rt.progress import Tell, tell_nobody

Work = Callable[..., Any]
"""Function of a task, called as `work(*arguments, tell)`; a `RislamError` that it raises is its result, any other
exception the end of the worker process."""

LOOK_SECONDS = 1.0
"""Longest time [s] between two checks whether a worker process lives."""


class Lost(NamedTuple):
    """Result of a task whose worker process died or was stopped at the time limit."""

    code: int | None
    """Exit code of the worker process, negative for a signal; None where the time limit stopped it."""
    seconds: float
    """Time [s] that the task had run."""


class Worker:
    """One worker process: a fresh Python interpreter that does tasks sent to it through a pipe."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        path = os.pathsep.join(os.path.abspath(part) for part in sys.path)
        self.channel, theirs = Pipe()
        with theirs:
            self.process = subprocess.Popen(
                # -P: modules are looked for where this process looks for them, and not in the working folder first
                [sys.executable, "-P", "-c", f"from rislam_rt.worker_pool import serve; serve({theirs.fileno()})"],
                env={**os.environ, **environment, "PYTHONPATH": path},
                stdin=subprocess.DEVNULL,
                stdout=2,  # what it prints goes to the error stream
                pass_fds=(theirs.fileno(),),
            )
        self.fresh = True

    def do(self, work: Work, arguments: tuple[Any, ...], limit: float | None, tell: Tell) -> Any:
        """Do a task in this worker process within a time limit [s]: its result, the `RislamError` that it raised, or
        `Lost`. Starting the interpreter does not count."""
        begin = monotonic()
        try:
            if self.fresh:
                self._hear(None)
            self.fresh, begin = False, monotonic()
            self.channel.send((work, arguments))
            while True:
                done, value = self._hear(None if limit is None else begin + limit)
                if done:
                    return value
                tell(*value)
        except TimeoutError:
            self.stop()
            return Lost(None, monotonic() - begin)
        except (EOFError, OSError):
            code = self.process.wait()
            self.stop()
            return Lost(code, monotonic() - begin)

    def _hear(self, end: float | None) -> Any:
        """Next message of a worker process before the time `end` (of `monotonic`); `EOFError` if its process ended."""
        while not self.channel.poll(LOOK_SECONDS if end is None else min(LOOK_SECONDS, max(end - monotonic(), 0.0))):
            if not self.alive:  # a child of its own that lives on keeps the channel open
                raise EOFError
            if end is not None and monotonic() >= end:
                raise TimeoutError
        return self.channel.recv()

    def stop(self) -> None:
        """Kill a worker process and close the pipe to it."""
        self.process.kill()
        self.process.wait()
        self.channel.close()

    @property
    def alive(self) -> bool:
        """Whether a worker process still runs and can do another task."""
        return self.process.poll() is None


class Pool:
    """The worker processes of this process, started as they are needed and used again."""

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        self.environment = environment or {}
        self.idle: list[Worker] = []
        self.busy: list[Worker] = []
        self.over = False

    def do(self, work: Work, arguments: tuple[Any, ...], limit: float | None = None, tell: Tell = tell_nobody) -> Any:
        """Do one task (see `Worker.do`) in an idle worker process, or in a new one."""
        worker = self.idle.pop() if self.idle else Worker(self.environment)
        if not worker.alive:
            worker.stop()
            worker = Worker(self.environment)
        self.busy.append(worker)
        if self.over:
            worker.process.kill()
        try:
            return worker.do(work, arguments, limit, tell)
        finally:
            self.busy.remove(worker)
            if worker.alive:
                self.idle.append(worker)

    def dismiss(self) -> None:
        """Kill the idle worker processes."""
        while self.idle:
            self.idle.pop().stop()

    def break_off(self) -> None:
        """Kill the busy worker processes and all that are started later; the threads that wait for them get `Lost`, and
        clean up."""
        self.over = True
        for worker in list(self.busy):
            worker.process.kill()


Run = Callable[[Iterable[tuple[str, tuple[Any, ...]]]], Iterator[tuple[str, Any]]]
"""Function that does tasks, each a name and its arguments, and yields (name, result) as they are done."""


@contextmanager
def open_pool(
    work: Work, jobs: int, *, limit: float | None = None, environment: Mapping[str, str] | None = None,
    tell: Tell = tell_nobody,
) -> Iterator[Run]:  # fmt: skip
    """Open a pool of worker processes that does `jobs` tasks at a time; leaving the context kills them, in the middle
    of their tasks if need be.

    Parameters
    ----------
    limit
        Longest time [s] that a piece may take.
    tell
        Called from here with a piece's name and how far it is.
    """
    pool, news = Pool(environment), SimpleQueue[Any]()
    # an interrupt from the keyboard reaches the whole process group: neither these threads nor their workers answer it
    blocked = (signal.SIG_BLOCK, {signal.SIGINT})
    threads = ThreadPoolExecutor(jobs, initializer=signal.pthread_sigmask, initargs=blocked)

    def lead(name: str, arguments: tuple[Any, ...]) -> None:
        try:
            found = pool.do(work, arguments, limit, lambda _, at, total: news.put((name, False, (at, total))))
        except BaseException as error:  # the loop below must hear of it, whatever it is
            found = error
        news.put((name, True, found))

    def run(pieces: Iterable[tuple[str, tuple[Any, ...]]]) -> Iterator[tuple[str, Any]]:
        waiting, running = iter(pieces), 0
        while True:
            for piece in islice(waiting, jobs - running):
                threads.submit(lead, *piece)
                running += 1
            if not running:
                return
            name, done, value = news.get()
            if done:
                running -= 1
                if isinstance(value, BaseException) and not isinstance(value, RislamError):
                    raise value
                yield name, value
            else:
                tell(name, *value)

    try:
        yield run
    finally:
        pool.break_off()
        threads.shutdown(cancel_futures=True)
        pool.dismiss()


def run_side_by_side(
    work: Work, names: Iterable[str], common: tuple[Any, ...], jobs: int, tell: Tell
) -> Iterator[tuple[str, Any]]:
    """Run `work(name, *common, tell)` for each name in worker processes, `jobs` at a time, and yield (name, result) as
    they are done.

    The result of what failed is its `RislamError`; so is that of a process that died without a word. With one job, or
    one name, all happens in this process. Leaving the loop early ends the processes.
    """
    names = list(names)
    if jobs <= 1 or len(names) <= 1:
        for name in names:
            try:
                yield name, work(name, *common, tell)
            except RislamError as error:
                yield name, error
        return
    with open_pool(work, min(jobs, len(names)), tell=tell) as run:
        for name, found in run((name, (name, *common)) for name in names):
            if isinstance(found, Lost):
                found = RislamError(f"{name}: its process died (exit code {found.code}); run it again alone")
            yield name, found


def serve(handle: int) -> None:
    """Main loop of a worker process: do the tasks that come through a pipe until it closes."""
    channel: Any = Connection(handle)
    pieces = SimpleQueue[bytes]()
    Thread(target=_listen, args=(channel, pieces), daemon=True).start()
    channel.send((True, None))
    while True:
        work, arguments = ForkingPickler.loads(pieces.get())
        try:
            found = work(*arguments, lambda *item: channel.send((False, item)))
        except RislamError as error:
            found = error
        channel.send((True, found))


def _listen(channel: Any, pieces: "SimpleQueue[bytes]") -> None:
    """Put the messages of a worker process's pipe into a queue, and end the process when the pipe closes."""
    try:
        while True:
            pieces.put(channel.recv_bytes())
    except (EOFError, OSError):
        os._exit(0)
