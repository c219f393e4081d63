"""Files that a command is asked to write: one that is there and not of this program's making stays."""

import inspect
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer

from rislam_rt.cli.verbosity import with_switches

OUTPUT = "a file to write"
"""Marks, in an option's annotation, the file that the command writes."""
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace files that this program did not make.")]

_may_overwrite = False


def with_overwrite(command: Callable[..., Any]) -> Callable[..., Any]:
    """A command with `--overwrite` behind its own options, if some of those name files to write; these are looked at
    before anything is worked out."""
    own = inspect.signature(command).parameters.values()
    outputs = [one.name for one in own if OUTPUT in getattr(one.annotation, "__metadata__", ())]
    if not outputs:
        return command

    @wraps(command)
    def wrapped(*arguments: Any, overwrite: bool = False, **options: Any) -> Any:
        global _may_overwrite
        _may_overwrite = overwrite
        for name in outputs:
            check_output(options[name], f"--{name} ")
        return command(*arguments, **options)

    return with_switches(wrapped, command, overwrite=Overwrite)


def check_output(file: Path | None, option: str = "") -> Path | None:
    """The file that the running command is to write, if it may.

    Raises
    ------
    ConfigError
        It is there, is not empty, and was not made by this program; and the command was not told to overwrite it.
    """
    from rislam_rt.errors import ConfigError
    from rislam_rt.storage.files import is_own

    if file is not None and not _may_overwrite and not is_own(file):
        raise ConfigError(
            f"{option}{file}: is there already, and not of this program's making; give another name, or --overwrite"
        )
    return file
