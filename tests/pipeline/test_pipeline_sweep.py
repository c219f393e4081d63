"""Sweeps: seeds from parameters, one file a cell, resumed, failures counted."""

import json
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline.sweep import build_cells, parse_axes, run_sweep, tabulate

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "scenes" / "paper_room"
PIPELINE = ROOT / "pipelines" / "trace_then_slam.toml"
TINY = ("channel=image_source", "cycles=3", "slam.num_particles=20", 'schemes=["random"]')


def cells_of(axes, repetitions=2, settings=TINY):
    return build_cells(PIPELINE, SCENE, settings, parse_axes(axes), repetitions)


def quiet(stage, at, total):
    pass


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sweep")
    cells = cells_of(["slam.sigma_a=0.01,0.1"])
    return cells, folder, run_sweep(cells, SCENE, folder, 2, quiet)


def test_cells_are_the_product_of_the_axes():
    cells = cells_of(["slam.sigma_a=0.01,0.1", "radio.bandwidth_ghz=0.5,1,2"], 3)
    assert len({cell.name for cell in cells}) == len(cells) == 18
    assert {cell.spec.radio.bandwidth_ghz for cell in cells} == {0.5, 1.0, 2.0}


def test_seeds_come_from_the_repetition_and_not_from_the_order():
    forward, backward = cells_of(["slam.sigma_a=0.01,0.1"]), cells_of(["slam.sigma_a=0.1,0.01"])
    assert {c.name: c.spec.seed for c in forward} == {c.name: c.spec.seed for c in backward}
    assert len({c.spec.seed for c in forward}) == 2


@pytest.mark.parametrize("axis", ["", "seed", "=1,2", "a=", "a=1,,2"])
def test_bad_axis_is_told(axis):
    with pytest.raises(ConfigError, match="--axis"):
        parse_axes([axis])


def test_a_bad_cell_is_found_before_any_runs():
    with pytest.raises(ConfigError, match="cycles: 1000"):
        cells_of(["cycles=3,1000"])


def test_table_has_every_point_and_scheme(swept):
    _, folder, rows = swept
    assert [(row.settings, row.scheme) for row in rows] == [
        (("slam.sigma_a=0.01",), "random"),
        (("slam.sigma_a=0.1",), "random"),
    ]
    for row in rows:
        assert len(row.rmse) == 2
        assert row.failed == row.diverged == 0
        assert row.interval[0] <= row.overall <= row.interval[1]
        assert row.overall == pytest.approx(np.sqrt(np.mean(np.square(row.rmse))))
    assert len(json.loads((folder / "sweep.json").read_text())) == 2


def test_resumed_sweep_runs_what_is_missing_and_ends_the_same(swept, tmp_path):
    import shutil

    cells, folder, rows = swept
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    files = sorted((copy / "cells").iterdir())
    files[0].unlink()
    files[1].write_text("{ torn")
    before = {file.name: file.stat().st_mtime_ns for file in files[2:]}
    assert run_sweep(cells, SCENE, copy, 1, quiet) == rows
    assert {file.name: file.stat().st_mtime_ns for file in files[2:]} == before


def test_failures_are_counted(swept, tmp_path):
    cells, folder, rows = swept
    (tmp_path / "cells").mkdir()
    for cell in cells:
        name = f"{cell.name}.json"
        record = json.loads((folder / "cells" / name).read_text())
        if cell.repetition == 1:
            record = {"identity": record["identity"], "error": "its process died"}
        (tmp_path / "cells" / name).write_text(json.dumps(record))
    for row, full in zip(tabulate(cells, tmp_path), rows, strict=True):
        assert (row.failed, row.rmse, row.interval) == (1, full.rmse[:1], None)
