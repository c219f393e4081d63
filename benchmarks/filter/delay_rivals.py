"""How accurate are the rivals of delays alone, and how consistent?

The paper's room, image sources, random codes, 13 dB, motion and start drawn for every seed, beside dead reckoning and
the posterior bound. Times are of the processor. Run:
`python benchmarks/filter/delay_rivals.py bp_slam|channel_slam [--seeds 10] [--cycles 600]
[--set bp_slam.wanderers=0.9 ...]`.
"""

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rislam_rt.evaluate import normalised_squares
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.run import run_slam
from rislam_rt.pipeline.scores.posterior_bound import scheme_bound
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
ROOM = ("channel=image_source", "motion.sigma_a_m_s2=0.01")


def main() -> None:
    """Print a row a seed, and one of all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scheme", choices=("bp_slam", "channel_slam"))
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--cycles", type=int, default=600)
    parser.add_argument("--set", action="append", default=[], dest="settings")
    arguments = parser.parse_args()
    seeds = range(arguments.first, arguments.first + arguments.seeds)
    print_runs(seeds, arguments.scheme, (*ROOM, f"cycles={arguments.cycles}", *arguments.settings))


def print_runs(seeds: Sequence[int], scheme: str, settings: Sequence[str]) -> None:
    """One row a seed, and root mean squares over all."""
    print("| seed | RMSE [m] | dead reckoning [m] | bound [m] | largest error [m] | NEES / 2 | processor time [s] |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    rows = []
    for seed in seeds:
        rows.append(run_seed(seed, scheme, settings))
        print(f"| {seed} | " + " | ".join(f"{value:.3g}" for value in rows[-1]) + " |", flush=True)
    total = np.array(rows)
    rms = np.sqrt(np.mean(total[:, :3] ** 2, axis=0))
    rest = (*rms, total[:, 3].max(), *total[:, 4:].mean(axis=0))
    print("| all | " + " | ".join(f"{value:.3g}" for value in rest) + " |")


def run_seed(seed: int, scheme: str, settings: Sequence[str]) -> tuple[float, ...]:
    """RMSE, that of dead reckoning, the bound's, largest error [m], mean NEES / 2, processor time with the room [s]."""
    spec = load_spec(
        ROOT / "pipelines" / "trace_then_slam.toml",
        ("receiver.estimator=bound", "receiver.alternation=false", *settings, f'schemes=["{scheme}"]'),
    )
    began = time.process_time()
    result = run_slam(load_scene(ROOT / "scenes" / "paper_room"), spec, rng=np.random.default_rng([20, seed]))
    seconds = time.process_time() - began
    truth, found = result.scene.agent, result.schemes[scheme]
    count = len(found.position)
    error = (found.position - truth.position[:count])[:, :2]
    # the first estimate is the start as it was told: ranges of one cycle tell nothing of it
    reckoned = found.position[0] + (truth.time[:count, None] - truth.time[0]) * found.velocity[0]
    blind = np.linalg.norm((reckoned - truth.position[:count])[:, :2], axis=1)
    bound = scheme_bound(result.scene, result.paths, found.gain, scheme, result.config).agent
    size = np.linalg.norm(error, axis=1)
    nees = float(np.mean(normalised_squares(error, found.covariance[:, :2, :2]))) / 2.0
    rmse = (float(np.sqrt(np.mean(each**2))) for each in (size, blind, bound))
    return *rmse, float(size.max()), nees, seconds


if __name__ == "__main__":
    main()
