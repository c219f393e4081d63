"""Pipelines and rooms that come with the package: found by name, in a checkout and in a wheel."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from rislam_rt.errors import ConfigError, SceneError
from rislam_rt.pipeline import load_spec
from rislam_rt.shipped import (
    find_pipeline,
    find_room,
    first_sentence,
    name_from_here,
    room_beside,
    shipped_pipelines,
    shipped_rooms,
    short_names,
)
from rislam_rt.studies import load_any
from rislam_rt.studies.pipeline_sweep import slam_sweep
from rislam_rt.sweeps import build_cells

ROOT = Path(__file__).parents[1]


def test_all_of_them_are_known_by_name() -> None:
    assert set(shipped_pipelines()) == {file.stem for file in (ROOT / "pipelines").glob("*.toml")}
    assert set(shipped_rooms()) == {folder.name for folder in (ROOT / "scenes").iterdir()}


@pytest.mark.parametrize("file", shipped_pipelines().values(), ids=lambda file: file.stem)
def test_every_pipeline_says_what_it_does(file: Path) -> None:
    sentence = first_sentence(file)
    assert len(sentence) > 30
    assert sentence.endswith((".", "?"))


def test_a_users_own_file_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert find_pipeline("rooms").samefile(ROOT / "pipelines" / "rooms.toml")
    (tmp_path / "rooms").mkdir()
    assert find_pipeline("rooms").samefile(ROOT / "pipelines" / "rooms.toml"), "a folder is no pipeline"
    assert find_room("office").samefile(ROOT / "scenes" / "office")
    (tmp_path / "office").mkdir()
    assert find_room("office") == Path("office")


def test_a_pipeline_may_name_a_built_in_room_and_its_own_folder_comes_first(tmp_path: Path) -> None:
    assert room_beside(tmp_path, "office").samefile(ROOT / "scenes" / "office")
    assert room_beside(ROOT / "pipelines", "../scenes/office").samefile(ROOT / "scenes" / "office")
    assert room_beside(tmp_path, "../scenes/office") == tmp_path.parent / "scenes" / "office", "no folder, no name"
    (tmp_path / "office").mkdir()
    assert room_beside(tmp_path, "office") == tmp_path / "office"


def test_a_scene_of_the_command_line_is_as_seen_from_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same for a setting, the list of a study, its table of rooms, and a sweep's axis."""
    here, beside = tmp_path / "here", tmp_path / "beside"
    beside.mkdir()
    for name in ("mine", "l_room"):
        shutil.copytree(ROOT / "scenes" / "empty_box", here / name)
    for name in ("trace_then_slam", "rooms", "compare_channels"):
        shutil.copy(ROOT / "pipelines" / f"{name}.toml", beside)
    monkeypatch.chdir(here)

    def found(name: str) -> Path:
        return room_beside(beside, name).resolve()

    assert found(str(load_spec(beside / "trace_then_slam.toml", ["scene=mine"]).scene)) == here / "mine"
    assert found(load_any(beside / "rooms.toml", ["scenes=['./mine']"]).scenes[0]) == here / "mine"
    rooms = load_any(beside / "compare_channels.toml", ["rooms=[{scene='mine'}, {scene='office'}]"]).rooms
    assert [found(room.scene) for room in rooms] == [here / "mine", ROOT / "scenes" / "office"]
    few = ["cycles=2", 'schemes=["no_ris"]', "channel=image_source"]
    sweep = slam_sweep(beside / "trace_then_slam.toml", few, ["scene=mine,l_room,office"])
    axis = [found(str(name)) for name in sweep.axes[0].values]
    assert axis == [here / "mine", here / "l_room", ROOT / "scenes" / "office"], "a folder here comes before a name"
    assert sweep.axes[0].values[2] == "office"
    shutil.copytree(here / "mine", beside / "office")  # beside the file, which the command line does not mean
    assert found(str(load_spec(beside / "trace_then_slam.toml", ["scene=office"]).scene)) == ROOT / "scenes" / "office"
    monkeypatch.chdir(tmp_path)
    copied = load_spec(beside / "trace_then_slam.toml", ["scene=../here/mine"]).scene  # a path copied from the file
    assert found(str(copied)) == here / "mine"
    with pytest.raises(SceneError, match="no such scene file"):
        build_cells(slam_sweep(beside / "trace_then_slam.toml", few, ["scene=mine"]))


