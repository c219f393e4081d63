"""Interrupts by Ctrl-C or by SIGTERM (as a batch queue sends it): a command stops in order with a one-line message."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Timer, main_thread
from types import FrameType

EXIT_CODE = 130
"""Exit code of an interrupted command."""
AGAIN_SECONDS = 0.05
"""Time [s] after which an interrupt that Python dropped is raised again."""


class Interrupted(Exception):
    """Error of a command that an interrupt stopped; its message says what results are kept."""


@contextmanager
def interruptible() -> Iterator[list[int]]:
    """Raise `KeyboardInterrupt` on Ctrl-C and on SIGTERM within this context; yields the list of signals received.

    A Ctrl-C that the parent process has set to be ignored, as a shell does for background jobs, stays ignored. An
    interrupt that falls into a destructor, where Python drops it, is raised again a moment later.
    """
    answered, heard, at_work = [signal.SIGTERM], list[int](), Event()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        answered.append(signal.SIGINT)

    def interrupt(number: int, frame: FrameType | None) -> None:
        heard.append(number)
        raise KeyboardInterrupt

    def repeat() -> None:
        if at_work.is_set():
            signal.pthread_kill(main_thread().ident or 0, signal.SIGTERM)  # which may be asleep: to it, not to this one

    def dropped(what: "sys.UnraisableHookArgs") -> None:
        if isinstance(what.exc_value, KeyboardInterrupt):
            again = Timer(AGAIN_SECONDS, repeat)
            again.daemon = True
            again.start()
        else:
            hook(what)

    hook, sys.unraisablehook = sys.unraisablehook, dropped
    before = {one: signal.signal(one, interrupt) for one in answered}
    at_work.set()
    try:
        yield heard
    finally:
        at_work.clear()
        for one, handler in before.items():
            signal.signal(one, handler)
        sys.unraisablehook = hook


def end_quietly() -> None:
    """Block interrupt signals while Python exits, so that the exit code stands.

    They are blocked, not ignored: where an interrupt fell into code that a library makes from text, `python -m` would
    end by a signal to itself, and not with our exit code.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
