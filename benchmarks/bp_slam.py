"""How accurate, and how fast, is BP-SLAM in its published setting?

A room of 10 m by 7 m, two anchors in it, and for each the mirror images in three or four of its walls. The agent walks
a closed curve in 900 steps of 1 s; ranges have 0.1 m of noise, every anchor or image shows with probability 0.95, and
every scan holds one false range on average. Both anchors are known, and so is the start, to 0.1 m and 0.01 m/s on each
axis. Times are of the processor, not of the wall clock. With `--published` agent and features are independent beliefs,
as in the publication. Run: `python benchmarks/bp_slam.py [--seeds 10] [--first 0] [--particles 1024] [--published]`.

With `--moving bp_slam` (or `channel_slam`) both ends move: the paper's room, image sources, random codes, 13 dB, motion
and start drawn for every seed, beside dead reckoning and the posterior bound. Run:
`python benchmarks/bp_slam.py --moving bp_slam [--seeds 5] [--cycles 600] [--set bp_slam.wanderers=0.9 ...]`.
"""

import argparse
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.evaluate import normalised_squares
from rislam_rt.pipeline import load_spec
from rislam_rt.pipeline.run import run_slam
from rislam_rt.pipeline.scores.bound import scheme_bound
from rislam_rt.scene import load_scene
from rislam_rt.slam.schemes.bp_slam_static import BpSlamStaticConfig, run_static

ANCHORS = np.array([[1.5, 6.0], [8.5, 0.8]])
START_STD = np.array([0.1, 0.1, 0.01, 0.01])
ROOT = Path(__file__).parents[1]
ROOM = ("channel=image_source", "motion.sigma_a_m_s2=0.01")
DIVERGED = 1.0
"""A run whose error was ever above this counts as diverged [m]."""


class Scenario(NamedTuple):
    """Truth and data."""

    position: Floats
    """(K, 2) [m]."""
    velocity: Floats
    """(K, 2) [m/s]."""
    images: list[Floats]
    """Per anchor (V, 2) [m]: its mirror images."""
    ranges: list[list[Floats]]
    """Per step and anchor: ranges [m]."""


def build_scenario(steps: int, config: BpSlamStaticConfig, *, rng: np.random.Generator) -> Scenario:
    """A walk, and what it measures: order of the ranges, misses and false ranges are random."""
    turn = np.linspace(0.0, 2.0 * np.pi, 900)[:steps]
    position = np.stack([5.0 + 2.8 * np.cos(turn), 3.4 + 1.6 * np.sin(2.0 * turn)], axis=1)
    velocity = np.gradient(position, axis=0) if steps > 1 else np.zeros((1, 2))
    images = [_images(ANCHORS[0], 4), _images(ANCHORS[1], 3)]
    ranges = [[_scan(point, ANCHORS[a], images[a], config, rng=rng) for a in range(2)] for point in position]
    return Scenario(position, velocity, images, ranges)


def _images(anchor: Floats, count: int) -> Floats:
    x, y = anchor
    return np.array([[-x, y], [20.0 - x, y], [x, -y], [x, 14.0 - y]])[:count]


def _scan(
    agent: Floats, anchor: Floats, images: Floats, config: BpSlamStaticConfig, *, rng: np.random.Generator
) -> Floats:
    points = np.concatenate([anchor[None], images])
    lengths = np.linalg.norm(points - agent, axis=1) + config.range_std * rng.standard_normal(len(points))
    seen = lengths[rng.random(len(points)) < config.detection_probability]
    false = config.max_range * rng.random(rng.poisson(config.clutter_mean))
    return rng.permutation(np.concatenate([seen, false]))


