"""Does a sweep that is killed at random moments end with the same bytes as one that nothing disturbed?

120 short runs of the main job through the command line, killed 20 times (SIGKILL to the whole process group) on one
worker, on two, and on a local Dask cluster that outlives its clients; then all files but the timings are compared with
those of an undisturbed sweep on one worker. Exit code 1 if a byte differs, or if a kill came after the end.

    python benchmarks/sweep_kill.py [--kills 20] [--seed 1]
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
SWEEP = (
    *("--set", "channel=image_source", "--set", "cycles=5", "--set", "slam.num_samples=40"),
    *("--set", 'schemes=["random"]', "--axis", "radio.reference_snr_db=-10,-5,0,5,10,15"),
    *("--axis", "slam.sigma_a=0.01,0.02,0.05,0.1", "--repeat", "5"),
)


def main() -> int:
    """Print one line a way of running."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng = np.random.default_rng(given.seed)
    with tempfile.TemporaryDirectory() as folder:
        base = Path(folder)
        begin = time.monotonic()
        first, took = finish(start(base / "whole", ("--jobs", "1")), base / "whole")
        whole = written(base / "whole")
        print(f"undisturbed, 1 worker: {cells(base / 'whole')} cells, {len(whole)} files, {took:.0f} s", flush=True)
        bad = 0
        with cluster() as address:
            for name, how in (("jobs1", ("--jobs", "1")), ("jobs2", ("--jobs", "2")), ("dask", ("--dask", address))):
                bad += torture(base / name, how, given.kills, first, whole, rng=rng)
        print(f"{time.monotonic() - begin:.0f} s in all")
    return int(bad > 0)


def torture(
    folder: Path, how: tuple[str, str], kills: int, first: float, whole: dict[str, bytes], *, rng: np.random.Generator
) -> int:
    """Kill a sweep so many times, let it end, compare; 1 if anything is wrong.

    Each kill waits for 0 to 7 more cells, drawn at random, and then a random time: up to that of the first cell if it
    waited for none (so that it falls into the start), else up to a second.
    """
    done, late = [], 0
    for _ in range(kills):
        wanted, process = cells(folder) + int(rng.integers(8)), start(folder, how)
        pause = rng.uniform(0.0, first if wanted == cells(folder) else 1.0)
        while process.poll() is None and cells(folder) < wanted:
            time.sleep(0.01)
        time.sleep(pause)
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        late += process.wait() != -signal.SIGKILL
        done.append(cells(folder))
    finish(start(folder, how), folder)
    found = written(folder)
    differ = sorted(name for name in whole.keys() | found.keys() if whole.get(name) != found.get(name))
    verdict = "identical" if not differ else f"DIFFER: {', '.join(differ[:5])}"
    label = " ".join(how) if how[0] == "--jobs" else "--dask"
    print(f"{label}: killed {kills} times ({late} too late) at {done} cells; {len(found)} files {verdict}", flush=True)
    return int(bool(differ or late))


def start(folder: Path, how: tuple[str, str]) -> "subprocess.Popen[bytes]":
    """The sweep, in a process group of its own."""
    pipeline = str(ROOT / "pipelines" / "trace_then_slam.toml")
    command = [sys.executable, "-m", "rislam_rt", "sweep", pipeline, *SWEEP, *how, "--out", str(folder)]
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, cwd=ROOT, stdout=quiet, stderr=quiet, start_new_session=True)


def finish(process: "subprocess.Popen[bytes]", folder: Path) -> tuple[float, float]:
    """Wait for the end; seconds until the first cell was there, and in all."""
    begin, first = time.monotonic(), 0.0
    while process.poll() is None:
        if not first and cells(folder):
            first = time.monotonic() - begin
        time.sleep(0.02)
    if process.returncode:
        sys.exit(f"the sweep ended with exit code {process.returncode}")
    return first, time.monotonic() - begin


def cells(folder: Path) -> int:
    """How many cells are there."""
    return len(list((folder / "cells").glob("*.json")))


def written(folder: Path) -> dict[str, bytes]:
    """All files that must be the same."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file() and path.name != "timings.jsonl")
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


@contextmanager
def cluster() -> Iterator[str]:
    """Address of two Dask workers of one thread each, on the loopback device."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0", silence_logs=99
    ) as it:
        yield str(it.scheduler_address)


if __name__ == "__main__":
    sys.exit(main())
