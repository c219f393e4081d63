"""Ctrl-C, and SIGTERM as a queue sends it: the work ends in order, and says so in one line."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

EXIT_CODE = 130


class Interrupted(Exception):
    """The work ended at a signal; the message is the line that says what is kept."""


@contextmanager
def interruptible() -> Iterator[None]:
    """Answer both signals by one `KeyboardInterrupt`; those that follow find the work ending already.

    An interrupt that the parent has told us to ignore, as a shell does in the background, stays ignored.
    """
    answered = [signal.SIGTERM]
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        answered.append(signal.SIGINT)

    def interrupt(number: int, frame: FrameType | None) -> None:
        for one in answered:
            signal.signal(one, signal.SIG_IGN)
        raise KeyboardInterrupt

    before = {one: signal.signal(one, interrupt) for one in answered}
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
