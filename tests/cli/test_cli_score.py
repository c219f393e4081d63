"""`score`: the card of a run in a room of one's own, its recordings, and one line for what cannot be."""

import json
from pathlib import Path

import numpy as np
import pytest

import rislam_rt

ROOT = Path(__file__).parents[2]
SHORT = ("channel=image_source", "depth=1", "cycles=22", "receiver.estimator=bound", 'schemes=["random"]')
RUN = ("run", "trace_then_slam", "--scene", "room", "--no-report", *(w for one in SHORT for w in ("--set", one)))


def test_a_run_in_a_room_of_ones_own_is_scored_and_recorded(run, tmp_path):
    assert run("new", "room", "--template", "two_scatterers")[0] == 0
    assert run(*RUN, "--out", "mine")[0] == 0
    before = {file: file.stat().st_mtime_ns for file in (tmp_path / "mine").rglob("*")}
    code, out, err = run("score", "mine", "--save", "kept", "--json", "card.json")
    assert code == 0
    assert "replaying 22 cycles of 1 scheme: localising took " in err
    assert "relative RMSE / relative bound" in out
    assert "not known" not in out
    assert f"recording: {Path('kept') / 'mine_random.nc'}\n" in out
    told = json.loads(Path("card.json").read_text())
    assert (told["replayed"], told["cycles"], told["seed"]) == (True, 22, 7)
    recording = rislam_rt.read_recording("kept/mine_random.nc")
    answers = rislam_rt.replay(recording.inputs, recording.config, recording.scheme, rng=np.random.default_rng(0))
    scores = {"ran": "random", **rislam_rt.score_run(recording.truth, recording.inputs, answers)}
    assert scores == recording.scores
    assert {name: told["schemes"]["random"][name] for name in scores} == scores
    # the same again, without the replay; nothing in the run folder has changed
    code, out, err = run("score", "mine", "--no-replay", "--save", "kept", "-q")
    assert (code, err) == (0, "")
    assert "not known" in out
    assert {file: file.stat().st_mtime_ns for file in (tmp_path / "mine").rglob("*")} == before
    # what is not of the program's making stays
    Path("kept/mine_random.nc").write_text("of my own")
    code, out, err = run("score", "mine", "--no-replay", "--save", "kept")
    assert (code, out) == (2, "")
    assert err.startswith("error: --save kept/mine_random.nc: is there already, and not of this program's making")
    assert run("score", "mine", "--no-replay", "--save", "card.json")[2] == (
        "error: --save card.json: is a file; give a folder\n"
    )
    assert Path("kept/mine_random.nc").read_text() == "of my own"


@pytest.mark.parametrize("folder", ["nowhere", ROOT / "docs"])
def test_what_is_no_run_is_one_line(run, tmp_path, folder):
    code, out, err = run("score", folder, "--save", "kept")
    assert (code, out) == (2, "")
    assert err == f"error: {folder}: not a completed run (no run.json); give a folder that `run` wrote\n"
    assert list(tmp_path.iterdir()) == []
