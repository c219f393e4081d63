"""Does memory grow with the cycles of a run? One scheme along a trajectory file, slice by slice.

    python benchmarks/runs/long_run.py [--cycles 100000] [--set key=value ...]

Prints the largest resident size of the process in every slice, and that of all later slices against the first one's.
Exit code 1 if it grew by more than 5 %. The agent goes round the paper's room on a Lissajous figure at about 0.1 m/s.
"""

import argparse
import os
import shutil
import sys
import tempfile
from pathlib import Path
from time import process_time

import numpy as np

from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.long.run import run_long
from rislam_rt.pipeline.long.slices import SLICE
from rislam_rt.pipeline.store.identity import run_identity
from rislam_rt.pipeline.store.run_folder import open_run
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
GROWTH = 0.05
"""Largest relative growth after the first slice: below the noise of the allocator would be no bound."""


def write_room(folder: Path, cycles: int) -> Path:
    """The paper's room with a trajectory file of so many cycles."""
    room = folder / "room"
    shutil.copytree(ROOT / "scenes" / "paper_room", room)
    text = (room / "scene.toml").read_text()
    agent = text.index("[agent]")
    lines = [line for line in text[agent:].splitlines() if line.partition(" ")[0] in ("tx_offset_m", "rx_offset_m")]
    (room / "scene.toml").write_text(text[:agent] + "\n".join(["[agent]", 'trajectory = "path.tum"', *lines]) + "\n")
    time = 0.1 * np.arange(cycles)
    x, y = 3.0 + 2.0 * np.sin(0.047 * time), 3.0 + 1.9 * np.sin(0.031 * time + 0.4)
    turn = np.unwrap(np.arctan2(np.gradient(y, time), np.gradient(x, time)))
    rows = (f"{t:.1f} {a:.6f} {b:.6f} 0.5 0 0 {np.sin(h / 2):.9f} {np.cos(h / 2):.9f}" for t, a, b, h in
            zip(time, x, y, turn, strict=True))  # fmt: skip
    with (room / "path.tum").open("w") as file:
        file.writelines(f"{row}\n" for row in rows)
    return room


def resident() -> float:
    """Resident size of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> int:
    """Run, and print the sizes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cycles", type=int, default=100_000)
    parser.add_argument("--set", action="append", default=[], dest="settings")
    given = parser.parse_args()
    settings = [
        "receiver.estimator=bound", "receiver.alternation=false", "channel=image_source", 'schemes=["random"]',
        *given.settings,
    ]  # fmt: skip
    spec = load_spec(ROOT / "pipelines" / "trace_then_slam.toml", settings)
    peaks: dict[int, float] = {}

    def watch(stage: str, at: int, total: int) -> None:
        number = min(max(at - 1, 0), total - 1) // SLICE
        if at % 50 == 0:
            peaks[number] = max(peaks.get(number, 0.0), resident())
        if at and (at % SLICE == 0 or at == total):
            print(f"slice {number}: {peaks[number]:.1f} MB, {process_time():.0f} s of CPU", flush=True)

    with tempfile.TemporaryDirectory() as place:
        scene = load_scene(write_room(Path(place), given.cycles))
        with open_run(Path(place) / "run", run_identity(spec, scene)) as store:
            run = run_long(scene, spec, store, rng=np.random.default_rng(spec.seed), jobs=1, progress=watch)
        size = sum(file.stat().st_size for file in (Path(place) / "run").rglob("*") if file.is_file())
    after = resident()
    growth = max(list(peaks.values())[1:], default=peaks[0]) / peaks[0] - 1.0
    scores = run.summary["schemes"]["random"]
    print(f"{given.cycles} cycles in {len(peaks)} slices: first {peaks[0]:.1f} MB, growth {growth:+.1%} (limit 5 %)")
    print(f"{after:.1f} MB after the scores; {size / 1e6:.0f} MB on the disk; RMSE {scores['rmse_m']:.4f} m")
    return int(growth > GROWTH)


if __name__ == "__main__":
    sys.exit(main())
