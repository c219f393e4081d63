"""`score`: the card of a run in a room of one's own, its recordings, and one line for what cannot be."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import rislam_rt
from rislam_rt.pipeline.own_method_files import own_digests, own_sources
from rislam_rt.pipeline.own_methods import load_own
from rislam_rt.storage.checksums import seal
from rislam_rt.studies.score_card.score import OVER_TIME

ROOT = Path(__file__).parents[2]
SHORT = ("channel=image_source", "depth=1", "cycles=14", "receiver.estimator=bound", 'schemes=["random"]')
RUN = ("run", "trace_then_slam", "--scene", "room", "--no-report", *(w for one in SHORT for w in ("--set", one)))


def test_a_run_in_a_room_of_ones_own_is_scored_and_recorded(run, tmp_path):
    assert run("new", "room", "--template", "two_scatterers")[0] == 0
    assert run(*RUN, "--out", "mine")[0] == 0
    before = {file: file.stat().st_mtime_ns for file in (tmp_path / "mine").rglob("*")}
    code, out, err = run("score", "mine", "--save", "kept", "--json", "card.json")
    assert code == 0
    assert "replaying 14 cycles of 1 scheme: localising took " in err
    assert "relative RMSE / relative bound" in out
    assert "not known" not in out
    assert f"recording: {Path('kept') / 'mine_random.nc'}\n" in out
    told = json.loads(Path("card.json").read_text())
    assert (told["replayed"], told["cycles"], told["seed"]) == (True, 14, 7)
    recording = rislam_rt.read_recording("kept/mine_random.nc")
    answers = rislam_rt.replay(recording.inputs, recording.config, recording.scheme, rng=np.random.default_rng(0))
    scores = {"ran": "random", **rislam_rt.score_run(recording.truth, recording.inputs, answers)}
    assert scores == recording.scores
    assert {name: told["schemes"]["random"][name] for name in scores} == scores
    # the same again, without the replay; nothing in the run folder has changed
    code, out, err = run("score", "mine", "--no-replay", "--save", "kept", "-q", "--json", "last.json")
    assert (code, err) == (0, "")
    assert "not known" in out
    last, whole = (json.loads(Path(name).read_text())["schemes"]["random"] for name in ("last.json", "card.json"))
    assert {name for name in whole if last[name] != whole[name]} <= {*OVER_TIME, "cycle_ms"}
    assert {last[name] for name in (*OVER_TIME, "cycle_ms")} == {None}
    assert {file: file.stat().st_mtime_ns for file in (tmp_path / "mine").rglob("*")} == before
    # what is not of the program's making stays
    Path("kept/mine_random.nc").write_text("of my own")
    code, out, err = run("score", "mine", "--no-replay", "--save", "kept")
    assert (code, out) == (2, "")
    assert err.startswith("error: --save kept/mine_random.nc: is there already, and not of this program's making")
    for name in ("card.json", "one.nc"):
        assert run("score", "mine", "--no-replay", "--save", name)[2] == (
            f"error: --save {name}: names a file; give a folder, for one recording of each scheme\n"
        )
    assert Path("kept/mine_random.nc").read_text() == "of my own"


OWN = """import numpy as np
from rislam_rt.model import pose_estimate


class Resting:
    def init(self, start, body, panel, sensor, *, rng):
        return start, body

    def step(self, state, measurement, code, dt, heading, *, rng):
        return state

    def estimate(self, state):
        start, body = state
        return pose_estimate(start.position, 0.0 * start.velocity, start.heading, np.eye(6), body)
