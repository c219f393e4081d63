"""`rislam-rt sweep`: exit codes, what it writes, one line for every failure."""

import json
import signal
import sys
from pathlib import Path

import pytest

from rislam_rt.cli import main

ROOT = Path(__file__).parents[2]
PIPELINE = str(ROOT / "pipelines" / "trace_then_slam.toml")
TINY = ("--set", "channel=image_source", "--set", "cycles=3", "--set", "slam.num_particles=20",
        "--set", 'schemes=["random"]')  # fmt: skip


@pytest.fixture
def run(capsys, monkeypatch, tmp_path):
    """Sweep in an empty folder; returns exit code, output and error stream."""
    monkeypatch.chdir(tmp_path)
    before = signal.getsignal(signal.SIGTERM)

    def _run(*arguments):
        monkeypatch.setattr(sys, "argv", ["rislam-rt", "sweep", *arguments])
        with pytest.raises(SystemExit) as left:
            main()
        captured = capsys.readouterr()
        return left.value.code, captured.out, captured.err

    yield _run
    signal.signal(signal.SIGTERM, before)


def test_estimate_then_sweep_then_nothing_left(run, tmp_path):
    words = (PIPELINE, *TINY, "--axis", "slam.sigma_a=0.01,0.1", "--repeat", "1", "--jobs", "1")
    code, out, err = run(*words, "--estimate")
    assert (code, out) == (0, "")
    assert "2 cells, 1 done; 1 left at about" in err
    folder = tmp_path / "sweeps" / "trace_then_slam-paper_room"
    assert len(list((folder / "cells").iterdir())) == 1
    code, out, err = run(*words, "--json", "sweep.json")
    assert code == 0
    assert "random" in out
    rows = json.loads((tmp_path / "sweep.json").read_text())["rows"]
    assert [(row["slam.sigma_a"], row["runs"], row["failed"]) for row in rows] == [(0.01, 1, 0), (0.1, 1, 0)]
    assert {path.name for path in folder.iterdir()} == {
        "cells", "sweep.json", "table.csv", "table.json", "scores.csv", "scores.json", "scores.png", "timings.jsonl",
    }  # fmt: skip
    code, _, err = run(*words)
    assert code == 0
    assert "nothing left to do" in err


def test_a_failed_run_is_told_and_exit_1(run, tmp_path):
    # no run can be done in a millisecond: the limit stops each of them
    code, out, err = run(PIPELINE, *TINY, "--repeat", "2", "--time-limit", "0.001", "--jobs", "2", "--out", "mine")
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
        (PIPELINE, "--repeat", "0"),
        (PIPELINE, "--jobs", "0"),
        (PIPELINE, "--time-limit", "0"),
        (PIPELINE, "--time-limit", "nan"),
        (PIPELINE, "--scene", "nowhere"),
        (str(ROOT / "pipelines" / "fig4a.toml"),),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(run, tmp_path, words):
    code, out, err = run(*words)
    assert (code, out) == (2, "")
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_no_scheduler_is_exit_3(run, monkeypatch):
    from rislam_rt.pipeline.sweeps import cluster

    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.2)
    code, _, err = run(PIPELINE, *TINY, "--dask", "tcp://127.0.0.1:9")
    assert code == 3
    assert "no scheduler answers" in err


def test_interrupt_is_one_line(run, monkeypatch):
    import rislam_rt.pipeline.sweeps as sweeps

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(sweeps, "run_sweep", interrupted)
    code, _, err = run(PIPELINE, *TINY)
    assert code == 130
    assert err.splitlines()[-1] == "interrupted: what is done is kept; the same command goes on from there"
