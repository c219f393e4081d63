"""A sweep's folder: one file a cell, what differs from run to run apart, and a table that grows.

sweep.json               what is swept
cells/<ident>.json       what a cell gave, or how it failed; the same bytes from every run
table.csv, table.json    all cells in their order, those that are missing too; the same bytes from every run
timings.jsonl            seconds and machine of every cell that ran, in the order in which they ended
"""

import csv
import fcntl
import io
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from rislam_rt.errors import ConfigError, StoreError
from rislam_rt.pipeline.files import write_atomic
from rislam_rt.pipeline.sweeps.axes import Cell, Sweep
from rislam_rt.pipeline.sweeps.record import flatten, json_bytes
from rislam_rt.pipeline.sweeps.work import Outcome

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
        """Whether it ran and did not end well."""
        return self.state not in (MISSING, DONE)


@contextmanager
def open_folder(folder: Path) -> Iterator[None]:
    """Make the folder, keep other sweeps out, and remove what a killed one was writing.

    Raises
    ------
    StoreError
        The disk refused.
    ConfigError
        Another sweep is at work there.
    """
    cells = folder / "cells"
    try:
        cells.mkdir(parents=True, exist_ok=True)
        handle = os.open(cells, os.O_RDONLY)
    except OSError as error:
        raise StoreError(f"{folder}: cannot be written ({error.strerror}); check permissions and free space") from None
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ConfigError(f"{folder}: another sweep is at work there; wait, or give another folder") from None
        except OSError:
            pass  # a file system without locks
        for torn in (*folder.glob(".*-*"), *cells.glob(".*-*")):
            with suppress(OSError):
                torn.unlink()
        yield
    finally:
        os.close(handle)


def write_sweep(folder: Path, sweep: Sweep) -> None:
    """Say what is swept.

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
    write_atomic(folder / "sweep.json", json_bytes(about))


def write_cell(folder: Path, cell: Cell, function: str, outcome: Outcome) -> Row:
    """Put a cell's file in place, whole.

    Raises
    ------
    StoreError
        The disk refused.
    """
    state = outcome.cause or DONE
    content = {"function": function, "state": state, "message": outcome.message, "result": outcome.result or {}}
    write_atomic(_file(folder, cell), json_bytes({**cell._asdict(), **content}))
    return Row(cell, state, outcome.message, outcome.result or {})


def read_row(folder: Path, cell: Cell) -> Row:
    """What there is of a cell; a file that is damaged, or another cell's, counts as missing."""
    try:
        found = json.loads(_file(folder, cell).read_bytes())
        if found["ident"] == cell.ident:
            return Row(cell, str(found["state"]), str(found["message"]), dict(found["result"]))
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return Row(cell, MISSING, "", {})


def append_timing(folder: Path, cell: Cell, outcome: Outcome) -> None:
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
    """All lines of the timings that are whole."""
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
    write_atomic(folder / "table.csv", csv_bytes(entries))
    write_atomic(folder / "table.json", json_bytes(entries))


def csv_bytes(entries: Sequence[Mapping[str, Any]]) -> bytes:
    """A table whose columns are those of the first row, in its order; lists with semicolons."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(entries[0] if entries else ())
    for entry in entries:
        table.writerow([";".join(map(str, v)) if isinstance(v, list) else v for v in entry.values()])
    return text.getvalue().encode(errors="backslashreplace")


def _file(folder: Path, cell: Cell) -> Path:
    return folder / "cells" / f"{cell.ident}.json"