def main() -> None:
    """Print one row a seed and a summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--published", action="store_true")
    parser.add_argument("--steps", type=int, default=900)
    parser.add_argument("--particles", type=int, default=BpSlamStaticConfig().num_particles)
    parser.add_argument("--moving", choices=("bp_slam", "channel_slam"))
    parser.add_argument("--cycles", type=int, default=600)
    parser.add_argument("--set", action="append", default=[], dest="settings")
    arguments = parser.parse_args()
    seeds = range(arguments.first, arguments.first + arguments.seeds)
    if arguments.moving:
        print_moving(seeds, arguments.moving, (*ROOM, f"cycles={arguments.cycles}", *arguments.settings))
        return
    config = BpSlamStaticConfig(num_particles=arguments.particles, coupled=not arguments.published)
    rows = []
    print(
        "| seed | agent RMSE [m] | largest error [m] | features | images within 0.5 m | RMSE of those [m] | ms a step |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for seed in seeds:
        rows.append(run_seed(seed, arguments.steps, config))
        rmse, largest, count, found, spread, ms = rows[-1]
        print(
            f"| {seed} | {rmse:.4f} | {largest:.3f} | {count:.0f} | {found:.0f} of 7 | {spread:.3f} | {ms:.1f} |",
            flush=True,
        )
    total = np.array(rows)
    errors, mean_ms = total[:, 0], total[:, 5].mean()
    print(f"\n{config.num_particles} particles, {len(rows)} seeds, {int((total[:, 1] > DIVERGED).sum())} diverged")
    print(f"agent RMSE over all {np.sqrt(np.mean(errors**2)):.4f} m, worst seed {errors.max():.4f} m")
    print(f"{mean_ms:.1f} ms of processor time a step, {1e-3 * mean_ms * arguments.steps:.1f} s a run")


def run_seed(seed: int, steps: int, config: BpSlamStaticConfig) -> tuple[float, float, float, float, float, float]:
    """RMSE and largest error of the agent, features at the end, images found and their error, time of a step."""
    data, filter_rng = np.random.default_rng([seed, 1]), np.random.default_rng([seed, 2])
    truth = build_scenario(steps, config, rng=data)
    start = np.concatenate([truth.position[0], truth.velocity[0]]) + START_STD * data.standard_normal(4)
    began = time.process_time()
    result = run_static(ANCHORS, truth.ranges, start, START_STD, config, rng=filter_rng)
    seconds = time.process_time() - began
    error = np.linalg.norm(result.position - truth.position, axis=1)
    last = result.features.at(steps - 1)
    near = []
    for anchor, images in enumerate(truth.images):
        found = last.position[last.anchor == anchor]
        near += [np.linalg.norm(found - image, axis=1).min(initial=np.inf) for image in images]
    hit = np.array([distance for distance in near if distance < 0.5])
    spread = float(np.sqrt(np.mean(hit**2))) if len(hit) else np.nan
    rmse = float(np.sqrt(np.mean(error**2)))
    return rmse, float(error.max()), len(last.ident), len(hit), spread, 1e3 * seconds / steps


def print_moving(seeds: Sequence[int], scheme: str, settings: Sequence[str]) -> None:
    """One row a seed, and root mean squares over all."""
    print("| seed | RMSE [m] | dead reckoning [m] | bound [m] | largest error [m] | NEES / 2 | processor time [s] |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    rows = []
    for seed in seeds:
        rows.append(run_moving(seed, scheme, settings))
        print(f"| {seed} | " + " | ".join(f"{value:.3g}" for value in rows[-1]) + " |", flush=True)
    total = np.array(rows)
    rms = np.sqrt(np.mean(total[:, :3] ** 2, axis=0))
    rest = (*rms, total[:, 3].max(), *total[:, 4:].mean(axis=0))
    print("| all | " + " | ".join(f"{value:.3g}" for value in rest) + " |")


def run_moving(seed: int, scheme: str, settings: Sequence[str]) -> tuple[float, ...]:
    """RMSE, that of dead reckoning, the bound's, largest error [m], mean NEES / 2, processor time with the room [s]."""
    spec = load_spec(
        ROOT / "pipelines" / "trace_then_slam.toml", ("receiver.estimator=bound", *settings, f'schemes=["{scheme}"]')
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
