"""Verbosity of commands: `-q` without progress bars and warnings, `-v` with versions, times and tracebacks."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any, NamedTuple

import typer

Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress bars and no warnings.")]
Verbose = Annotated[
    bool, typer.Option("--verbose", "-v", help="Also versions and time taken, and where in the program it failed.")
]


class Verbosity(NamedTuple):
    """Options `--quiet` and `--verbose` of the running command."""

    quiet: bool = False
    verbose: bool = False


_now = Verbosity()


def verbosity() -> Verbosity:
    """Verbosity of the running command."""
    return _now


def reset() -> None:
    """Reset the verbosity to neither quiet nor verbose, before a command."""
    global _now
    _now = Verbosity()


def warn(line: str) -> None:
    """Print a warning on the error stream, unless the verbosity is quiet."""
    if not _now.quiet:
        typer.echo(f"warning: {line}", err=True)


def with_verbosity(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options `--quiet` and `--verbose` to a command."""

    @wraps(command)
    def wrapped(*arguments: Any, quiet: bool = False, verbose: bool = False, **options: Any) -> Any:
        global _now
        _now = Verbosity(quiet, verbose)
        if not verbose:
            return command(*arguments, **options)
        return _watched(command, *arguments, **options)

    return with_switches(wrapped, command, quiet=Quiet, verbose=Verbose)


def with_switches(wrapped: Callable[..., Any], command: Callable[..., Any], **switches: Any) -> Callable[..., Any]:
    """Give a wrapper of a command the command's signature with options of verbosity, such as `--quiet`, added."""
    own = inspect.signature(command)
    more = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=kind)
            for name, kind in switches.items()]  # fmt: skip
    wrapped.__signature__ = own.replace(parameters=[*own.parameters.values(), *more])  # type: ignore[attr-defined]
    wrapped.__annotations__ = {**command.__annotations__, **switches}
    return wrapped


def _watched(command: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Run a command and print library versions and the time that it took, for the verbosity `-v`."""
    from time import perf_counter, process_time

    from rislam_rt.pipeline.run import library_versions

    typer.echo(", ".join(f"{name} {number}" for name, number in library_versions().items()), err=True)
    begin, used = perf_counter(), process_time()
    try:
        return command(*arguments, **options)
    finally:
        taken = f"{perf_counter() - begin:.1f} s, {process_time() - used:.1f} s of processor time in this process"
        typer.echo(f"took {taken}", err=True)
