"""Writing the files of a study in unseen rooms (page, CSV, JSON, figure) from the cells done so far."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.report.style import to_png
from rislam_rt.report.unseen.figure import draw_unseen
from rislam_rt.report.unseen.page import SHOWN, about_lines, unseen_page
from rislam_rt.report.unseen.score_cards import SchemeRun, by_series, card, class_cards, cycle_times, read_runs
from rislam_rt.storage.files import json_file, write_all
from rislam_rt.studies.unseen.spec import UnseenSpec
from rislam_rt.sweeps import Row
from rislam_rt.sweeps.cell_work import plain_result
from rislam_rt.sweeps.store import csv_bytes


def write_unseen(
    rows: Sequence[Row], spec: UnseenSpec, record: Mapping[str, Any], folder: Path, *, tests: int,
    timings: Sequence[Mapping[str, Any]], figures: bool = True,
) -> Path | None:  # fmt: skip
    """Write page, CSV (a row a run), JSON and figure of a study in unseen rooms; return the page, None without runs.

    Parameters
    ----------
    tests
        Number of runs of test rooms so far, from the ledger.
    timings
        Times of the cells, as `sweeps.store.read_timings` gives them.

    Raises
    ------
    StoreError
        The disk refused.
    """
    runs = by_series(read_runs(rows))
    if not any(run.scores for members in runs.values() for run in members):
        return None
    content = unseen_content(runs, timings)
    figure = f"figures/{spec.name}.png" if figures else None
    there = sum(row.state == "done" for row in rows)
    about = about_lines(spec, record, tests, there, len(rows))
    # the page first: the others are known as the program's by it
    files = {f"{spec.name}.md": unseen_page(content, runs, about, figure).encode()}
    if figure is not None:
        files[figure] = to_png(draw_unseen(runs))
    files[f"{spec.name}.csv"] = csv_bytes(run_entries(runs))
    whole = plain_result({**record, "tests": tests, **content})
    return write_all(folder, files | {f"{spec.name}.json": json_file(whole, sort_keys=True)})


def unseen_content(runs: Mapping[str, Sequence[SchemeRun]], timings: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Score cards of a study in unseen rooms as plain data: one for each series, and one for each class of rooms."""
    times = cycle_times(runs, timings)
    cards = {name: {**card(members), "cycle_ms": times[name]} for name, members in runs.items()}
    classes = {name: [_brief(entry) for entry in class_cards(members)] for name, members in runs.items()}
    return {"cards": cards, "classes": classes}


def _brief(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Score card of a class of unseen rooms as the page's data file keeps it: what is shown, with six digits."""
    kept = {name: value for name, value in entry.items() if name in SHOWN}
    return {name: float(_six(value)) if isinstance(value, float) else value for name, value in kept.items()}


def run_entries(runs: Mapping[str, Sequence[SchemeRun]]) -> list[dict[str, Any]]:
    """Rows of a file with all runs in unseen rooms: series, properties of the room, scores with six digits."""
    good = [run for members in runs.values() for run in members if run.scores]
    names = list(dict.fromkeys(name for run in good for name in run.scores))
    entries = []
    for run in good:
        scores = {name: _six(run.scores.get(name)) for name in names}
        entries.append({"series": run.series, **{name: _six(value) for name, value in run.traits.items()}, **scores})
    return entries


def _six(value: Any) -> Any:
    """Cell of a file of the study in unseen rooms, numbers with six digits."""
    if isinstance(value, float):
        return f"{value:.6g}" if np.isfinite(value) else ""
    return "" if value is None else value
