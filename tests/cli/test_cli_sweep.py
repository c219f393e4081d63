"""`rislam-rt sweep`: exit codes, what it writes, one line for every failure."""

import json
import re
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PIPELINE = ROOT / "pipelines" / "trace_then_slam.toml"
TINY = ("--set", "channel=image_source", "--set", "depth=1", "--set", "cycles=3", "--set", "receiver.estimator=bound",
        "--set", "slam.num_samples=20", "--set", 'schemes=["random"]')  # fmt: skip


@pytest.fixture
def sweep(run):
    return lambda *arguments: run("sweep", *arguments)


@pytest.fixture
def here(cells_here):
    """Cells in this process."""
    with cells_here():
        yield


def test_estimate_then_sweep_then_nothing_left(sweep, tmp_path, here):
    words = (PIPELINE, *TINY, "--axis", "slam.sigma_a=0.01,0.1", "--repeat", "1", "--jobs", "1")
    code, out, err = sweep(*words, "--estimate")
    assert (code, out) == (0, "")
    assert "2 cells, 1 done; 1 left at about" in err
    folder = tmp_path / "sweeps" / "trace_then_slam-paper_room"
    assert len(list((folder / "cells").iterdir())) == 1
    code, out, err = sweep(*words, "--json", "sweep.json")
    assert code == 0
    assert "random" in out
    rows = json.loads((tmp_path / "sweep.json").read_text())["rows"]
    assert [(row["slam.sigma_a"], row["runs"], row["failed"]) for row in rows] == [(0.01, 1, 0), (0.1, 1, 0)]
    assert {path.name for path in folder.iterdir()} == {
        "cells", "sweep.json", "table.csv", "table.json", "scores.csv", "scores.json", "scores.png", "timings.jsonl",
    }  # fmt: skip
    code, _, err = sweep(*words)
    assert code == 0
    assert "nothing left to do" in err
    before = {path: path.read_bytes() for path in (folder / "cells").iterdir()}
    first, second = before
    first.write_bytes(before[second])  # one of two, copied over the other: it is done again
    code, _, err = sweep(*words)
    assert (code, "nothing left to do" in err) == (0, False)
    assert {path: path.read_bytes() for path in before} == before


def test_scenes_of_one_name_get_a_folder_each(sweep, tmp_path, here, undrawn):
    """A copy with darker walls, in another place: the table of the first stays as it is."""
    for place, reflection in (("a", "0.85"), ("b", "0.3")):
        shutil.copytree(ROOT / "scenes" / "paper_room", tmp_path / place / "hall")
        file = tmp_path / place / "hall" / "scene.toml"
        file.write_text(file.read_text().replace("reflection = 0.85", f"reflection = {reflection}"))
    tables = {}
    for place in ("a", "b", "a", "b"):
        code, out, _ = sweep(PIPELINE, *TINY, "--scene", f"{place}/hall", "--repeat", "1", "--jobs", "1")
        assert code == 0
        folder = tmp_path / out.rpartition("sweep folder: ")[2].strip()
        assert tables.setdefault(place, (folder, (folder / "table.csv").read_bytes())) == (
            folder, (folder / "table.csv").read_bytes(),
        )  # fmt: skip
    assert tables["a"][0] == tmp_path / "sweeps" / "trace_then_slam-hall"
    assert re.fullmatch("trace_then_slam-hall-[0-9a-f]{8}", tables["b"][0].name)
    assert all(len(list((folder / "cells").iterdir())) == 1 for folder, _ in tables.values())


def test_other_settings_get_a_folder_and_fewer_repetitions_are_told(sweep, tmp_path, here, undrawn):
    """The scores of the first sweep once were replaced by those of the second without a word."""
    words = (PIPELINE, *TINY, "--axis", "slam.sigma_a=0.01,0.1", "--jobs", "1")
    first = tmp_path / "sweeps" / "trace_then_slam-paper_room"
    assert sweep(*words, "--repeat", "2")[1].endswith("sweep folder: sweeps/trace_then_slam-paper_room\n")
    before = (first / "scores.csv").read_bytes()
    code, out, _ = sweep(*words, "--repeat", "1", "--set", "cycles=4")
    folder = tmp_path / out.rpartition("sweep folder: ")[2].strip()
    assert (code, len(list((folder / "cells").iterdir()))) == (0, 2)
    assert re.fullmatch("trace_then_slam-paper_room-[0-9a-f]{8}", folder.name)
    assert (first / "scores.csv").read_bytes() == before
    _, out, err = sweep(*words, "--repeat", "1")
    assert "nothing left to do" in err
    assert "trace_then_slam-paper_room (besides 2 cells of other settings or repetitions, kept" in out
    assert "besides" not in sweep(*words, "--repeat", "2")[1]
    assert (first / "scores.csv").read_bytes() == before


