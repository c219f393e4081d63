"""Interrupts, Ctrl-C and SIGTERM as a queue sends it: the work ends in order, and says so in one line."""

import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Timer
from types import FrameType

EXIT_CODE = 130
AGAIN_SECONDS = 0.05


class Interrupted(Exception):
    """The work ended at a signal; the message is the line that says what is kept."""


@contextmanager
def interruptible() -> Iterator[list[int]]:
    """Answer both signals by a `KeyboardInterrupt`; gives the list of signals that were heard.

    An interrupt that the parent has told us to ignore, as a shell does in the background, stays ignored. One that falls
    into a destructor, where Python drops it, comes again a moment later.
    """
    answered, heard, at_work = [signal.SIGTERM], list[int](), Event()
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        answered.append(signal.SIGINT)

    def interrupt(number: int, frame: FrameType | None) -> None:
        heard.append(number)
        raise KeyboardInterrupt

    def repeat() -> None:
        if at_work.is_set():
            signal.raise_signal(signal.SIGTERM)

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
    """While Python ends, there is nothing left to interrupt.

    Signals are blocked, not ignored: where an interrupt fell into code that a library makes from text, `python -m`
    would end by a signal to itself, and not with our exit code.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGTERM))
