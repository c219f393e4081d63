"""Sweeps: the same pipeline over settings and seeds, one file a cell, resumed where it stopped."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.errors import ConfigError, RislamError
from rislam_rt.evaluate import bootstrap, rms_over_runs
from rislam_rt.pipeline.files import write_atomic
from rislam_rt.pipeline.read import load_spec
from rislam_rt.pipeline.run import check_run, run_slam
from rislam_rt.pipeline.spec import PipelineSpec
from rislam_rt.pipeline.store import run_identity
from rislam_rt.pipeline.summary import summarise
from rislam_rt.pipeline.workers import Tell, run_side_by_side
from rislam_rt.scene import load_scene


class Cell(NamedTuple):
    """One run of a sweep."""

    name: str
    """Its file's name."""
    settings: tuple[str, ...]
    """`key=value` along the axes."""
    repetition: int
    spec: PipelineSpec
    identity: str
    """What a file must carry to be taken over."""


class Row(NamedTuple):
    """One scheme at one point of the axes, over all repetitions."""

    settings: tuple[str, ...]
    scheme: str
    rmse: tuple[float, ...]
    """Of each repetition that ended [m]."""
    interval: tuple[float, float] | None
    """95 % bootstrap interval of the RMSE over the repetitions [m]; None for a single one."""
    diverged: int
    failed: int

    @property
    def overall(self) -> float:
        """RMSE over all repetitions [m]; NaN if none ended."""
        return float(rms_over_runs(np.array(self.rmse))) if self.rmse else float("nan")


def parse_axes(axes: Sequence[str]) -> dict[str, list[str]]:
    """`key=v1,v2,...` settings as values by key.

    Raises
    ------
    ConfigError
        One is not of that form.
    """
    found: dict[str, list[str]] = {}
    for axis in axes:
        key, equals, values = axis.partition("=")
        parts = [value.strip() for value in values.split(",")]
        if not equals or not key.strip() or not all(parts):
            raise ConfigError(
                f"--axis {axis[:80]!r}: not of the form key=v1,v2,...; give e.g. --axis slam.sigma_a=0.01,0.1"
            )
        found[key.strip()] = parts
    return found


def build_cells(
    pipeline: Path, scene: Path, overrides: Sequence[str], axes: Mapping[str, Sequence[str]], repetitions: int
) -> list[Cell]:
    """All cells, every one of them checked. A cell's seed comes from the pipeline's and the number of the repetition.

    So a repetition draws the same noise at every point of the axes.

    Raises
    ------
    ConfigError, SceneError
        A cell could not run.
    """
    room = load_scene(scene)
    cells = []
    for values in product(*axes.values()):
        settings = tuple(f"{key}={value}" for key, value in zip(axes, values, strict=True))
        base = load_spec(pipeline, [*overrides, *settings])
        check_run(room, base)
        for repetition in range(repetitions):
            spec = base.model_copy(update={"seed": _seed(base.seed, repetition)})
            identity = hashlib.sha256((run_identity(spec, room) + ",".join(spec.schemes)).encode()).hexdigest()
            cells.append(Cell(f"{identity[:16]}-{repetition:03d}", settings, repetition, spec, identity))
    return cells


def run_sweep(cells: Sequence[Cell], scene: Path, folder: Path, jobs: int, tell: Tell) -> list[Row]:
    """Run what is not there yet, each cell in a process of its own, and score all.

    A cell that failed, or whose process died, is recorded with its cause and tried again by the next sweep.

    Raises
    ------
    StoreError
        The disk refused.
    """
    by_name = {cell.name: cell for cell in cells}
    todo = [cell.name for cell in cells if "summary" not in _read(folder, cell)]
    ready = len(cells) - len(todo)
    tell("cells", ready, len(cells))
    for name, found in run_side_by_side(run_cell, todo, (by_name, scene), jobs, lambda *_: None, apart=True):
        entry = {"error": str(found)} if isinstance(found, RislamError) else {"summary": found}
        cell = by_name[name]
        record = {"identity": cell.identity, "settings": cell.settings, "repetition": cell.repetition, **entry}
        write_atomic(_file(folder, cell), (json.dumps(record, indent=1) + "\n").encode())
        ready += 1
        tell("cells", ready, len(cells))
    rows = tabulate(cells, folder)
    content = [{**row._asdict(), "overall_rmse_m": None if not row.rmse else row.overall} for row in rows]
    write_atomic(folder / "sweep.json", (json.dumps(content, indent=1) + "\n").encode())
    return rows


def run_cell(name: str, cells: Mapping[str, Cell], scene: Path, tell: Tell) -> dict[str, Any]:
    """The summary of one cell."""
    spec = cells[name].spec
    return summarise(run_slam(load_scene(scene), spec, rng=np.random.default_rng(spec.seed), progress=tell))


def tabulate(cells: Sequence[Cell], folder: Path) -> list[Row]:
    """Rows in the order of the axes; failures are counted, never dropped."""
    groups: dict[tuple[str, ...], list[Cell]] = {}
    for cell in cells:
        groups.setdefault(cell.settings, []).append(cell)
    rows = []
    for settings, group in groups.items():
        records = [_read(folder, cell) for cell in group]
        for scheme in group[0].spec.schemes:
            scores = [record["summary"]["schemes"][scheme] for record in records if "summary" in record]
            rmse = tuple(float(score["rmse_m"]) for score in scores)
            diverged = sum(bool(score["diverged"]) for score in scores)
            rows.append(Row(settings, scheme, rmse, _interval(rmse), diverged, len(group) - len(scores)))
    return rows


def _interval(rmse: Sequence[float]) -> tuple[float, float] | None:
    if len(rmse) < 2:
        return None
    found = bootstrap(np.array(rmse), rng=np.random.default_rng(0), statistic=rms_over_runs)
    return found.lower, found.upper


def _seed(base: int, repetition: int) -> int:
    digest = hashlib.sha256(f"{base}/{repetition}".encode()).digest()
    return int.from_bytes(digest[:7])


def _file(folder: Path, cell: Cell) -> Path:
    return folder / "cells" / f"{cell.name}.json"


def _read(folder: Path, cell: Cell) -> dict[str, Any]:
    """The cell's record; empty if there is none, or one of another identity."""
    try:
        record = json.loads(_file(folder, cell).read_text())
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) and record.get("identity") == cell.identity else {}
