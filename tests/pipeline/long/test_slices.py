"""Runs in slices: the scores of the whole, the same files after a stop, and no changed slice read in silence."""

import hashlib
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from rislam_rt.errors import ResultError
from rislam_rt.model import SlamResult
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.long import slices
from rislam_rt.pipeline.long.run import read_any, run_long
from rislam_rt.pipeline.long.slices import is_long, join_paths, join_schemes
from rislam_rt.pipeline.own_methods import load_own
from rislam_rt.pipeline.recordings.inputs import PADDING, dataset_to_inputs
from rislam_rt.pipeline.recordings.own_measurements import localise, run_rng
from rislam_rt.pipeline.scores.summary import summarise_scheme
from rislam_rt.pipeline.store.identity import run_identity
from rislam_rt.pipeline.store.run_folder import open_run
from rislam_rt.report import write_report
from rislam_rt.storage.netcdf import read_dataset

ROOT = Path(__file__).parents[3]
CYCLES, SLICE = 7, 4
BOUND = {
    "bound_m", "over_bound", "walls", "walls_found", "walls_heard", "ghost_walls", "relative_bound_m", "true_loss",
    "audible_from_s",
}  # fmt: skip
"""What only a run in one piece has, and what hangs on it."""


@pytest.fixture
def short_slices(monkeypatch):
    monkeypatch.setattr(slices, "SLICE", SLICE)


@pytest.fixture(scope="module")
def spec():
    settings = [
        "channel=image_source",
        f"cycles={CYCLES}",
        "depth=1",
        'schemes=["random", "no_ris"]',
        "receiver.estimator=bound",
    ]
    return load_spec(ROOT / "pipelines" / "trace_then_slam.toml", settings)


def lead(room, spec, folder, progress=lambda *_: None):
    with open_run(folder, run_identity(spec, room)) as store:
        return run_long(room, spec, store, rng=np.random.default_rng(spec.seed), jobs=1, progress=progress)


def contents(folder):
    """Digest of every file; but for those that hold times taken."""
    files = (f for f in sorted(folder.rglob("*")) if f.suffix == ".tum" or f.name == "scene.toml")
    return {str(f.relative_to(folder)): hashlib.sha256(f.read_bytes()).hexdigest() for f in files}


@pytest.fixture(scope="module")
def done(room, spec, tmp_path_factory):
    """A completed run of two slices, the last of them short; nobody changes it."""
    folder = tmp_path_factory.mktemp("done") / "run"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(slices, "SLICE", SLICE)
        return lead(room, spec, folder), folder


def test_scores_counted_slice_by_slice_are_those_of_the_whole(room, spec, short_slices, done):
    found, folder = done
    assert is_long(room, spec)
    assert sorted(p.name for p in (folder / "slices").iterdir()) == [f"{n:05d}" for n in range(2)]
    run = run_identity(spec, room).digest
    for name, scores in found.summary["schemes"].items():
        parts = list(slices.read_parts(folder, name, _cut(room), run))
        paths, scheme = (
            join_paths([p.paths for p in parts]),
            join_schemes([p.scheme for p in parts], [p.paths for p in parts]),
        )
        whole = SlamResult("a", _cut(room), paths, {name: scheme}, spec.model_dump(mode="json"), 7, {})
        expected = summarise_scheme(whole, scheme)
        for key in expected.keys() - BOUND - {"landmarks"}:
            exact = key == "lost" or isinstance(expected[key], list | str | bool | type(None))
            assert scores[key] == (expected[key] if exact else pytest.approx(expected[key], rel=1e-9)), key
        for landmark, entry in expected["landmarks"].items():
            for key in entry.keys() - BOUND:
                value = scores["landmarks"][landmark][key]
                assert value == (None if entry[key] is None else pytest.approx(entry[key], rel=1e-9))
    measurements_of_all_slices_give_the_estimate_again(folder, spec, scheme)


