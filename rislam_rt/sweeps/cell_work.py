"""Work on one cell of a sweep: calls its function in a worker process, and records its plain result or failure."""

import math
import os
from collections.abc import Mapping
from importlib import import_module
from time import perf_counter, process_time
from typing import Any, NamedTuple

from rislam_rt.errors import ConfigError, RislamError

RAISED, DIED, HUNG, LOST = "raised", "died", "hung", "lost"
"""Causes of a cell's failure: an exception; the end of its process; the time limit; a signal from outside, after which
the cell is tried again."""


class Task(NamedTuple):
    """Work order for one cell of a sweep: function, settings and seed."""

    function: str
    """`module:function`."""
    settings: Mapping[str, Any]
    seed: int


class CellOutcome(NamedTuple):
    """Result or failure of one cell of a sweep and its time, as plain data that can be sent between processes."""

    result: Mapping[str, Any] | None = None
    """Result of the function; None if it failed."""
    cause: str = ""
    """Empty if it did not fail, else `RAISED`, `DIED`, `HUNG` or `LOST`."""
    message: str = ""
    """One line on the failure; the same failure has the same message in every run."""
    seconds: float = 0.0
    """Elapsed time [s]."""
    cpu_seconds: float = 0.0
    """CPU time [s]."""
    host: str = ""
    """Name of the machine."""
    timing: Mapping[str, Any] | None = None
    """Times that the function itself returned."""


def attempt(task: Task, tell: object = None) -> CellOutcome:
    """Call the function of one cell with its settings and seed, and return its result or, if it raised, the error.

    `tell`, the worker pool's report of progress, is not used.
    """
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
    """Import the function of a sweep's cells by its name `module:function`.

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
    """Type and first line of an exception, as the message of a sweep's failed cell."""
    text = str(error).strip().splitlines()
    kind = "" if isinstance(error, RislamError) else f"{type(error).__name__}: "
    return (kind + (text[0] if text else "")).rstrip(": ")[:500]


def plain_result(result: Any) -> dict[str, Any]:
    """Convert the result of a cell's function to plain data as in JSON: arrays to lists, NaN and infinity to None.

    Raises
    ------
    RislamError
        It is no mapping of names to numbers, text, lists and mappings of these.
    """
    if not isinstance(result, Mapping) or not all(isinstance(name, str) for name in result):
        raise RislamError(f"the cell returned {type(result).__name__}; return a mapping of names to values")
    return {name: _plain(name, value) for name, value in result.items()}


def _plain(name: str, value: Any) -> Any:
    """One value of a cell's result as plain data."""
    if hasattr(value, "tolist"):  # of numpy, which a worker does not import by itself: cells that need it do
        value = value.tolist()
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [_plain(name, part) for part in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(f"{name}.{key}", part) for key, part in value.items()}
    raise RislamError(f"the cell returned {name} = {type(value).__name__}; return numbers, text, lists or mappings")