def test_a_folder_is_not_taken_over_by_other_settings(sweep, tmp_path, here, undrawn):
    """A file that was damaged, or a folder that was deleted, once made finished cells of other settings run again."""

    def folder(cycles):
        code, out, err = sweep(PIPELINE, *TINY, "--repeat", "1", "--jobs", "1", "--set", f"cycles={cycles}")
        assert code == 0, err
        found = tmp_path / out.rpartition("sweep folder: ")[2].strip()
        assert len([*(found / "cells").iterdir()]) == 1
        return found

    first, second = folder(3), folder(4)
    (first / "sweep.json").write_text("{")
    assert folder(4) == second
    assert len({first, second, folder(2)}) == 3
    assert folder(3) == first
    shutil.rmtree(first)
    assert folder(4) == second
    assert folder(3) == first


@pytest.mark.parametrize("text", ["", "{", '{"schema": 1}'])
def test_a_damaged_sweep_file_costs_no_cell(sweep, tmp_path, here, undrawn, text):
    words = (PIPELINE, *TINY, "--repeat", "1", "--jobs", "1")
    sweep(*words)
    file = tmp_path / "sweeps" / "trace_then_slam-paper_room" / "sweep.json"
    before = file.read_bytes()
    file.write_text(text)
    code, _, err = sweep(*words)
    assert (code, "nothing left to do" in err) == (0, True)
    assert file.read_bytes() == before
    file.write_text(text)
    for cell in (file.parent / "cells").iterdir():
        cell.write_text("{}")  # no sweep's folder for certain: nothing there is touched
    code, _, err = sweep(*words)
    assert (code, len(err.splitlines())) == (2, 1)
    assert file.read_text() == text


def test_a_failed_run_is_told_and_exit_1(sweep, tmp_path):
    # no run can be done in a millisecond: the limit stops each of them
    code, out, err = sweep(PIPELINE, *TINY, "--repeat", "2", "--time-limit", "0.001", "--jobs", "2", "--out", "mine")
    assert code == 1
    assert err.count("hung: not done after 0.001 s") == 2
    assert "none" in out
    assert "hung" in (tmp_path / "mine" / "table.csv").read_text()


@pytest.mark.parametrize(
    "words",
    [
        ("nowhere.toml",),
        (PIPELINE, "--axis", "slam.sigma_a"),
        (PIPELINE, "--axis", "slam.sigma=1,2"),
        (PIPELINE, "--axis", "seed=1,2"),
        (PIPELINE, "--axis", "cycles=3,1000"),
        (PIPELINE, "--axis", "slam.sigma_a=0.1", "--axis", "slam=1"),
        (PIPELINE, "--axis", "slam.sigma_a=0.1", "--axis", "slam.sigma_a=0.2"),
        (PIPELINE, "--repeat", "0"),
        (PIPELINE, "--jobs", "0"),
        (PIPELINE, "--time-limit", "0"),
        (PIPELINE, "--time-limit", "nan"),
        (PIPELINE, "--scene", "nowhere"),
        (ROOT / "pipelines" / "fig4a.toml",),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(sweep, tmp_path, words):
    code, out, err = sweep(*words)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_no_scheduler_is_exit_3(sweep, tmp_path, monkeypatch):
    from rislam_rt.sweeps import pools

    assert pools.CONNECT_SECONDS <= 3  # the command as a whole is to end within 10 s
    monkeypatch.setattr(pools, "CONNECT_SECONDS", 0.2)
    for address in ("tcp://127.0.0.1:9", "nonsense", "nonsense://here", "tcp://127.0.0.1:99999"):
        code, _, err = sweep(PIPELINE, *TINY, "--dask", address)
        assert code == 3
        assert "no scheduler answers" in err
        assert list(tmp_path.iterdir()) == []
    assert sweep(PIPELINE, *TINY, "--dask", " ")[0] == 2


def test_a_sweep_touches_nothing_of_the_user(run, sweep, tmp_path):
    mine = (".git-credentials", ".pre-commit-config.yaml", "cells/.a-b", "notes.txt")
    for name in mine:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    for place in (".", "cells", "notes.txt"):
        code, _, err = sweep(PIPELINE, *TINY, "--repeat", "1", "--out", place)
        assert code == 2
        assert len(err.splitlines()) == 1
    study = 'kind = "rooms"\nname = "{}"\nscenes = ["{}"]\nrepetitions = 1\n'
    for name in ("..", ".", ".hidden", "a/b", "../a", ""):
        (tmp_path / "study.toml").write_text(study.format(name, ROOT / "scenes" / "paper_room"))
        code, _, err = run("run", "study.toml")
        assert (code, len(err.splitlines())) == (2, 1)
    (tmp_path / "study.toml").unlink()
    assert {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")} == {*mine, "cells"}
    assert all((tmp_path / name).read_text() == name for name in mine)


def test_interrupt_is_one_line(sweep, monkeypatch):
    import rislam_rt.sweeps as sweeps

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(sweeps, "run_sweep", interrupted)
    code, _, err = sweep(PIPELINE, *TINY)
    assert code == 130
    assert err.splitlines()[-1] == "interrupted: what is done is kept; the same command goes on from there"
