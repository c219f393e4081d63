"""Interpreters of their own that do pieces of work, so that one which aborts or hangs takes nothing else with it.

Each is started fresh, never forked (numerical libraries keep threads), and does one piece after the other: functions
that are importable by name, called with what they are given and a function that tells of their progress. It ends with
the process that started it, in the middle of a piece if need be: nobody is left to hear the result.
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
"""`work(*arguments, tell)`; a `RislamError` is a result, any other exception the end of the interpreter."""

LOOK_SECONDS = 1.0
"""Longest time between two looks at whether a worker lives."""


class Lost(NamedTuple):
    """What became of a piece that was not done."""

    code: int | None
    """Exit code of its interpreter, negative for a signal; None where the time limit stopped it."""
    seconds: float


class Worker:
    """One interpreter."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        path = os.pathsep.join(os.path.abspath(part) for part in sys.path)
        self.channel, theirs = Pipe()
        with theirs:
            self.process = subprocess.Popen(
                [sys.executable, "-c", f"from rislam_rt.worker_pool import serve; serve({theirs.fileno()})"],
                env={**os.environ, **environment, "PYTHONPATH": path},
                stdin=subprocess.DEVNULL,
                stdout=2,  # what it prints goes to the error stream
                pass_fds=(theirs.fileno(),),
            )
        self.fresh = True

    def do(self, work: Work, arguments: tuple[Any, ...], limit: float | None, tell: Tell) -> Any:
        """What a piece returns, its `RislamError`, or `Lost`; the start of the interpreter does not count."""
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
        """The next message of a worker in the pool.

        Raises
        ------
        TimeoutError
            There is none until `end`.
        EOFError, OSError
            The interpreter has ended.
        """
        while not self.channel.poll(LOOK_SECONDS if end is None else min(LOOK_SECONDS, max(end - monotonic(), 0.0))):
            if not self.alive:  # a child of its own that lives on keeps the channel open
                raise EOFError
            if end is not None and monotonic() >= end:
                raise TimeoutError
        return self.channel.recv()

    def stop(self) -> None:
        """End a worker of the pool at once."""
        self.process.kill()
        self.process.wait()
        self.channel.close()

    @property
    def alive(self) -> bool:
        """Whether a worker of the pool can do another piece."""
        return self.process.poll() is None


class Pool:
    """Workers of this process; as many as pieces are done at a time."""

    def __init__(self, environment: Mapping[str, str] | None = None) -> None:
        self.environment = environment or {}
        self.idle: list[Worker] = []
        self.busy: list[Worker] = []
        self.over = False

    def do(self, work: Work, arguments: tuple[Any, ...], limit: float | None = None, tell: Tell = tell_nobody) -> Any:
        """One piece (see `Worker.do`), by an idle worker or a new one."""
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
        """End the idle workers."""
        while self.idle:
            self.idle.pop().stop()

    def break_off(self) -> None:
        """End the busy workers, and all that come; their threads hear of it, and clean up."""
        self.over = True
        for worker in list(self.busy):
            worker.process.kill()


Run = Callable[[Iterable[tuple[str, tuple[Any, ...]]]], Iterator[tuple[str, Any]]]
"""Does pieces, each a name and arguments, and gives what became of them as they are done, each with its name."""


@contextmanager
def open_pool(
    work: Work, jobs: int, *, limit: float | None = None, environment: Mapping[str, str] | None = None,
    tell: Tell = tell_nobody,
) -> Iterator[Run]:  # fmt: skip
    """Workers on this machine, `jobs` at a time. Leaving ends them, in the middle of their pieces if need be.

    Parameters
    ----------
    limit
        Longest time [s] that a piece may take.
    tell
        Called from here with a piece's name and how far it is.
    """
    pool, threads, news = Pool(environment), ThreadPoolExecutor(jobs, initializer=leave_interrupts), SimpleQueue[Any]()

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
    """Do `work(name, *common, tell)` for each name, `jobs` at a time, and give (name, result) as they are done.

    What failed gives its `RislamError` as the result; so does a process that died without a word. With one job, or one
    name, all happens in this process. Leaving the loop early ends the processes.
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


def leave_interrupts() -> None:
    """An interrupt from the keyboard reaches the whole group; workers started from here on inherit that it is not for
    them."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def serve(handle: int) -> None:
    """The life of a worker: do pieces that come over a channel until that ends."""
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
    try:
        while True:
            pieces.put(channel.recv_bytes())
    except (EOFError, OSError):
        os._exit(0)
