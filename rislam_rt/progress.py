"""Callbacks that report the progress of long computations."""

from collections.abc import Callable
from time import monotonic

Tell = Callable[[str, int, int], None]
"""Callback to which a computation reports its progress: a stage's name, the steps done, and their total."""


EVERY = 30.0
"""Least time [s] between two plain lines on the progress of one stage: a run of minutes has a few."""


def plain_lines(write: Callable[[str], None], clock: Callable[[], float] = monotonic) -> Tell:
    """Callback that writes a plain line on the progress of a stage every `EVERY` seconds or so, for a log: share done
    and time left in that stage, at the rate since its first report. `clock` gives the time [s]."""
    begun: dict[str, tuple[float, int]] = {}
    said: dict[str, float] = {}

    def tell(stage: str, at: int, total: int) -> None:
        now = clock()
        begin, first = begun.setdefault(stage, (now, at))
        if now - said.setdefault(stage, begin) < EVERY or not first < at < total:
            return
        said[stage] = now
        left = (now - begin) / (at - first) * (total - at)
        write(f"{stage}: {at} of {total} ({at / total:.0%}), {hours(left)} left")

    return tell


def hours(seconds: float) -> str:
    """Spelling `h:mm:ss` of a time [s] in reports of progress."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def tell_nobody(stage: str, at: int, total: int) -> None:
    """Ignore a report of progress: the callback for computations whose progress nobody shows."""
