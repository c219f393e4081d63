"""The life of a worker: an interpreter that does one cell after another, told and telling in lines of JSON.

`main` takes a `Task` a line on its standard input and gives a `CellOutcome` a line on its standard output. It ends with
its input, in the middle of a cell if need be: nobody is left to hear the result.
"""

import json
import os
from collections.abc import Mapping
from importlib import import_module
from queue import SimpleQueue
from threading import Thread
from time import perf_counter, process_time
from typing import Any, NamedTuple, TextIO

from rislam_rt.errors import ConfigError, RislamError
from rislam_rt.sweeps.record import plain_result

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


def attempt(task: Task) -> CellOutcome:
    """Do one cell; an exception is an outcome."""
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
    """The function of `module:function`.

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
    """Kind and first line of an exception."""
    text = str(error).strip().splitlines()
    kind = "" if isinstance(error, RislamError) else f"{type(error).__name__}: "
    return (kind + (text[0] if text else "")).rstrip(": ")[:500]


def main() -> None:
    """Serve until the input ends. Cells read nothing, and what they print goes to the error stream."""
    mouth = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    tasks: SimpleQueue[Task] = SimpleQueue()
    ear = os.fdopen(os.dup(0), encoding="utf-8")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    Thread(target=_listen, args=(ear, tasks), daemon=True).start()
    mouth.write("ready\n")
    while True:
        mouth.flush()
        mouth.write(json.dumps(attempt(tasks.get()), allow_nan=False) + "\n")


def _listen(ear: TextIO, tasks: "SimpleQueue[Task]") -> None:
    for line in ear:
        tasks.put(Task(*json.loads(line)))
    os._exit(0)
