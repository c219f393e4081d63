"""Pipelines and rooms that come with the package: found by name, in a checkout and in a wheel."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from rislam_rt.errors import ConfigError
from rislam_rt.pipeline import load_spec
from rislam_rt.shipped import (
    find_pipeline,
    find_room,
    first_sentence,
    name_from_here,
    room_beside,
    shipped_pipelines,
    shipped_rooms,
)

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
