"""Writing of files whole or not at all, by temporary names, and removal of temporary files of killed processes."""

import csv
import io
import json
import os
import re
import tempfile
from collections.abc import Iterable, Mapping
from contextlib import suppress
from errno import EACCES, ELOOP, ENOTDIR
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

from rislam_rt.errors import ConfigError, StoreError

PREFIX, SUFFIX = ".rislam-rt-", ".tmp"
TEMPORARY = re.compile(r"\.rislam-rt-[a-z0-9_]{8}\.tmp")
"""Pattern of the names of temporary files; the program removes no other files."""

MARK = "made by rislam-rt"
"""Text in every file that a command writes under a name that the user gave, by which it is recognised."""
RECORDING = (b"RRF", b"rislam_rt")
"""First bytes of a Rerun recording, and the application name in it, by which it is recognised."""


def is_own(path: Path) -> bool:
    """Whether a file may be written to a path: there is none, an empty one, or one that this program made (`MARK`)."""
    if not path.is_file() or path.stat().st_size == 0 or is_device(path):
        return True
    try:
        with path.open("rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as content:
            head, application = RECORDING
            return content.find(MARK.encode()) >= 0 or (content[:3] == head and content.find(application) >= 0)
    except OSError:  # not to be read, so not known to be ours
        return False


def json_file(content: Any, *, indent: int = 1, sort_keys: bool = False) -> bytes:
    """Encode plain data as the content of a JSON file; NaN and infinity are errors."""
    return (json.dumps(content, indent=indent, sort_keys=sort_keys, allow_nan=False) + "\n").encode()


def csv_file(head: Iterable[str], rows: Iterable[Iterable[Any]]) -> bytes:
    """Encode column names and rows as the content of a CSV file."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([head, *rows])
    return text.getvalue().encode(errors="backslashreplace")


def write_all(folder: Path, files: Mapping[str, bytes]) -> Path:
    """Write files (relative name -> content) to a folder, each whole or not at all; return the path of the first.

    Raises
    ------
    StoreError
        The disk refused.
    """
    for name, content in files.items():
        write_atomic(folder / name, content)
    return folder / next(iter(files))


def write_atomic(path: Path, content: bytes) -> None:
    """Write a file whole or not at all: to a temporary file beside `path` that is renamed; a device is written to.

    Raises
    ------
    StoreError
        The disk refused.
    """
    write_pieces(path, [content])


def write_pieces(path: Path, pieces: Iterable[bytes]) -> None:
    """Write a file whole or not at all as `write_atomic` does, from pieces of content that are never all in memory.

    Raises
    ------
    StoreError
        The disk refused.
    """
    try:
        if is_device(path):
            with os.fdopen(os.open(path, os.O_WRONLY | os.O_APPEND), "wb") as device:
                device.writelines(pieces)
            return
        path = led_to(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=PREFIX, suffix=SUFFIX, dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                file.writelines(pieces)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise refused(path, error) from None


def led_to(path: Path) -> Path:
    """Path that writing a file to `path` creates or replaces: links are resolved, so that they stay.

    Raises
    ------
    StoreError
        It is a link that leads to itself.
    """
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise refused(path, OSError(ELOOP, os.strerror(ELOOP)))
    return target


def is_device(path: Path) -> bool:
    """Whether a file's path is a device, a pipe or a standard stream, which must not be replaced by a file."""
    return path.exists() and not path.is_dir() and (not path.is_file() or path.parent == Path("/dev"))


def remove_temporaries(folders: Iterable[Path]) -> None:
    """Remove the temporary files of killed processes from folders to which no other process is writing."""
    for folder in folders:
        with suppress(OSError):
            for entry in os.scandir(folder):
                if TEMPORARY.fullmatch(entry.name) and entry.is_file(follow_symlinks=False):
                    os.unlink(entry.path)


def has_marker(folder: Path, marker: str, ignored: str, what: str, option: str = "") -> bool:
    """Whether a folder of output files holds the file `marker`; if not, it must be empty (but for `ignored`), or not
    there.

    Raises
    ------
    ConfigError
        It holds something else than `what`, or cannot be read; the line begins with `option`.
    """
    try:
        names = [entry.name for entry in folder.iterdir()]
    except FileNotFoundError:
        return False
    except OSError as error:
        raise ConfigError(f"{option}{folder}: cannot be used ({error.strerror}); give another folder") from None
    if marker not in names and not all(name == ignored or TEMPORARY.fullmatch(name) for name in names):
        raise ConfigError(f"{option}{folder}: exists and is not a {what}; give a folder that does not exist yet")
    return marker in names


def make_folders(folder: Path) -> list[Path]:
    """Create a folder for files and those above it; return those that did not exist, the outermost first.

    Raises
    ------
    StoreError
        The disk refused.
    """
    try:
        missing = [place for place in (folder, *folder.parents) if not place.exists()][::-1]
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise refused(folder, error) from None
    return missing


def check_writable(folder: Path) -> None:
    """Check that files can be written to a folder, which may not exist yet, before results for it are computed.

    Raises
    ------
    StoreError
        It cannot.
    """
    place = next((one for one in (folder, *folder.absolute().parents) if os.path.lexists(one)), Path("/"))
    try:
        if not os.path.isdir(os.path.realpath(place, strict=True)):
            raise NotADirectoryError(ENOTDIR, os.strerror(ENOTDIR))
        if not os.access(place, os.W_OK | os.X_OK):
            raise PermissionError(EACCES, os.strerror(EACCES))
    except OSError as error:
        raise refused(folder, error) from None


def remove_empty(folders: Iterable[Path]) -> None:
    """Remove those of the folders of files (outermost first) that are empty."""
    for folder in reversed(list(folders)):
        with suppress(OSError):
            folder.rmdir()


def refused(path: Path, error: OSError) -> StoreError:
    """One-line error for a file that the operating system refused to write."""
    return StoreError(f"{path}: cannot be written ({error.strerror}); check permissions and free space")
