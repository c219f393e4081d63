"""What do scattered and diffracted paths do to the agent's error?

    python benchmarks/channel/extra_paths.py [--seeds 10] [--cycles 300] [--rooms paper_room ...]

`trace_then_slam`, scheme `optimized`, default filter, for each room and level the same motion and paths (seed 7) under
`--seeds` draws of start, noise and codes. `smooth`: walls that scatter nothing. `rough`: walls that scatter, and what
they scatter unheard: what weaker reflections alone do. `heard`: with `extras.diffuse`. `told`: the same, the filter
told as many false components a cycle as there are (`told.clutter_scale`), their mean over the run of `heard`. `edges`:
`extras.diffraction` on smooth walls. RMSE over all cycles, median over seeds with its 95 % interval (bootstrap of the
median), and the components a cycle that no path with an identity made.
"""

import argparse
from typing import Any

import numpy as np

from rislam_rt import load_scene
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.run import prepare_setup, run_scheme
from rislam_rt.pipeline.seeds import spawn_seeds

FALSE_ALARMS = 0.5
"""Components a cycle that the filter expects by default."""
ROOMS = ("paper_room", "l_room", "office", "itu_room")
ROUGH = (0.1, 0.3)


def nothing(stage: str, at: int, total: int) -> None:
    """No progress is shown."""


def lead(room: str, settings: list[str], seeds: int, cycles: int) -> tuple[np.ndarray, float]:
    """RMSE (seeds,) [m] of runs on one stage, and false components a cycle in the mean."""
    spec = load_spec(
        "pipelines/trace_then_slam.toml",
        [
            "receiver.estimator=bound", "receiver.alternation=false", f"cycles={cycles}", "schemes=['optimized']",
            *settings,
        ],
    )  # fmt: skip
    stage = prepare_setup(load_scene(room), spec, rng=np.random.default_rng(7))
    errors, false = [], []
    for seed in range(seeds):
        drawn = stage._replace(seeds=spawn_seeds(rng=np.random.default_rng(1000 + seed)))
        result: Any = run_scheme("optimized", drawn, spec, nothing)
        off = np.linalg.norm(result.position - stage.scene.agent.position, axis=1)
        errors.append(float(np.sqrt(np.mean(off**2))))
        false.append(float((result.component_path == -1).sum(axis=1).mean()))
    return np.array(errors), float(np.mean(false))


def row(room: str, level: str, what: str, found: tuple[np.ndarray, float]) -> str:
    """A line of the table."""
    errors, false = found
    rng = np.random.default_rng(0)
    medians = np.median(errors[rng.integers(len(errors), size=(2000, len(errors)))], axis=1)
    low, high = np.percentile(medians, [2.5, 97.5])
    lost = int((errors > 0.5).sum())
    return f"| {room} | {level} | {what} | {np.median(errors):.3f} | {low:.3f} to {high:.3f} | {lost} | {false:.1f} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--cycles", type=int, default=300)
    parser.add_argument("--rooms", nargs="+", default=ROOMS)
    options = parser.parse_args()
    print("| room | S | | RMSE [m] | 95 % | over 0.5 m | false components a cycle |\n" + "| --- " * 7 + "|")
    for room in options.rooms:
        print(row(room, "0", "smooth", lead(room, [], options.seeds, options.cycles)), flush=True)
        edges = lead(room, ["extras.diffraction=true"], options.seeds, options.cycles)
        print(row(room, "0", "edges", edges), flush=True)
        for level in ROUGH:
            rough = [f"room.scattering={level}"]
            print(row(room, str(level), "rough", lead(room, rough, options.seeds, options.cycles)), flush=True)
            heard = lead(room, [*rough, "extras.diffuse=true"], options.seeds, options.cycles)
            print(row(room, str(level), "heard", heard), flush=True)
            scale = f"told.clutter_scale={heard[1] / FALSE_ALARMS:.1f}"
            told = lead(room, [*rough, "extras.diffuse=true", scale], options.seeds, options.cycles)
            print(row(room, str(level), "told", told), flush=True)


if __name__ == "__main__":
    main()
