"""The run folder: complete or not there, readable again to the last bit, and honest about damage."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest

from rislam_rt.errors import ConfigError, ResultError, StoreError
from rislam_rt.model import MapEstimate, SchemeResult
from rislam_rt.pipeline.run_datasets import (
    MAP,
    OPTIONAL,
    PATHS,
    SCHEME,
    check_dataset,
    dataset_to_scheme,
    scheme_to_dataset,
    seal_dataset,
)
from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.pipeline.store.identity import code_digest, run_identity
from rislam_rt.pipeline.store.run_folder import find_run, open_run, read_run, read_summary, scheme_file
from rislam_rt.scene import load_scene
from rislam_rt.storage.checksums import file_digest, seal
from rislam_rt.storage.files import write_atomic, write_pieces
from rislam_rt.storage.lock import hold
from rislam_rt.storage.netcdf import read_dataset, write_dataset

ROOM = Path(__file__).parents[3] / "scenes" / "paper_room"


@pytest.fixture(scope="module")
def identity(short_spec, room):
    return run_identity(short_spec, room)


@pytest.fixture(scope="module")
def stored(short_result, identity, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "one"
    with open_run(folder, identity) as store:
        store.update(short_result.schemes)
        store.complete(short_result, summarise(short_result))
    return folder


@pytest.fixture
def copied(stored, tmp_path):
    return Path(shutil.copytree(stored, tmp_path / "copy"))


@pytest.fixture
def begun(identity, short_result, tmp_path):
    """A run that was stopped after two schemes."""
    with open_run(tmp_path / "begun", identity) as store:
        store.update(short_result.schemes)
    return tmp_path / "begun"


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
    other = {"scheme", "levels", "info", "outcome", "map", "given"}
    assert {f.name for f in fields(SchemeResult)} - other == {*SCHEME, *OPTIONAL}
    assert {f.name for f in fields(MapEstimate)} == set(MAP)


def test_folder_holds_plain_files(stored, short_result):
    names = {path.name for path in stored.iterdir()}
    assert names >= {"paths.nc", "truth.tum", "map.json", "config.toml", "summary.json", "run.json", "scene"}
    for name in short_result.schemes:
        assert {f"scheme_{name}.nc", f"measurements_{name}.nc", f"estimate_{name}.tum"} <= names
    assert not {name for name in names if name.startswith(".")}
    assert [path.name for path in stored.parent.iterdir()] == ["one"]
    rows = np.loadtxt(stored / "truth.tum")
    np.testing.assert_allclose(rows[:, 1:4], short_result.scene.agent.position, atol=1e-8)
    assert json.loads((stored / "summary.json").read_text())["cycles"] == 8
    assert load_scene(stored / "scene").name == "paper_room"


def test_every_variable_has_a_unit(stored):
    import xarray as xr

    for file in ("paths.nc", "scheme_random.nc", "measurements_random.nc"):
        data = xr.load_dataset(stored / file, engine="h5netcdf")
        plain = [n for n in data.data_vars if not str(n).startswith("info_") and n != "outcome"]
        assert all(data[name].attrs["units"] and data[name].attrs["long_name"] for name in plain)


def test_configuration_repeats_the_run(stored, short_spec):
    from rislam_rt.pipeline import load_spec
    from rislam_rt.shipped import room_beside

    spec = load_spec(stored / "config.toml")
    assert spec.model_copy(update={"scene": short_spec.scene}) == short_spec
    assert room_beside(stored, spec.scene).samefile(stored / "scene"), "the room in the folder, wherever it was taken"


def test_a_file_that_is_cut_or_gone_is_told(copied, tmp_path):
    file = scheme_file(copied, "random")
    file.write_bytes(file.read_bytes()[:1000])
    with pytest.raises(ResultError, match="scheme_random"):
        read_run(copied)
    file.unlink()
    with pytest.raises(ResultError, match="scheme_random"):
        read_run(copied)
    with pytest.raises(ConfigError, match="not a completed run"):
        read_run(tmp_path)


def test_any_changed_byte_of_any_file_is_told(copied, identity):
    rng = np.random.default_rng(1)
    files = [path for path in sorted(copied.rglob("*")) if path.is_file()]
    assert {path.relative_to(copied).as_posix() for path in files} >= {"run.json", "scene/scene.toml", "paths.nc"}
    for file in files:
        content = bytearray(file.read_bytes())
        content[rng.integers(len(content))] ^= 1
        whole = file.read_bytes()
        file.write_bytes(content)
        with pytest.raises(ResultError, match=rf"{re.escape(file.name)}: [^\n]+; [^\n]+$"):
            read_run(copied)
        with pytest.raises(ResultError):
            read_summary(copied, find_run(copied, identity))
        file.write_bytes(whole)
    assert read_run(copied).seed == 7


def test_a_scheme_over_another_and_another_count_are_told(copied, stored):
    # with a manifest made anew, as one would who copies files about: what stands in the files themselves is looked at
    about = json.loads((copied / "run.json").read_text())
    del about["checksum"]

    def sign(**more):
        files = {name: file_digest(copied / name) for name in about["files"]}
        (copied / "run.json").write_text(json.dumps(seal({**about, "files": files, **more})))

    scheme_file(copied, "optimized").write_bytes(scheme_file(copied, "random").read_bytes())
    sign()
    with pytest.raises(ResultError, match=r"scheme_optimized\.nc: scheme is random and should be optimized"):
        read_run(copied)
    scheme_file(copied, "optimized").write_bytes(scheme_file(stored, "optimized").read_bytes())
    sign(cycles=9)
    with pytest.raises(ResultError, match=r"paths\.nc: cycles is 8 and should be 9"):
        read_run(copied)
    sign()
    assert list(read_run(copied).schemes) == ["optimized", "random"]


def test_a_changed_value_does_not_fit_the_files_own_checksum(short_result, tmp_path):
    data = seal_dataset(scheme_to_dataset(short_result.schemes["random"]), run="a")
    file = tmp_path / "one.nc"
    write_dataset(data, file)
    check_dataset(read_dataset(file), file, run="a", scheme="random")
    for name in data.variables:
        values = np.array(data[name].to_numpy())
        if values.size:
            values.reshape(-1).view(np.uint8)[0] ^= 1
            changed = data.assign({name: (data[name].dims, values, data[name].attrs)})
            with pytest.raises(ResultError, match="checksum is"):
                check_dataset(changed, file)
    for name in ("outcomes", "levels", "scheme"):
        with pytest.raises(ResultError, match="checksum is"):
            check_dataset(data.assign_attrs({name: "other"}), file)
    with pytest.raises(ResultError, match="schema is 0"):
        check_dataset(data.assign_attrs(schema=0), file)
    write_dataset(changed, file)  # as one would with the library that wrote it
    with pytest.raises(ResultError, match="checksum is"):
        check_dataset(read_dataset(file), file)


def test_hindsight_comes_back_if_there_is_any(short_result):
    scheme = short_result.schemes["random"]
    assert dataset_to_scheme(scheme_to_dataset(replace(scheme, smoothed=None))).smoothed is None
    looked_back = replace(scheme, smoothed=scheme.position + 0.1)
    found = dataset_to_scheme(scheme_to_dataset(looked_back)).smoothed
    np.testing.assert_array_equal(found, looked_back.smoothed)


def test_the_start_that_was_told_comes_back(short_result):
    """It decides the error relative to the start, which is scored anew from the files."""
    scheme = short_result.schemes["random"]
    np.testing.assert_array_equal(scheme.start_position, scheme.given.inputs.start.position)
    np.testing.assert_array_equal(dataset_to_scheme(scheme_to_dataset(scheme)).start_position, scheme.start_position)
    assert dataset_to_scheme(scheme_to_dataset(replace(scheme, start_position=None))).start_position is None


def test_a_stopped_run_goes_on(begun, identity, short_result):
    (begun / "scene").mkdir()
    (begun / "scene" / ".rislam-rt-abcdefgh.tmp").write_text("half")
    with open_run(begun, identity) as store:
        assert list(store) == ["optimized", "random"]
        assert store.spoiled == []
        np.testing.assert_array_equal(store["random"].position, short_result.schemes["random"].position)
    assert not list(begun.rglob(".*"))
    with pytest.raises(ConfigError, match="not a completed run"):
        read_run(begun)


def test_a_spoiled_scheme_counts_as_not_there(begun, identity):
    scheme_file(begun, "random").write_bytes(b"nothing")
    with open_run(begun, identity) as store:
        assert store.spoiled == ["random"]
        assert "random" not in store
        assert "optimized" in store
    shutil.copy(scheme_file(begun, "optimized"), scheme_file(begun, "random"))
    with open_run(begun, identity) as store:
        assert store.spoiled == ["random"]


def test_a_run_that_ends_without_a_scheme_leaves_nothing(tmp_path, identity):
    with pytest.raises(KeyboardInterrupt), open_run(tmp_path / "deep" / "run", identity):
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_identity_follows_all_that_decides_numbers(short_spec, room, identity, monkeypatch):
    def other(spec=short_spec, scene=room):
        return run_identity(spec, scene).digest != identity.digest

    assert not other()
    assert not other(short_spec.model_copy(update={"description": "words", "scene": "elsewhere"}))
    assert other(short_spec.model_copy(update={"seed": 8}))
    assert other(short_spec.model_copy(update={"schemes": ["random"]}))
    assert other(scene=replace(room, digest="0" * 64))
    monkeypatch.setenv("RISLAM_RT_THREADS", "2")
    assert other()
    assert identity.folder == f"trace_then_slam-paper_room-7-{identity.digest[:8]}"


def test_the_code_is_part_of_the_identity(tmp_path, identity):
    import rislam_rt

    copy = Path(shutil.copytree(Path(rislam_rt.__file__).parent, tmp_path / "copy"))
    before = code_digest.__wrapped__(copy)
    assert before == identity.content["code"]
    with (copy / "report" / "page.py").open("a") as file:
        file.write("# shows, and decides nothing\n")
    assert code_digest.__wrapped__(copy) == before
    with (copy / "slam" / "__init__.py").open("a") as file:
        file.write("# may decide\n")
    assert code_digest.__wrapped__(copy) != before


def test_another_run_is_refused_with_what_differs(stored, short_spec, room, identity):
    assert find_run(stored, identity)["state"] == "done"
    with pytest.raises(ConfigError, match=r"holds another run \(config\.seed is 7 there and 8 here\); give"):
        find_run(stored, run_identity(short_spec.model_copy(update={"seed": 8}), room))


def test_a_run_in_a_room_that_was_changed_since_is_another(stored, short_spec, room, tmp_path):
    """The same name and place, one radius less by a tenth: refused where the other is, and in a folder of its own."""
    changed = Path(shutil.copytree(ROOM, tmp_path / "paper_room"))
    text = (changed / "scene.toml").read_text()
    assert "radius = 0.05" in text
    (changed / "scene.toml").write_text(text.replace("radius = 0.05", "radius = 0.045"))
    now = run_identity(short_spec, load_scene(changed))
    with pytest.raises(ConfigError, match=r"holds another run \(scene\.sha256 is [0-9a-f]+ there and [0-9a-f]+ here\)"):
        find_run(stored, now)
    with pytest.raises(ConfigError, match="holds another run"), open_run(stored, now):
        pass
    assert now.folder != run_identity(short_spec, room).folder


def test_a_folder_of_something_else_is_refused(tmp_path, identity):
    assert find_run(tmp_path / "new", identity) is None
    (tmp_path / ".rislam-rt-lock").write_text("a process was killed before it said anything")
    assert find_run(tmp_path, identity) is None
    (tmp_path / "notes.txt").write_text("mine")
    for place in (tmp_path, tmp_path / "notes.txt"):
        with pytest.raises(ConfigError, match="; give"):
            find_run(place, identity)
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(ResultError, match=r"run\.json: no schema"), open_run(tmp_path, identity):
        pass
    assert (tmp_path / "run.json").read_text() == "{}"


def test_two_runs_do_not_share_a_folder(tmp_path, identity):
    with (
        open_run(tmp_path / "run", identity),
        pytest.raises(ConfigError, match=rf"another run is at work there \(process {os.getpid()} on "),
        open_run(tmp_path / "run", identity),
    ):
        pass
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["run.json"]


def test_the_lock_of_a_dead_process_is_taken_over(tmp_path):
    code = "import os, sys\nfrom pathlib import Path\nfrom rislam_rt.storage.lock import hold\n"
    code += "with hold(Path(sys.argv[1]), 'run'):\n    print('held', flush=True)\n    sys.stdin.read()\n"
    words = [sys.executable, "-c", code, str(tmp_path)]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        other.stdout.readline()
        with pytest.raises(ConfigError, match=rf"process {other.pid} on "), hold(tmp_path, "run"):
            pass
        other.kill()
        other.wait()
    assert [path.name for path in tmp_path.iterdir()] == [".rislam-rt-lock"]
    with hold(tmp_path, "run"):
        assert str(os.getpid()) in (tmp_path / ".rislam-rt-lock").read_text()
    assert list(tmp_path.iterdir()) == []


def test_a_link_to_nothing_is_refused_before_the_work(identity, tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    with pytest.raises(ConfigError, match="a link to nothing"):
        find_run(tmp_path / "link", identity)


@pytest.mark.parametrize("change", [{"files": None}, {"files": {"a": 1}}, {"state": "over"}, {"identity": 3}, {}])
def test_a_marker_of_another_form_is_refused_whatever_its_checksum_says(identity, tmp_path, change):
    """A forged marker has a checksum that fits; it is one line, not a traceback."""
    about = {"state": "done", "identity": identity.digest, **identity.content, "files": {}} if change else {}
    (tmp_path / "run.json").write_text(json.dumps(seal({**about, **change})))
    for reader in (lambda: find_run(tmp_path, identity), lambda: read_run(tmp_path)):
        with pytest.raises(ResultError, match=r"run\.json: no state, identity or files"):
            reader()


def test_unwritable_place_is_a_store_error(identity):
    with pytest.raises(StoreError, match="cannot be written"), open_run(Path("/proc/nowhere/run"), identity):
        pass


def test_a_pipe_is_written_to_and_stays(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_atomic(pipe, b"content")
        write_pieces(pipe, (part for part in (b" in", b" pieces")))
        assert os.read(reader, 100) == b"content in pieces"
    finally:
        os.close(reader)
    assert pipe.is_fifo()
