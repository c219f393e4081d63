"""The run folder: complete or not there, readable again to the last bit, and honest about damage."""

import json
from dataclasses import fields

import numpy as np
import pytest

from rislam_rt.errors import ConfigError, StoreError
from rislam_rt.model import MapEstimate, SchemeResult
from rislam_rt.pipeline.dataset import MAP, PATHS, SCHEME
from rislam_rt.pipeline.store import PartialRun, check_folder, read_run, run_identity, scheme_file
from rislam_rt.pipeline.summary import summarise
from rislam_rt.scene import load_scene


@pytest.fixture(scope="module")
def stored(short_result, short_spec, room, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "one"
    partial = PartialRun(folder, run_identity(short_spec, room))
    for name, scheme in short_result.schemes.items():
        partial[name] = scheme
    return partial.complete(short_result, summarise(short_result))


def test_reads_back_to_the_last_bit(stored, short_result):
    again = read_run(stored)
    for name, scheme in short_result.schemes.items():
        for field in SCHEME:
            np.testing.assert_array_equal(getattr(again.schemes[name], field), getattr(scheme, field))
        for field in MAP:
            np.testing.assert_array_equal(getattr(again.schemes[name].map, field), getattr(scheme.map, field))
        assert again.schemes[name].outcome == scheme.outcome
    for field in PATHS:
        np.testing.assert_array_equal(getattr(again.paths, field), getattr(short_result.paths, field))
    np.testing.assert_array_equal(again.scene.agent.position, short_result.scene.agent.position)
    assert (again.paths.walls, again.paths.landmarks) == (short_result.paths.walls, short_result.paths.landmarks)
    assert (again.seed, again.versions, again.config) == (7, short_result.versions, short_result.config)


def test_every_array_of_a_result_is_stored():
    other = {"scheme", "levels", "info", "outcome", "map"}
    assert {f.name for f in fields(SchemeResult)} - other == set(SCHEME)
    assert {f.name for f in fields(MapEstimate)} == set(MAP)


def test_folder_holds_plain_files(stored, short_result):
    names = {path.name for path in stored.iterdir()}
    assert names >= {"paths.nc", "truth.tum", "map.json", "config.toml", "summary.json", "run.json", "scene"}
    for name in short_result.schemes:
        assert {f"scheme_{name}.nc", f"estimate_{name}.tum"} <= names
    assert "identity" not in names
    assert not stored.with_name("one.partial").exists()
    rows = np.loadtxt(stored / "truth.tum")
    np.testing.assert_allclose(rows[:, 1:4], short_result.scene.agent.position, atol=1e-8)
    assert json.loads((stored / "summary.json").read_text())["cycles"] == 8
    assert load_scene(stored / "scene").name == "paper_room"


def test_every_variable_has_a_unit(stored):
    import xarray as xr

    for file in ("paths.nc", "scheme_random.nc"):
        data = xr.load_dataset(stored / file, engine="h5netcdf")
        plain = [n for n in data.data_vars if not str(n).startswith("info_") and n != "outcome"]
        assert all(data[name].attrs["units"] and data[name].attrs["long_name"] for name in plain)


def test_configuration_repeats_the_run(stored, short_spec):
    from rislam_rt.pipeline import load_spec

    assert load_spec(stored / "config.toml") == short_spec


def test_damage_is_told(stored, tmp_path):
    import shutil

    copy = tmp_path / "copy"
    shutil.copytree(stored, copy)
    file = scheme_file(copy, "random")
    file.write_bytes(file.read_bytes()[:1000])
    with pytest.raises(StoreError, match="scheme_random"):
        read_run(copy)
    with pytest.raises(ConfigError, match="not a completed run"):
        read_run(tmp_path)


def test_partial_run_keeps_schemes_of_the_same_identity_only(tmp_path, short_result):
    partial = PartialRun(tmp_path / "run", "a")
    partial["random"] = short_result.schemes["random"]
    again = PartialRun(tmp_path / "run", "a")
    assert list(again) == ["random"]
    np.testing.assert_array_equal(again["random"].position, short_result.schemes["random"].position)
    assert list(PartialRun(tmp_path / "run", "b")) == []


def test_damaged_scheme_counts_as_not_there(tmp_path, short_result):
    partial = PartialRun(tmp_path / "run", "a")
    partial["random"] = short_result.schemes["random"]
    scheme_file(partial.folder, "random").write_bytes(b"nothing")
    assert "random" not in partial


def test_abandoned_run_leaves_nothing(tmp_path):
    PartialRun(tmp_path / "run", "a").abandon()
    assert list(tmp_path.iterdir()) == []


def test_identity_follows_settings_but_not_the_list_of_schemes(short_spec, room):
    same = short_spec.model_copy(update={"schemes": ["random"]})
    other = short_spec.model_copy(update={"seed": 8})
    assert run_identity(same, room) == run_identity(short_spec, room)
    assert run_identity(other, room) != run_identity(short_spec, room)


def test_a_folder_of_something_else_is_refused(tmp_path, stored):
    check_folder(tmp_path / "new")
    check_folder(stored)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ConfigError, match="is not a run"):
        check_folder(tmp_path)


def test_unwritable_place_is_a_store_error():
    from pathlib import Path

    with pytest.raises(StoreError, match="cannot be written"):
        PartialRun(Path("/proc/nowhere/run"), "a")
