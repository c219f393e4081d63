"""Entry point of the command line: runs a command, prints expected errors in one line each, returns the exit code."""

import os
import sys
from io import TextIOWrapper
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rislam_rt.errors import RislamError

LONGEST = 1000
"""Largest number of characters of an error line; the middle of a longer one, which repeats a user's text, is cut."""


def main() -> None:
    """Run the command of the command line `rislam-rt` and exit with its exit code; expected errors are one line."""
    try:
        import atexit

        from rislam_rt.cli.interrupts import EXIT_CODE, Interrupted, end_quietly, interruptible

        # One thread: the matrices are small, and sums in one order give the same bits on every machine.
        for library in ("OMP", "OPENBLAS", "MKL"):
            os.environ.setdefault(f"{library}_NUM_THREADS", "1")
        if isinstance(sys.stdout, TextIOWrapper) and sys.stdout.errors == "strict":
            sys.stdout.reconfigure(errors="backslashreplace")  # as of stderr: a file's name need not be text
        with interruptible() as heard:
            try:
                code = _run(heard)
            except Interrupted as told:
                code = _say(str(told), EXIT_CODE)
        atexit.register(end_quietly)
    except KeyboardInterrupt:
        code = _say("interrupted", 130)
    sys.exit(code)


def _run(heard: list[int]) -> int:
    """Run the command of the command line and return its exit code; `heard` are the interrupt signals that came."""
    import typer

    from rislam_rt.cli.app import app
    from rislam_rt.cli.interrupts import EXIT_CODE, Interrupted
    from rislam_rt.cli.verbosity import reset
    from rislam_rt.errors import RislamError, disk_error

    reset()
    try:
        words = [at_home(word) for word in sys.argv[1:]]
        code = app(words or ["--help"], prog_name="rislam-rt", standalone_mode=False)
    except RislamError as error:
        if heard:  # it reached the workers too, and the first to die was mourned
            return _say("interrupted: what is done is kept; the same command goes on from there", EXIT_CODE)
        return _tell(error)
    except OSError as error:  # a name or a disk that nobody looked at more closely
        return _say("interrupted", EXIT_CODE) if heard else _tell(disk_error(error))
    except typer.Abort:
        return _say("interrupted", EXIT_CODE)
    except Exception as error:
        # Wrong usage: the parser's exceptions have no public base class, but all can say what is wrong.
        if not hasattr(error, "format_message"):
            if heard and not isinstance(error, Interrupted):  # what was being imported took it for a fault of its own
                return _say("interrupted", EXIT_CODE)
            raise
        command = getattr(getattr(error, "ctx", None), "command_path", "rislam-rt")
        return _say(f"error: {_plain(error.format_message().rstrip('.'))}; see {command} --help", 2)
    if code == EXIT_CODE:  # an interrupt that no command has answered
        return _say("interrupted", EXIT_CODE)
    return code if isinstance(code, int) else 0


def at_home(word: str) -> str:
    """Word of the command line with a home folder `~` at its beginning, or that of its value, written out: shells leave
    it alone behind `=`, and a folder that is called `~` is one that nobody wants."""
    name, equals, value = word.rpartition("=")
    return name + equals + os.path.expanduser(value) if value.startswith("~") else os.path.expanduser(word)


def _plain(message: str) -> str:
    """The command line parser's message on wrong usage in plain words: `give at least 1`."""
    import re

    from rislam_rt.input_messages import BOUNDS

    message = re.sub(", unable to parse .*", "", message.replace("Value error, ", ""))
    for long, plain in BOUNDS.items():
        message = message.replace(f"Input should be {long}", f"give {plain}")
    return message.replace("Input should be ", "give ")


def _tell(error: "RislamError") -> int:
    """Print the messages of an error, a line each (and the traceback if verbose), and return its exit code."""
    from rislam_rt.cli.verbosity import verbosity

    if verbosity().verbose:
        import traceback

        traceback.print_exception(error)
    for line in error.lines:
        _say(f"error: {line}", error.exit_code)
    return error.exit_code


def _say(line: str, code: int) -> int:
    """Print one line on the error stream, the middle of a long one cut, and return the exit code `code`."""
    line = " ".join(line.split())
    print(line if len(line) <= LONGEST else f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}", file=sys.stderr)
    return code
