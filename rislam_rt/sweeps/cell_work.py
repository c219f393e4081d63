"""One cell: what a worker is given, and what became of it."""

import os
from collections.abc import Mapping
from importlib import import_module
from time import perf_counter, process_time
from typing import Any, NamedTuple

from rislam_rt.errors import ConfigError, RislamError
from rislam_rt.sweeps.plain_data import plain_result

RAISED, DIED, HUNG, LOST = "raised", "died", "hung", "lost"
"""Causes of a failure: an exception; the end of the process; the time limit; a blow from outside, which the cell may
not have deserved, so that it is tried again."""


class Task(NamedTuple):
    """All that a worker needs to know."""

    function: str
    settings: Mapping[str, Any]
    seed: int


class CellOutcome(NamedTuple):
    """What became of a cell: plain data, ready for the wire."""

    result: Mapping[str, Any] | None = None
    """If it ended well."""
    cause: str = ""
    """Empty if it ended well, else `RAISED`, `DIED`, `HUNG` or `LOST`."""
    message: str = ""
    """One line; nothing in it differs from run to run unless the failure does."""
    seconds: float = 0.0
    """On the clock."""
    cpu_seconds: float = 0.0
    host: str = ""
    timing: Mapping[str, Any] | None = None
    """What the function itself says of its times."""


def attempt(task: Task, tell: object = None) -> CellOutcome:
    """Do one cell's work; an exception is an outcome. A cell has no progress to `tell` of."""
    begin, cpu = perf_counter(), process_time()
    result, cause, message, timing = None, "", "", None
    try:
        function = find_function(task.function)
        begin, cpu = perf_counter(), process_time()  # imports do not count: the next cell has none
        found = plain_result(function(task.settings, task.seed))
        timing = found.pop("timing", None)
        result = found
    except BaseException as error:  # SystemExit too: a library must not end the worker without a word
        cause, message = RAISED, one_line(error)
    return CellOutcome(
        result, cause, message, perf_counter() - begin, process_time() - cpu, os.uname().nodename, timing
    )


def find_function(name: str) -> Any:
    """The function of `module:function` that does a cell's work.

    Raises
    ------
    ConfigError
        There is none.
    """
    module, _, function = name.partition(":")
    try:
        found = getattr(import_module(module), function)
    except (ImportError, AttributeError) as error:
        raise ConfigError(f"sweep function: '{name}' cannot be imported ({error}); check its name") from None
    if not callable(found):
        raise ConfigError(f"sweep function: '{name}' is no function; give 'package.module:function'")
    return found


def one_line(error: BaseException) -> str:
    """Kind and first line of an exception in a cell's work."""
    text = str(error).strip().splitlines()
    kind = "" if isinstance(error, RislamError) else f"{type(error).__name__}: "
    return (kind + (text[0] if text else "")).rstrip(": ")[:500]