"""


def test_a_filter_of_ones_own_is_scored_where_its_file_is(run, tmp_path, monkeypatch):
    module = f"own_{tmp_path.name}"  # a name that no other test has loaded
    (tmp_path / f"{module}.py").write_text(OWN)
    words = (*RUN[:2], *RUN[4:-2], "--set", f'schemes=["{module}:Resting"]', "--set", "cycles=6")
    assert run(*words, "--out", "mine")[0] == 0
    away = (sys.executable, "-m", "rislam_rt", "score", tmp_path / "mine", "--json", "card.json")
    (tmp_path / "away").mkdir()
    done = subprocess.run(away, cwd=tmp_path / "away", capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    mend = f"put {module}.py into the working folder, or install it"
    assert done.stderr == f"error: {tmp_path / 'mine'}: '{module}:Resting': no module '{module}'; {mend}\n"
    monkeypatch.delitem(sys.modules, module)
    code, _, err = run("score", "mine", "--json", "card.json")
    assert code == 0, err
    card = json.loads((tmp_path / "card.json").read_text())["schemes"][f"{module}:Resting"]
    assert card["relative_rmse_m"] > 0.0
    assert (card["births"], card["walls_found"]) == (0, 0)


@pytest.mark.parametrize("folder", ["nowhere", ROOT / "docs"])
def test_what_is_no_run_is_one_line(run, tmp_path, folder):
    code, out, err = run("score", folder, "--save", "kept")
    assert (code, out) == (2, "")
    assert err == f"error: {folder}: not a completed run (no run.json); give a folder that `run` wrote\n"
    assert list(tmp_path.iterdir()) == []


def test_a_run_of_a_method_of_ones_own_is_reported_and_repeated_where_its_file_is_not(
    run, tmp_path, monkeypatch, undrawn
):
    module = f"repeated_{tmp_path.name}"
    (tmp_path / f"{module}.py").write_text(f"from {module}_more import *\n")
    (tmp_path / f"{module}_more.py").write_text(OWN)
    name = f"{module}:Resting"
    words = (*RUN[:2], *RUN[4:-2], "--set", f'schemes=["{name}"]', "--set", "cycles=6")
    assert run(*words, "--out", "mine")[0] == 0
    names = {file.name for file in (tmp_path / "mine").iterdir()}
    assert not any(":" in one for one in names)  # which Windows allows in no name
    assert {f"{module}.py", f"{module}_more.py", f"scheme_{module}@Resting.nc"} <= names
    shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
    for file in tmp_path.glob(f"{module}*.py"):
        file.unlink()

    def away(*words):
        line = (sys.executable, "-m", "rislam_rt", *words)
        return subprocess.run(line, cwd=tmp_path / "away", capture_output=True, text=True, check=False)

    def report(*words):  # as a program would that starts in `away`, and has loaded nothing
        monkeypatch.chdir(tmp_path / "away")
        monkeypatch.setattr(sys, "path", [one for one in sys.path if one != str(tmp_path)])
        for loaded in [one for one in sys.modules if one.startswith(module)]:
            monkeypatch.delitem(sys.modules, loaded)
        load_own.cache_clear()
        return run("report", tmp_path / "mine", *words)

    (tmp_path / "away").mkdir()
    code, _, err = report("--json", "summary.json")
    assert code == 0, err
    assert f"'{name}': no module '{module}'; these scores are those that the run stored\n" in err
    stored, told = (json.loads((tmp_path / one / "summary.json").read_text())["schemes"] for one in ("mine", "away"))
    assert stored == told
    assert name in (tmp_path / "mine" / "report.html").read_text()
    # `python -m` looks in the working folder first: a file edited since is not what ran
    (tmp_path / "away" / f"{module}.py").write_text("raise SystemExit\n")
    done = away("run", tmp_path / "mine" / "config.toml", "--no-report", "--out", "copied")
    assert done.returncode == 0, done.stderr
    (tmp_path / "away" / f"{module}.py").unlink()
    # a run of before, with colons in the names of its files
    marker = json.loads((tmp_path / "mine" / "run.json").read_text())
    for one in [*names]:
        if "@" in one:
            (tmp_path / "mine" / one).rename(tmp_path / "mine" / one.replace("@", ":"))
    files = {one.replace("@", ":"): digest for one, digest in marker.pop("files").items()}
    marker = seal({key: marker[key] for key in marker if key not in ("schema", "checksum")} | {"files": files})
    (tmp_path / "mine" / "run.json").write_text(json.dumps(marker))
    assert report()[0] == 0
    done = away("run", tmp_path / "mine" / "config.toml", "--no-report", "--out", "again")
    assert done.returncode == 0, done.stderr
    again = tmp_path / "away" / "again" / f"estimate_{module}@Resting.tum"
    assert again.read_bytes() == (tmp_path / "mine" / f"estimate_{module}:Resting.tum").read_bytes()


def test_a_copy_of_a_method_that_is_not_what_ran_is_not_kept(run, tmp_path, monkeypatch):
    module = f"edited_{tmp_path.name}"
    file = tmp_path / f"{module}.py"
    file.write_text(OWN)
    monkeypatch.syspath_prepend(str(tmp_path))
    digests = own_digests([f"{module}:Resting", "json:dumps"])
    assert own_sources(digests) == {file.name: file.read_bytes()}  # what is installed is not copied
    file.write_text(OWN + "\n# edited while it ran\n")
    assert own_sources(digests) == {}
