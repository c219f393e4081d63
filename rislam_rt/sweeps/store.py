"""The store of a sweep: one file a cell, what differs from run to run apart, and a table that grows.

sweep.json               what is swept
cells/<ident>.json       what a cell gave, or how it failed, with a checksum; the same bytes from every run
table.csv, table.json    all cells in their order, those that are missing too; the same bytes from every run
timings.jsonl            seconds and machine of every cell that ran, in the order in which they ended
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from rislam_rt.errors import ConfigError, RislamError
from rislam_rt.storage.files import (
    TEMPORARY,
    csv_file,
    json_file,
    make_folders,
    remove_empty,
    remove_temporaries,
    write_all,
    write_atomic,
)
from rislam_rt.storage.lock import LOCK_FILE, hold
from rislam_rt.storage.seal import flatten, read_sealed, seal
from rislam_rt.sweeps.cell_work import CellOutcome
from rislam_rt.sweeps.sweep import Cell, Sweep

SWEEP_FILE = "sweep.json"
"""The folder's marker."""

MISSING, DONE = "missing", "done"
"""States of a cell, beside the causes of a failure."""

FIXED = ("repetition", "seed", "state", "message")
"""Columns of every table, between the axes and the results."""


class Row(NamedTuple):
    """One cell in the table."""

    cell: Cell
    state: str
    """`missing`, `done`, or why it failed: `raised`, `died`, `hung`, `lost`."""
    message: str
    """Of a failure; else empty."""
    result: Mapping[str, Any]
    """Empty unless done."""

    @property
    def failed(self) -> bool:
        """Whether a stored cell ran and did not end well."""
        return self.state not in (MISSING, DONE)


def check_folder(folder: Path) -> None:
    """Refuse a folder that holds something else than a sweep: nothing of anybody else's may be replaced.

    Raises
    ------
    ConfigError
        It does.
    ResultError
        `sweep.json` is not as it was written.
    """
    try:
        names = [entry.name for entry in folder.iterdir()]
    except FileNotFoundError:
        return
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be used ({error.strerror}); give another folder") from None
    if SWEEP_FILE in names:
        read_sealed(folder / SWEEP_FILE)
    elif not all(name == LOCK_FILE or TEMPORARY.fullmatch(name) for name in names):
        raise ConfigError(f"{folder}: exists and is not a sweep; give a folder that does not exist yet")


@contextmanager
def open_folder(folder: Path, sweep: Sweep, keep: bool = False) -> Iterator[None]:
    """Make the folder, say what is swept (unless what it says is to be kept), keep other sweeps out, and remove what a
    killed one was writing.

    Raises
    ------
    StoreError
        The disk refused.
    ConfigError, ResultError
        It holds something else, or another sweep is at work there.
    """
    check_folder(folder)
    made = make_folders(folder)
    try:
        with hold(folder, "sweep"):
            check_folder(folder)
            remove_temporaries((folder, folder / "cells"))
            if not keep:
                write_sweep(folder, sweep)
            yield
    finally:
        remove_empty(made)


def write_sweep(folder: Path, sweep: Sweep) -> None:
    """Store what is swept; the file is the folder's marker.

    Raises
    ------
    StoreError
        The disk refused.
    """
    about = {
        "name": sweep.name,
        "function": sweep.function,
        "axes": [{"key": axis.key, "values": list(axis.values)} for axis in sweep.axes],
        "base": dict(sweep.base),
        "repetitions": sweep.repetitions,
        "seed": sweep.seed,
        "paired": list(sweep.paired),
    }
    write_atomic(folder / SWEEP_FILE, json_file(seal(about), sort_keys=True))


def write_cell(folder: Path, cell: Cell, function: str, outcome: CellOutcome) -> Row:
    """Store a cell's file, whole.

    Raises
    ------
    StoreError
        The disk refused.
    """
    state = outcome.cause or DONE
    content = {"function": function, "state": state, "message": outcome.message, "result": outcome.result or {}}
    write_atomic(_file(folder, cell), json_file(seal({**cell._asdict(), **content}), sort_keys=True))
    return Row(cell, state, outcome.message, outcome.result or {})


def read_row(folder: Path, cell: Cell) -> Row:
    """What there is of a cell; a file that is not as it was written, or another cell's, counts as missing."""
    file = _file(folder, cell)
    try:
        found = read_sealed(file)
        if found["ident"] == cell.ident:
            return Row(cell, str(found["state"]), str(found["message"]), dict(found["result"]))
    except (RislamError, KeyError, TypeError, ValueError):
        pass
    return Row(cell, MISSING, "", {})


def append_timing(folder: Path, cell: Cell, outcome: CellOutcome) -> None:
    """Remember how long a cell took, and where; losing a line costs nothing but an estimate."""
    line = {
        "ident": cell.ident,
        "point": dict(cell.point),
        "repetition": cell.repetition,
        "seconds": round(outcome.seconds, 4),
        "cpu_seconds": round(outcome.cpu_seconds, 4),
        "host": outcome.host,
        **({"timing": outcome.timing} if outcome.timing else {}),
    }
    with suppress(OSError), (folder / "timings.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")


def read_timings(folder: Path) -> list[dict[str, Any]]:
    """All lines of the stored timings that are whole."""
    found = []
    with suppress(OSError):
        for line in (folder / "timings.jsonl").read_text(encoding="utf-8").splitlines():
            with suppress(ValueError, KeyError, TypeError):  # the line that a killed run was writing
                entry = json.loads(line)
                found.append({**entry, "point": dict(entry["point"]), "seconds": float(entry["seconds"])})
    return found


def write_table(folder: Path, rows: Sequence[Row]) -> None:
    """The table as CSV and JSON, in the order of the cells; nested names are dotted, lists stay in the cells' files.

    Raises
    ------
    StoreError
        The disk refused.
    """
    flat = [{name: value for name, value in flatten(row.result) if not isinstance(value, list)} for row in rows]
    results = sorted({name for result in flat for name in result})
    entries: list[dict[str, Any]] = []
    for row, result in zip(rows, flat, strict=True):
        fixed = (row.cell.repetition, row.cell.seed, row.state, row.message)
        known = {**row.cell.point, **dict(zip(FIXED, fixed, strict=True))}
        entries.append(known | {f"result.{name}" if name in known else name: result.get(name) for name in results})
    write_all(folder, {"table.csv": csv_bytes(entries), "table.json": json_file(entries, sort_keys=True)})


def csv_bytes(entries: Sequence[Mapping[str, Any]]) -> bytes:
    """A table whose columns are those of the first row, in its order; lists with semicolons."""
    rows = ([";".join(map(str, v)) if isinstance(v, list) else v for v in entry.values()] for entry in entries)
    return csv_file(entries[0] if entries else (), rows)


def _file(folder: Path, cell: Cell) -> Path:
    return folder / "cells" / f"{cell.ident}.json"
