"""Does the filter know how wrong it is? NEES of the pose over many runs, cycle by cycle, against chi-square.

Every run draws its own motion (white acceleration, the one that the filter reckons with), start, noise and codes. The
average over R runs of a consistent filter's NEES lies in a two-sided 95 % interval in 95 % of the cycles; cycles of one
run are not independent, so that the share that lies inside scatters about that more than their number suggests.
Finished runs are kept and not run again. Run:
`python benchmarks/filter/consistency.py [--runs 50] [--cycles 600] [--filter nested] [--jobs 2] [--set key=value ...]`.
"""

import argparse
import os
from collections.abc import Sequence
from multiprocessing import get_context
from pathlib import Path
from time import process_time

import numpy as np
import scipy

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import normalised_squares
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.run import run_slam
from rislam_rt.scene import load_scene

ROOT = Path(__file__).parents[2]
SETTINGS = ("channel=image_source", 'schemes=["random"]', "motion.sigma_a_m_s2=0.01")


def run(seed: int, scene: str, settings: Sequence[str]) -> tuple[int, Floats, Floats, float]:
    """NEES (K,) of the horizontal position, errors (K,) [m] and processor time [s] of one run."""
    spec = load_spec(
        ROOT / "pipelines" / "trace_then_slam.toml",
        ["receiver.estimator=bound", "receiver.alternation=false", *settings],
    )
    begin = process_time()
    result = run_slam(load_scene(ROOT / "scenes" / scene), spec, rng=np.random.default_rng([20, seed]))
    scheme = result.schemes[spec.schemes[0]]
    error = (scheme.position - result.scene.agent.position[: len(scheme.position)])[:, :2]
    nees = normalised_squares(error, scheme.covariance[:, :2, :2])
    return seed, nees, np.linalg.norm(error, axis=1), process_time() - begin


def interval(runs: int) -> tuple[float, float]:
    """Two-sided 95 % interval of the average NEES / 2 over runs (Bar-Shalom, Li and Kirubarajan, 5.4)."""
    lower, upper = scipy.stats.chi2.interval(0.95, 2 * runs)
    return float(lower) / (2 * runs), float(upper) / (2 * runs)


def draw(nees: Floats, name: str, file: Path) -> None:
    """Average NEES against time, with its interval."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    average, (lower, upper) = nees.mean(axis=0) / 2.0, interval(len(nees))
    time = 0.1 * np.arange(nees.shape[1])
    figure, axes = plt.subplots(figsize=(8.0, 3.6), layout="constrained")
    axes.axhspan(lower, upper, color="#0072b2", alpha=0.15, lw=0)
    note = "95 % interval of a consistent filter"
    axes.annotate(note, (0.5 * time[-1], lower), ha="center", va="top", color="#0072b2")
    axes.axhline(1.0, color="#0072b2", lw=0.8)
    axes.plot(time, average, color="#d55e00", label=f"average of {len(nees)} runs")
    axes.set(xlabel="time [s]", ylabel="NEES of the position / 2", ylim=(0.0, max(2.5, 1.1 * average.max())))
    axes.set_title(
        f"{name}: inside the interval in {np.mean((average >= lower) & (average <= upper)):.0%} of the cycles",
        loc="left",
    )
    axes.legend(frameon=False, loc="upper left")
    figure.savefig(file, dpi=130)


def main() -> None:
    """Run what is missing, print the score, draw it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--cycles", type=int, default=600)
    parser.add_argument("--filter", default="window")
    parser.add_argument("--scene", default="paper_room")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--set", action="append", default=[], dest="settings")
    parser.add_argument("--out", type=Path, default=Path("runs"))
    arguments = parser.parse_args()
    settings = (*SETTINGS, f"slam.filter={arguments.filter}", f"cycles={arguments.cycles}", *arguments.settings)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # for the workers, which are spawned
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("settings:", ", ".join(settings), flush=True)
    name = f"consistency_{arguments.filter}_{arguments.scene}_{arguments.cycles}"
    store = arguments.out / f"{name}.npz"
    key = "\n".join(settings)
    done: dict[str, Floats] = {}
    if store.is_file():
        with np.load(store) as kept:
            done = dict(kept) if str(kept["settings"]) == key else {}
    done.setdefault("settings", np.array(key))
    todo = [(s, arguments.scene, settings) for s in range(arguments.runs) if f"nees_{s}" not in done]
    with get_context("spawn").Pool(arguments.jobs) as pool:
        for seed, nees, error, seconds in pool.imap_unordered(_run, todo):
            done |= {f"nees_{seed}": nees, f"error_{seed}": error, f"seconds_{seed}": np.array(seconds)}
            partial = store.with_suffix(".part.npz")
            np.savez(partial, **done)
            partial.replace(store)
            print(
                f"run {seed}: RMSE {np.sqrt(np.mean(error**2)):.4f} m, NEES/2 {nees.mean() / 2:.2f}, {seconds:.0f} s",
                flush=True,
            )
    nees = np.array([done[f"nees_{s}"] for s in range(arguments.runs)])
    error = np.array([done[f"error_{s}"] for s in range(arguments.runs)])
    average, (lower, upper) = nees.mean(axis=0) / 2.0, interval(len(nees))
    inside = np.mean((average >= lower) & (average <= upper))
    print(
        f"{arguments.filter}, {arguments.scene}, {len(nees)} runs of {nees.shape[1]} cycles: average NEES/2 "
        f"{average.mean():.2f}, interval {lower:.2f} to {upper:.2f}, inside in {inside:.1%}; "
        f"RMSE {np.sqrt(np.mean(error**2)):.4f} m, largest error {error.max():.3f} m, "
        f"{np.mean([float(done[f'seconds_{s}']) for s in range(arguments.runs)]):.1f} s of processor time a run"
    )
    draw(nees, f"{arguments.filter}, {arguments.scene}", arguments.out / f"{name}.png")


def _run(job: tuple[int, str, Sequence[str]]) -> tuple[int, Floats, Floats, float]:
    return run(*job)


if __name__ == "__main__":
    main()