def test_scenes_of_one_name_are_told_apart_by_the_folders_they_are_in() -> None:
    names = short_names(["../a/hall", "../b/hall", "office", "../../x/mine", "../a/hall"])
    assert list(names.values()) == ["a/hall", "b/hall", "office", "mine"]
    assert short_names(["hall", "../hall"]) == {"hall": "hall", "../hall": "../hall"}


def test_a_folder_is_called_what_finds_it_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    office = ROOT / "scenes" / "office"
    assert name_from_here(office) == "office"
    assert name_from_here(tmp_path / "mine" / "office") == "mine/office"
    (tmp_path / "office").mkdir()
    assert room_beside(tmp_path, name_from_here(office)).samefile(office), "another room has taken the name"


def test_a_name_with_a_slip_is_mended() -> None:
    with pytest.raises(ConfigError, match="did you mean 'trace_then_slam'"):
        load_spec(find_pipeline("trace_then_slm"))


def test_a_package_folder_alone_says_where_it_looked(tmp_path: Path) -> None:
    """Copied without the folders beside it, and put on the module path; a room of one's own is beside it."""
    shutil.copytree(ROOT / "rislam_rt", tmp_path / "rislam_rt")  # with what is compiled, if anything is
    shutil.copytree(ROOT / "scenes" / "empty_box", tmp_path / "mine")

    def said(*words: str, code: int = 2) -> list[str]:
        done = subprocess.run(
            [sys.executable, "-m", "rislam_rt", *words], cwd=tmp_path, check=False, capture_output=True, text=True,
            timeout=120, env={**os.environ, "PYTHONPATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"},
        )  # fmt: skip
        assert done.returncode == code
        return " ".join(done.stderr.split()).removeprefix("error: ").split(" error: ")

    def looked(kind: str) -> str:
        inside, beside = tmp_path / "rislam_rt" / "shipped" / kind, tmp_path / kind
        return f"not found in {inside} (of an installed package) and {beside} (of a checkout): install it whole, or"

    (line,) = said("check", "mine")
    assert line.startswith("trace_then_slam: no such pipeline file; the pipelines that come with the package were not")
    assert looked("pipelines") in line
    (line,) = said("new", "other")
    assert line.startswith("template: 'paper_room' received; the scenes that come with the package were not found")
    for kind, line in zip(("pipelines", "scenes"), said("pipelines", code=3), strict=True):
        assert looked(kind) in line


def test_the_wheel_carries_them(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True, timeout=120)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    assert (tmp_path / "site" / "rislam_rt" / "py.typed").exists()
    for asset in (ROOT / "rislam_rt" / "report" / "view").glob("*.*"):
        carried = tmp_path / "site" / "rislam_rt" / "report" / "view" / asset.name
        assert carried.read_bytes() == asset.read_bytes()
    (tmp_path / "empty").mkdir()
    listed = subprocess.run(
        [sys.executable, "-m", "rislam_rt", "pipelines", "--json", "list.json"],
        cwd=tmp_path / "empty",
        env={**os.environ, "PYTHONPATH": str(tmp_path / "site")},
        check=True,
        capture_output=True,
        timeout=120,
    )
    assert listed.stderr == b""
    found = json.loads((tmp_path / "empty" / "list.json").read_text())
    assert set(found["pipelines"]) == set(shipped_pipelines())
    assert found["rooms"] == list(shipped_rooms())
