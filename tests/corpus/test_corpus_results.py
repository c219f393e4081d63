"""The corpus of damaged results: files of a run are refused in one line, a sweep's cells are run again."""

import shutil
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rislam_rt.errors import RislamError
from rislam_rt.pipeline import load_spec, run_slam
from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.pipeline.store.identity import run_identity
from rislam_rt.pipeline.store.run_folder import open_run, read_run
from rislam_rt.scene import load_scene
from rislam_rt.sweeps import Sweep, build_cells
from rislam_rt.sweeps.cell_work import CellOutcome
from rislam_rt.sweeps.store import DONE, MISSING, read_row, write_cell

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
CASES = tomllib.loads((HERE / "results.toml").read_text())["case"]
CELLS = {
    "cut": lambda data: data[: len(data) // 2],
    "empty": lambda data: b"",
    "no JSON": lambda data: b"[" + data,
    "a list": lambda data: b"[]",
    "a number": lambda data: b"1e308",
    "nested too deeply": lambda data: b"[" * 100_000,
    "no text": lambda data: b"\xff\xfe" + data,
    "another value": lambda data: data.replace(b"0.125", b"0.126"),
    "another state": lambda data: data.replace(b'"done"', b'"died"'),
    "another seed": lambda data: data.replace(b'"repetition": 0', b'"repetition": 1'),
    "another schema": lambda data: data.replace(b'"schema": 1', b'"schema": 2'),
    "no checksum": lambda data: data.replace(b'"checksum"', b'"checksun"'),
}
"""What is done to a cell's file."""


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A completed run of five cycles."""
    settings = ["channel=image_source", "cycles=5", "depth=0", "receiver.estimator=bound", 'schemes=["random"]']
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", settings)
    room = load_scene(ROOT / "scenes" / "paper_room")
    folder = tmp_path_factory.mktemp("sound") / "run"
    with open_run(folder, run_identity(spec, room)) as store:
        result = run_slam(room, spec, rng=np.random.default_rng(7), done=store)
        store.complete(result, summarise(result))
    assert read_run(folder).seed == 7
    return folder


@pytest.mark.parametrize("case", CASES, ids=lambda c: f"{c['file']}-{c.get('how') or c['new']!a}")
def test_run(case: dict[str, str], sound: Path, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(sound, tmp_path / "run"))
    file = folder / case["file"]
    data = bytearray(file.read_bytes())
    how = case.get("how")
    if how == "gone":
        file.unlink()
    elif how == "cut":
        file.write_bytes(data[: len(data) // 2])
    elif how == "flipped":
        data[len(data) // 2] ^= 1
        file.write_bytes(data)
    else:
        assert case["old"].encode() in data
        file.write_bytes(data.replace(case["old"].encode(), case["new"].encode(), 1))
    with pytest.raises(RislamError) as caught:
        read_run(folder)
    assert case["says"] in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("what", CELLS)
def test_cell(what: str, tmp_path: Path) -> None:
    cell = build_cells(Sweep("math:hypot", base={"cycles": 3}))[0]
    write_cell(tmp_path, cell, "math:hypot", CellOutcome({"rmse_m": 0.125}))
    assert read_row(tmp_path, cell).state == DONE
    file = next((tmp_path / "cells").iterdir())
    data = file.read_bytes()
    assert CELLS[what](data) != data
    file.write_bytes(CELLS[what](data))
    assert read_row(tmp_path, cell).state == MISSING


@pytest.mark.parametrize(
    "other",
    [{"base": {"cycles": 4}}, {"repetitions": 2}, {"seed": 1}, {"function": "math:dist"}],
    ids=["settings", "repetition", "seed", "function"],
)
def test_a_sound_cell_under_the_name_of_another(other: dict[str, Any], tmp_path: Path) -> None:
    """Files that were copied about, each as it was written: what stands in one decides which cell it is."""
    asked = {"function": "math:hypot", "base": {"cycles": 3}, **other}
    mine, there = build_cells(Sweep("math:hypot", base={"cycles": 3}))[0], build_cells(Sweep(**asked))[-1]
    for cell, value in ((mine, 0.125), (there, 0.25)):
        write_cell(tmp_path, cell, "math:hypot", CellOutcome({"rmse_m": value}))
    files = [tmp_path / "cells" / f"{cell.ident}.json" for cell in (mine, there)]
    shutil.copy(files[1], files[0])
    assert read_row(tmp_path, mine).state == MISSING
    assert read_row(tmp_path, there).result == {"rmse_m": 0.25}
