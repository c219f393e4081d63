"""Output files of commands: checks that no file of the user's is replaced unless `--overwrite` is given."""

import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer

from rislam_rt.cli.verbosity import with_switches
from rislam_rt.errors import ConfigError
from rislam_rt.storage.files import MARK, check_writable, is_device, is_own, json_file, led_to, write_atomic

OUTPUT = "a file to write"
"""Mark, in an option's annotation, of a file that the command writes."""
PAGE_MARK = re.compile(rb"ritten\s+by\s+`rislam-rt\b")
"""Text in the head of every study's page, by which the program's own pages are recognised."""
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace files that this program did not make.")]

_may_overwrite = False


def with_overwrite(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the option `--overwrite` to a command that writes files, and check these files before the command runs."""
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
    """Check that a command may write an output file, and return its path.

    Raises
    ------
    ConfigError
        It is a folder; or it exists, is not empty and was not made by this program, and `--overwrite` is not given.
    StoreError
        Its folder cannot be written to.
    """
    if file is None:
        return None
    if file.is_dir():
        raise ConfigError(f"{option}{file}: is a folder; give the name of a file")
    if not is_device(file):
        check_writable(led_to(file).parent)
    if not _may_overwrite and not is_own(file):
        raise ConfigError(
            f"{option}{file}: is there already, and not of this program's making; give another name, or --overwrite"
        )
    return file


def check_ending(option: str, file: Path | None, endings: Sequence[str]) -> None:
    """Check that an output file's name has one of the endings of its format, or none.

    Raises
    ------
    ConfigError
        It has that of another.
    """
    if file is not None and file.suffix and file.suffix.lower() not in endings:
        raise ConfigError(f"{option} {file}: not of that ending; give a name that ends in {' or '.join(endings)}")


def page_files(name: str, *, figure: bool = False) -> tuple[str, ...]:
    """Names of the output files of a study: page, table, data, and the figure if there is one."""
    return (f"{name}.md", f"{name}.csv", f"{name}.json", *([f"figures/{name}.png"] if figure else []))


def study_folder(out: Path | None, name: str, record: Mapping[str, Any], files: Sequence[str]) -> Path:
    """Output folder of a study, checked: `--out`, which may hold other files, or `runs/<name>-<hash of the record>`.

    `files` are those that it will write there, its page first; they count as the program's own if the page is.

    Raises
    ------
    ConfigError
        It is a file; or one of the study's files exists, is not empty and not the program's own, and `--overwrite` is
        not given.
    StoreError
        It cannot be written to.
    """
    from rislam_rt.pipeline.store.identity import short_name
    from rislam_rt.storage.checksums import checksum

    folder = out or Path("runs") / short_name(name, checksum(record))
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"--out {folder}: is a file; give a folder")
    for place in {folder, *((folder / one).parent for one in files)}:
        check_writable(place)
    if _may_overwrite or _is_page(folder / files[0]):
        return folder
    for file in (folder / one for one in files):
        if file.is_file() and file.stat().st_size:
            raise ConfigError(
                f"--out {folder}: {file} is there already, and not of this program's making; give another folder, or "
                "--overwrite"
            )
    return folder


def _is_page(file: Path) -> bool:
    """Whether an output file is a page that a study of this program wrote, and may be replaced."""
    try:
        return PAGE_MARK.search(file.read_bytes()) is not None
    except OSError:
        return False


def write_json(file: Path | None, content: dict[str, Any]) -> None:
    """Write the JSON file of the option `--json` whole or not at all; nothing if it was not asked for.

    Raises
    ------
    StoreError
        The disk refused.
    """
    if file is not None:
        write_atomic(file, json_file({**content, "origin": MARK}, indent=2))
