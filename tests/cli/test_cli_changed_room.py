"""A room that is edited between two runs: the second run is another one, and the first stays as it was."""

import shutil
from pathlib import Path

ROOT = Path(__file__).parents[2]
PIPELINE = ROOT / "pipelines" / "trace_then_slam.toml"
SHORT = ("channel=image_source", "depth=0", "cycles=3", "receiver.estimator=bound", 'schemes=["random"]')


def test_a_run_in_a_room_that_was_edited_is_another_run(run, tmp_path):
    shutil.copytree(ROOT / "scenes" / "paper_room", tmp_path / "room")
    words = ("run", PIPELINE, "--scene", "room", "--no-report", *(word for one in SHORT for word in ("--set", one)))
    assert run(*words)[0] == 0
    (first,) = (tmp_path / "runs").iterdir()
    before = {path: path.read_bytes() for path in first.rglob("*") if path.is_file()}
    file = tmp_path / "room" / "scene.toml"
    text = file.read_text()
    assert "radius = 0.05" in text
    file.write_text(text.replace("radius = 0.05", "radius = 0.08"))
    code, _, err = run(*words, "--out", first)
    assert code == 2
    assert "holds another run (scene.sha256 is " in err
    code, out, _ = run(*words)
    assert code == 0
    assert "nothing was computed" not in out
    assert len(list((tmp_path / "runs").iterdir())) == 2
    assert {path: path.read_bytes() for path in before} == before
    file.write_text(text)  # as it was: the first run again
    assert run(*words)[1].startswith("this run is complete already")


def test_a_run_that_is_shown_again_says_its_warnings_again(run):
    """Those of the room and those of the run: what comes in too late, as `check` says it before."""
    words = ("--set", "depth=1", "--set", "receiver.max_delay=20e-9", "--no-report")
    words = ("run", PIPELINE, "--scene", "paper_room", *(word for one in SHORT for word in ("--set", one)), *words)
    first, again = ([line for line in run(*words)[2].splitlines() if line.startswith("warning: ")] for _ in range(2))
    assert len(first) == 2
    assert sum("receiver.max_delay: " in line for line in first) == 1
    assert sorted(again) == sorted(first)
