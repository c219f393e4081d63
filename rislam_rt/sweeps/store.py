"""Storage of a sweep's results: a folder with a file for each cell, a table of all cells, and their times.

sweep.json               function, axes, base settings and seed of the sweep
cells/<ident>.json       result or failure of a cell, with a checksum; the same bytes from every run
table.csv, table.json    all cells in their order, missing ones too; the same bytes from every run
timings.jsonl            seconds and machine of every cell that ran, in the order in which they ended
"""

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from rislam_rt.errors import ResultError, RislamError
from rislam_rt.storage import files
from rislam_rt.storage.checksums import flatten, read_sealed, seal
from rislam_rt.storage.lock import LOCK_FILE, hold
from rislam_rt.sweeps.cell_work import CellOutcome
from rislam_rt.sweeps.sweep import Cell, Sweep

SWEEP_FILE = "sweep.json"
"""Name of the file by which a sweep folder is recognised."""

MISSING, DONE = "missing", "done"
"""States of a cell, beside the causes of a failure (`sweeps.cell_work`)."""

FIXED = ("repetition", "seed", "state", "message")
"""Columns of every table of cells, between the axes and the results."""


class Row(NamedTuple):
    """One cell of a sweep with its state and result: a row of the table."""

    cell: Cell
    state: str
    """`missing`, `done`, or the cause of its failure: `raised`, `died`, `hung`, `lost`."""
    message: str
    """One line on the failure; else empty."""
    result: Mapping[str, Any]
    """Result of the function; empty unless done."""

    @property
    def failed(self) -> bool:
        """Whether the stored cell ran and failed."""
        return self.state not in (MISSING, DONE)


def check_folder(folder: Path) -> None:
    """Check that a folder is a stored sweep's, empty or not there, so that no other files are replaced.

    Raises
    ------
    ConfigError
        It holds something else.
    ResultError
        `sweep.json` was changed since it was written, and no cell tells that the folder is a sweep's.
    """
    if files.has_marker(folder, SWEEP_FILE, LOCK_FILE, "sweep"):
        try:
            read_sealed(folder / SWEEP_FILE)
        except ResultError:  # it is written anew where the cells, each with a checksum of its own, are there
            if not any(map(_is_cell, (folder / "cells").glob("*.json"))):
                raise


def _is_cell(file: Path) -> bool:
    """Whether a file stores a cell of a sweep, as it was written."""
    try:
        return read_sealed(file)["ident"] == file.stem
    except (RislamError, KeyError):
        return False


def count_others(folder: Path, cells: Iterable[Cell]) -> int:
    """Number of stored cells in a sweep folder that are none of these: of other settings, axes or repetitions."""
    return len({file.stem for file in (folder / "cells").glob("*.json")} - {cell.ident for cell in cells})


@contextmanager
def open_folder(folder: Path, sweep: Sweep, keep: bool = False) -> Iterator[None]:
    """Create the folder that stores a sweep, lock it within this context, remove temporary files and write
    `sweep.json`.

    With `keep` the `sweep.json` that is there stays.

    Raises
    ------
    StoreError
        The disk refused.
    ConfigError, ResultError
        It holds something else, or another sweep is at work there.
    """
    about = {
        "name": sweep.name, "function": sweep.function,
        "axes": [{"key": axis.key, "values": list(axis.values)} for axis in sweep.axes], "base": dict(sweep.base),
        "repetitions": sweep.repetitions, "seed": sweep.seed, "paired": list(sweep.paired),
    }  # fmt: skip
    check_folder(folder)
    made = files.make_folders(folder)
    try:
        with hold(folder, "sweep"):
            check_folder(folder)
            files.remove_temporaries((folder, folder / "cells"))
            if not keep:
                files.write_atomic(folder / SWEEP_FILE, files.json_file(seal(about), sort_keys=True))
            yield
    finally:
        files.remove_empty(made)


def write_cell(folder: Path, cell: Cell, function: str, outcome: CellOutcome) -> Row:
    """Store the result or failure of a cell in its file, and return its row of the table.

    Raises
    ------
    StoreError
        The disk refused.
    """
    state = outcome.cause or DONE
    content = {"function": function, "state": state, "message": outcome.message, "result": outcome.result or {}}
    files.write_atomic(_file(folder, cell), files.json_file(seal({**cell._asdict(), **content}), sort_keys=True))
    return Row(cell, state, outcome.message, outcome.result or {})


def read_row(folder: Path, cell: Cell) -> Row:
    """Read state and result of a cell from its stored file; a changed file, or another cell's, counts as missing."""
    file = _file(folder, cell)
    try:
        found = read_sealed(file)
        if found["ident"] == cell.ident:
            return Row(cell, str(found["state"]), str(found["message"]), dict(found["result"]))
    except (RislamError, KeyError, TypeError, ValueError):
        pass
    return Row(cell, MISSING, "", {})


def rows_by_point(rows: Sequence[Row]) -> list[list[Row]]:
    """Stored rows of a sweep in groups with the same values along the axes, groups and rows in their order."""
    groups: dict[str, list[Row]] = {}
    for row in rows:
        groups.setdefault(repr(row.cell.point), []).append(row)
    return list(groups.values())


def append_timing(folder: Path, cell: Cell, outcome: CellOutcome) -> None:
    """Store the time and machine of a cell in `timings.jsonl`, from which costs are estimated; errors are ignored."""
    line = {
        "ident": cell.ident, "point": dict(cell.point), "repetition": cell.repetition,
        "seconds": round(outcome.seconds, 4), "cpu_seconds": round(outcome.cpu_seconds, 4), "host": outcome.host,
        **({"timing": outcome.timing} if outcome.timing else {}),
    }  # fmt: skip
    with suppress(OSError), (folder / "timings.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")


def read_timings(folder: Path) -> list[dict[str, Any]]:
    """Read the stored times of all cells that ran, from the complete lines of `timings.jsonl`."""
    found = []
    with suppress(OSError):
        for line in (folder / "timings.jsonl").read_text(encoding="utf-8", errors="replace").splitlines():
            # a line that a killed run was writing, or that is none of ours
            with suppress(ValueError, KeyError, TypeError, OverflowError, RecursionError):
                entry = json.loads(line)
                seconds = float(entry["seconds"])
                if 0.0 <= seconds < math.inf:
                    found.append({**entry, "point": dict(entry["point"]), "seconds": seconds})
    return found


def write_table(folder: Path, rows: Sequence[Row]) -> None:
    """Write the stored table of all cells as CSV and JSON, in their order; nested names are dotted, lists are left out.

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
    files.write_all(folder, {"table.csv": csv_bytes(entries), "table.json": files.json_file(entries, sort_keys=True)})


def csv_bytes(entries: Sequence[Mapping[str, Any]]) -> bytes:
    """Encode rows as CSV, as a sweep's table is stored: the columns of the first row, lists joined by semicolons."""
    rows = ([";".join(map(str, v)) if isinstance(v, list) else v for v in entry.values()] for entry in entries)
    return files.csv_file(entries[0] if entries else (), rows)


def _file(folder: Path, cell: Cell) -> Path:
    """Path of the file in a sweep folder that stores a cell."""
    return folder / "cells" / f"{cell.ident}.json"
