"""Schemes side by side: one process each, so that two cores do two schemes at once."""

import multiprocessing as mp
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple

from rislam_rt.errors import RislamError

Work = Callable[..., Any]
"""`work(name, *common, tell)` does one piece; it must be importable by name."""

Tell = Callable[[str, int, int], None]


class SchemeWorker(NamedTuple):
    """A process and what it says."""

    name: str
    process: BaseProcess
    ear: Connection


def run_side_by_side(
    work: Work, names: Sequence[str], common: tuple[Any, ...], jobs: int, tell: Tell, *, apart: bool = False
) -> Iterator[tuple[str, Any]]:
    """Do each named piece of work, `jobs` at a time, and give (name, result) as they are done.

    What failed gives its `RislamError` as the result; so does a process that died without a word. With one job, or one
    name, all happens in this process, unless the work is to be kept apart. Leaving the loop early ends the processes.
    """
    if not apart and (jobs <= 1 or len(names) <= 1):
        for name in names:
            try:
                yield name, work(name, *common, tell)
            except RislamError as error:
                yield name, error
        return
    waiting, running = list(names), list[SchemeWorker]()
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                running.append(_start(work, waiting.pop(0), common))
            for ear in list(wait([worker.ear for worker in running])):
                worker = next(w for w in running if w.ear is ear)
                word, value = _hear(worker)
                if word == "at":
                    tell(worker.name, *value)
                    continue
                running.remove(worker)
                worker.process.join()
                yield worker.name, value
    finally:
        for worker in running:
            worker.process.terminate()
            worker.process.join()


def _start(work: Work, name: str, common: tuple[Any, ...]) -> SchemeWorker:
    """Start a fresh interpreter (never a fork: numerical libraries keep threads) on one piece of work."""
    context = mp.get_context("spawn")
    ear, mouth = context.Pipe(duplex=False)
    process = context.Process(target=_run, args=(mouth, work, name, common), daemon=True)
    with _deaf():
        process.start()
    mouth.close()
    return SchemeWorker(name, process, ear)


@contextmanager
def _deaf() -> Iterator[None]:
    """A process started in here hears no interrupt of the keyboard, which reaches the whole group, from its first
    instruction on; this one hears afterwards what came meanwhile."""
    resource_tracker.ensure_running()  # first: starting it would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _run(mouth: Connection, work: Work, name: str, common: tuple[Any, ...]) -> None:
    """The life of a worker; an interrupt from the keyboard is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(BrokenPipeError):
        try:
            mouth.send(("done", work(name, *common, lambda _, at, total: mouth.send(("at", (at, total))))))
        except RislamError as error:
            mouth.send(("failed", error))


def _hear(worker: SchemeWorker) -> tuple[str, Any]:
    try:
        word, value = worker.ear.recv()
    except EOFError:
        worker.process.join()
        code = worker.process.exitcode
        return "failed", RislamError(f"{worker.name}: its process died (exit code {code}); run it again alone")
    return str(word), value
