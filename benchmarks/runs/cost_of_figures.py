"""What does a cell of Fig. 4(b) cost, stage by stage, and how long does the whole figure take?

One seed at every SNR (or of Fig. 4(c), at every size of the panel), as the study does it: traced once, all schemes
under the same noise. Prints processor seconds, so that other programs on the machine count little, and the minutes of
all cells on two idle cores.
Run:
`OPENBLAS_NUM_THREADS=1 RISLAM_RT_THREADS=1 python benchmarks/runs/cost_of_figures.py [fig4c] [--seed 7] [--at 0 30]`.
"""

import argparse
import time
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from rislam_rt.model import SlamResult
from rislam_rt.pipeline import cycle
from rislam_rt.pipeline.channels import prepare_channel
from rislam_rt.pipeline.cycle import Receptions
from rislam_rt.pipeline.run import prepare_setup, result_of, run_scheme
from rislam_rt.pipeline.scores.summary import summarise_scheme
from rislam_rt.progress import tell_nobody
from rislam_rt.scene import load_scene
from rislam_rt.studies.swept.cell import cell_spec

PIPELINES = Path(__file__).parents[2] / "pipelines"
CORES = 2
STAGES = ("trace", "receive", "design", "window filter", "rivals", "score")


def cell_seconds(settings: dict[str, Any], scene: Path, seed: int) -> dict[str, float]:
    """Processor seconds of each stage of one cell."""
    spec = cell_spec(settings)
    prepare_channel(spec.channel)
    room, spent, begin = load_scene(scene), dict.fromkeys(STAGES, 0.0), time.process_time()
    setup = prepare_setup(room, spec, rng=np.random.default_rng(seed))._replace(receptions=Receptions())
    spent["trace"] = time.process_time() - begin
    for name in spec.schemes:
        begin = time.process_time()
        scheme = run_scheme(name, setup, spec, tell_nobody)
        design, _, _, localise = scheme.seconds.sum(axis=0)
        filtered = "rivals" if name in ("bp_slam", "channel_slam") else "window filter"
        spent["design"] += design
        spent[filtered] += localise
        spent["receive"] += time.process_time() - begin - design - localise  # what was received before costs nothing
        begin = time.process_time()
        result: SlamResult = result_of(setup, spec, {name: scheme}, seed=seed)
        summarise_scheme(result, scheme)
        spent["score"] += time.process_time() - begin
    return spent


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("figure", nargs="?", choices=("fig4b", "fig4c"), default="fig4b")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--at", type=float, nargs="+", help="SNRs [dB], or panel sizes; all of the study by default")
    arguments = parser.parse_args()
    cycle.perf_counter = time.process_time
    study = tomllib.loads((PIPELINES / f"{arguments.figure}.toml").read_text())
    run = study["run"]
    points = arguments.at or study["snr_db" if arguments.figure == "fig4b" else "sizes"]
    variants = {case["name"]: case["set"] for case in study.get("cases", [])}
    print(f"{arguments.figure}, seed {arguments.seed}; processor seconds a cell")
    print("| at | " + " | ".join(STAGES) + " | whole |\n" + "| --- " * (len(STAGES) + 2) + "|")
    total = []
    for point in points:
        settings: dict[str, Any] = {"run": run, "variants": variants, "variant": next(iter(variants), "")}
        if arguments.figure == "fig4b":
            settings["run"] = {**run, "radio": {**run.get("radio", {}), "reference_snr_db": point}}
        else:
            settings["size"] = int(point)
        spent = cell_seconds(settings, PIPELINES / study["scene"], arguments.seed)
        total.append(sum(spent.values()))
        print(f"| {point:g} | " + " | ".join(f"{each:.1f}" for each in [*spent.values(), total[-1]]) + " |", flush=True)
    cells = study["repetitions"] * len(total)
    minutes = study["repetitions"] * sum(total) / CORES / 60
    print(f"{cells} cells on {CORES} cores: {minutes:.0f} min")


if __name__ == "__main__":
    main()
