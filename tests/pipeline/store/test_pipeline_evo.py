"""Our trajectories in evo, a program of others: its error is the one that a run's summary says."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from rislam_rt.pipeline.scores.summary import summarise
from rislam_rt.pipeline.store.exports import export_files


def test_evo_ape_reads_a_run_and_agrees(short_result, tmp_path):
    summary = summarise(short_result)
    for name, content in export_files(short_result, summary, {}).items():
        if name.endswith(".tum"):
            (tmp_path / name).write_bytes(content)
    scheme = next(iter(short_result.schemes))
    words = ["tum", "truth.tum", f"estimate_{scheme}.tum", "--save_results", "ape.zip", "--no_warnings"]
    done = subprocess.run(
        [str(Path(sys.executable).with_name("evo_ape")), *words],
        cwd=tmp_path, env={**os.environ, "HOME": str(tmp_path)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    with zipfile.ZipFile(tmp_path / "ape.zip") as found:
        said = json.loads(found.read("stats.json"))
    # positions are written to nine digits
    assert said["rmse"] == pytest.approx(summary["schemes"][scheme]["rmse_m"], abs=1e-8)
