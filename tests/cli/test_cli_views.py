"""`show --html`: files that stand alone, and one line for what cannot be."""

import json
import re
import shutil
from pathlib import Path

import pytest

from rislam_rt.cli.entry_point import at_home
from rislam_rt.shipped import find_room
from rislam_rt.storage.checksums import seal

SHORT = ("--set", "channel=image_source", "--set", "cycles=3", "--set", "depth=0", "--set", 'schemes=["random"]')
PIPELINE = Path(__file__).parents[2] / "pipelines" / "trace_then_slam.toml"


def test_show_writes_a_page_that_turns_and_a_picture_if_asked(run, tmp_path):
    code, out, _ = run("show", "paper_room", "--html", "room.html", "--depth", 0)
    assert code == 0
    assert "view: room.html" in out
    assert [path.name for path in tmp_path.iterdir()] == ["room.html"]
    text = (tmp_path / "room.html").read_text()
    assert text.startswith("<!doctype html>")
    assert "6 x 6 x 3 m, 60 poses along the way" in text
    code, out, _ = run("show", "empty_box", "--html", "box.html", "--out", "box.png", "--depth", 1)
    assert code == 0
    assert (tmp_path / "box.png").stat().st_size > 10_000
    assert "box.png" in out


def test_show_lists_what_only_shades(run, tmp_path):
    room = tmp_path / "room"
    shutil.copytree(find_room("shaded_room"), room)
    with (room / "scene.toml").open("a") as scene:
        scene.write('\n[[shade]]\nname = "curtain"\nmesh = "meshes/curtain.obj"\n')
    (room / "meshes" / "curtain.obj").write_text("v 3 1 0\nv 3 2 0\nv 3 2 2\nv 3 1 2\nf 1 2 3 4\n")
    code, out, _ = run("show", room, "--html", "room.html", "--depth", 0)
    assert code == 0
    assert re.search(r"occluder +│ curtain +│ 2 triangles ", out)
    assert re.search(r"ball +│ \(2.40, 3.20, 1.30\), 0.196 m2, shades ", out)


def test_a_view_that_cannot_be_is_one_line(run, tmp_path):
    code, out, err = run("show", "paper_room", "--html", "room.html", "--set", "radio.carrier=3")
    assert code == 2
    assert not out
    assert "did you mean" in err
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
    code, _, err = run("show", "paper_room", "--html", "/proc/none/room.html", "--depth", 0)
    assert code == 4
    assert "/proc/none/room.html" in err


def test_report_of_a_run_with_settings_of_another_version_is_one_line(run, tmp_path):
    assert run("run", PIPELINE, *SHORT, "--no-report", "--out", "r")[0] == 0
    marker = tmp_path / "r" / "run.json"
    about = json.loads(marker.read_text())
    del about["checksum"], about["schema"]
    about["config"]["slam"] |= {"num_particles": 1, "gate": 16.3}
    marker.write_text(json.dumps(seal(about)))
    code, _, err = run("report", "r")
    assert code == 2
    assert "settings that this one does not take (slam.num_particles and 1 more)" in err
    assert len(err.splitlines()) == 1


@pytest.mark.parametrize("words", [("--out=~/room.png",), ("--out", "~/room.png")])
def test_a_home_folder_is_written_out_wherever_it_stands(run, tmp_path, monkeypatch, words):
    """No shell does it behind `=`; whoever cleans up a folder called `~` loses the home."""
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.setenv("HOME", str(home))
    code, _, _ = run("show", "empty_box", "--depth", 0, *words)
    assert code == 0
    assert (home / "room.png").exists()
    assert not (tmp_path / "~").exists()
    assert find_room("~") == home
    assert [at_home(word) for word in ("--set=scene=~/a", "a~b", "x=y~", "./~")] == [
        f"--set=scene={home}/a", "a~b", "x=y~", "./~",
    ]  # fmt: skip
