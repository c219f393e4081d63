"""Seals on JSON data: a schema version and a checksum, so that a file changed on disk is noticed when it is read."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rislam_rt.errors import ResultError

SCHEMA = 1
"""Schema version of run folders and sweep folders, increased when the meaning of an entry changes."""


def seal(content: Mapping[str, Any]) -> dict[str, Any]:
    """Add schema version and checksum to plain data."""
    found = {"schema": SCHEMA, **content}
    return {**found, "checksum": checksum(found)}


def read_sealed(file: Path) -> dict[str, Any]:
    """Read a JSON file, and check its schema version and checksum.

    Raises
    ------
    ResultError
        It cannot be read, or is not as it was written.
    """
    try:
        content = json.loads(file.read_bytes())
        if not isinstance(content, dict) or "schema" not in content or "checksum" not in content:
            raise ResultError(f"{file}: no schema or no checksum, so not written by this version; give another folder")
        if content["schema"] != SCHEMA:
            text = repr(content["schema"])[:20]
            raise ResultError(f"{file}: schema {text}, this version reads {SCHEMA}; give another folder")
        if content["checksum"] != checksum({key: value for key, value in content.items() if key != "checksum"}):
            raise ResultError(f"{file}: changed since it was written (its checksum does not fit); give another folder")
        return content
    except OSError as error:
        raise ResultError(f"{file}: cannot be read ({error.strerror}); give another folder") from None
    except (ValueError, RecursionError):
        raise ResultError(f"{file}: not JSON, so damaged or not ours; give another folder") from None


def checksum(content: Any) -> str:
    """Checksum (SHA-256) of plain data, encoded as JSON with sorted keys and shortest numbers.

    NaN, which no sealed file holds but a damaged one may, is encoded as well.
    """
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def flatten(content: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """All values of nested plain data, with dotted names, to see which one changed."""
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from flatten(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


def file_digest(file: Path) -> str:
    """Checksum (SHA-256) of a file's bytes.

    Raises
    ------
    ResultError
        It is missing or cannot be read.
    """
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError as error:
        raise ResultError(f"{file}: cannot be read ({error.strerror}); run again with another --out") from None