def measurements_of_all_slices_give_the_estimate_again(folder, spec, scheme):
    files = sorted((folder / "slices").glob(f"*/measurements_{scheme.scheme}.nc"))
    parts = [read_dataset(file) for file in files]
    how = {"data_vars": "minimal", "combine_attrs": "drop_conflicts", "join": "outer", "fill_value": PADDING}
    inputs = dataset_to_inputs(xr.concat(parts, "time", **how))
    answers = localise(inputs, spec, rng=run_rng(files[0]))
    np.testing.assert_array_equal([one.position for one in answers.estimates], scheme.position)


def test_warnings_of_a_run_of_which_figures_show_some_cycles(room, spec, short_slices, tmp_path, monkeypatch):
    """Clocks that lose the direct path from the fifth cycle on: 0.33 ns of 0.1 m, at 1 ns a second."""
    monkeypatch.setattr(slices, "SHOWN", 4)
    told = spec.told.model_copy(update={"clock_drift_ns_s": -1.0})
    told = spec.model_copy(update={"told": told, "schemes": ["no_ris"]})
    found = lead(room, told, tmp_path / "run")
    assert len(found.shown.scene.agent) == 4
    (line,) = (line for line in found.shown.warnings if "receiver.min_delay" in line)
    assert "from 0.4 s on the direct path comes in before 0 ns" in line


def _cut(room):
    from rislam_rt.pipeline.run import cut_scene

    return cut_scene(room, CYCLES)


def test_a_stopped_run_goes_on_and_leaves_the_same(room, spec, short_slices, done, tmp_path):
    def stop(setup, at, total):
        if (setup, at) == ("no_ris", 6):
            raise KeyboardInterrupt

    again = tmp_path / "again"
    with pytest.raises(KeyboardInterrupt):
        lead(room, spec, again, stop)
    assert {f.name for f in again.rglob("*.nc")} == {"paths.nc", "scheme_random.nc", "measurements_random.nc"}
    told = []
    lead(room, spec, again, lambda setup, *_: told.append(setup))
    assert set(told) == {"no_ris"}
    assert contents(again) == contents(done[1])


def test_a_stop_before_the_first_scheme_is_done_leaves_nothing(room, spec, short_slices, tmp_path):
    def stop(setup, at, total):
        if at == 6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lead(room, spec, tmp_path / "run", stop)
    assert not (tmp_path / "run").exists()


def test_it_can_be_read_again_and_a_changed_slice_is_told(short_slices, done, tmp_path):
    found, folder = done[0], tmp_path / done[1].name
    shutil.copytree(done[1], folder)
    again = read_any(folder)
    assert again.summary["schemes"]["random"]["rmse_m"] == pytest.approx(
        found.summary["schemes"]["random"]["rmse_m"], rel=1e-6
    )  # the room's path file holds nanometres
    assert len(again.shown.schemes["random"].position) == CYCLES
    file = folder / "slices" / "00001" / "scheme_random.nc"
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)
    with pytest.raises(ResultError, match=r"scheme_random\.nc: changed"):
        read_any(folder)


def test_it_is_reported_where_a_method_of_ones_own_is_not(room, short_slices, tmp_path, monkeypatch, undrawn):
    """Warnings of late paths once asked the method whether it uses the panel."""
    module, folder = f"away_{tmp_path.name}", tmp_path / "run"
    (tmp_path / f"{module}.py").write_text(
        "def design(belief, panel, radio, *, rng):\n    return 0 * panel.offsets()[..., 0].astype(int)\n"
    )
    settings = ["channel=image_source", f"cycles={CYCLES}", "depth=1", f'schemes=["{module}:design"]']
    with monkeypatch.context() as patch:
        patch.syspath_prepend(tmp_path)
        own = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", [*settings, "receiver.estimator=bound"])
        found = lead(room, own, folder)
    (tmp_path / f"{module}.py").unlink()
    sys.modules.pop(module)
    load_own.cache_clear()
    again = read_any(folder)
    assert again.summary["schemes"] == found.summary["schemes"]
    *same, why = again.summary["warnings"]
    assert same == found.summary["warnings"]
    assert why.endswith("these scores are those that the run stored")
    assert f"{module}:design" in write_report(again.shown, again.summary, folder).read_text()
