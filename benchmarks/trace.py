"""How fast is the traced channel against Sionna RT's own solvers, and how does it grow?

    python benchmarks/trace.py            ratios, growth figure (docs/figures/trace_growth.png), memory; 2 minutes
    python benchmarks/trace.py --quick    ratios alone

The paper's room, 600 cycles, all path classes, two bounces. Against (a) one solve a position: `PathSolver` for LOS and
wall returns and `RCSSolver` for scatterer and panel, measured on some positions and scaled; (b) the same solvers over
batches of 16 positions, all pairs; (c) the image-source channel. Seconds are CPU seconds of the whole process, so that
a busy machine does not matter much; the tracer runs on one thread, as the package sets it.
"""

import argparse
import gc
import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

import rislam_rt
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.traced import TracedChannel
from rislam_rt.model import Material, RadioConfig, Reflector, Scatterer, Scene, Trajectory

RADIO = RadioConfig()
DEPTH = 2
SAMPLES = 200
"""Rays a source for Sionna's candidate search: a room of six walls needs a few hundred."""

BUFFER = 10_000
BATCH = 16
BELOW_CEILING = 0.02
"""[m] Sionna's solvers lose a source that lies in a face: the panel hangs this much lower for them."""


def cpu_seconds(work: Callable[[], Any], repeats: int = 1) -> float:
    """Smallest CPU time of some runs, after one that warms up."""
    work()
    times = []
    for _ in range(repeats):
        gc.collect()
        start = process_time()
        work()
        times.append(process_time() - start)
    return min(times)


@contextmanager
def sionna_scene(channel: TracedChannel, scene: Scene) -> Iterator[Any]:
    """The channel's own meshes with the landmarks as sensing targets, for Sionna's solvers."""
    import sionna.rt as rt
    from sionna.rt.rcs import ConstantRCSSensingTarget

    stage, size = channel.tracer_scene.scene, {"length": 1e-3, "width": 1e-3, "height": 1e-3}
    stage.tx_array = stage.rx_array = rt.PlanarArray(num_rows=1, num_cols=1, pattern="iso", polarization="V")
    points = scene.landmark_positions - channel.tracer_scene.origin
    points[-1, 2] -= BELOW_CEILING
    for name, point in zip(scene.landmarks, points, strict=True):
        stage.add(ConstantRCSSensingTarget(name, 0.01, **size, position=point.tolist()))
    try:
        yield stage
    finally:
        stage.remove(list(scene.landmarks))


def solve_batch(stage: Any, origin: np.ndarray, trajectory: Trajectory) -> int:
    """All classes of all pairs of a few positions with Sionna's solvers; returns the number of paths."""
    import sionna.rt as rt
    from sionna.rt.rcs import RCSSolver

    names = []
    for kind, points in ((rt.Transmitter, trajectory.tx), (rt.Receiver, trajectory.rx)):
        for number, point in enumerate(points - origin):
            names.append(f"{kind.__name__}-{number}")
            stage.add(kind(names[-1], point.tolist()))
    direct = rt.PathSolver(deterministic=True)(
        stage, max_depth=DEPTH, samples_per_src=SAMPLES, max_num_paths_per_src=BUFFER
    )
    joined = RCSSolver(deterministic=True)(
        stage, max_depth=DEPTH + 1, samples_per_sp=SAMPLES, buffer_size_per_sp=BUFFER, seed=1
    )
    count = sum(int((np.array(paths.tau) > 0.0).sum()) for paths in (direct, joined))
    stage.remove(names)
    return count


def print_ratios(scene: Scene, positions: int) -> None:
    """The table of question (a), (b), (c)."""
    channel, trajectory = TracedChannel(scene, RADIO, DEPTH), scene.agent
    cycles = len(trajectory)
    some = np.linspace(0, cycles - 1, positions).astype(int)
    paths = channel.paths(trajectory)
    ours = cpu_seconds(lambda: channel.paths(trajectory), 5)
    single = [trajectory[int(k) : int(k) + 1] for k in some]
    with sionna_scene(channel, scene) as stage:
        origin = channel.tracer_scene.origin
        counts = [solve_batch(stage, origin, one) for one in single]
        alone = cpu_seconds(lambda: [solve_batch(stage, origin, one) for one in single]) * cycles / positions
        pairs = trajectory[:BATCH]
        batch = cpu_seconds(lambda: solve_batch(stage, origin, pairs)) * cycles / BATCH
    images = ImageSourceChannel(scene, RADIO, DEPTH)
    analytic = cpu_seconds(lambda: images.paths(trajectory), 5)
    print(f"{cycles} cycles, depth {DEPTH}, {int(paths.valid.sum())} paths; CPU seconds")
    print(f"  traced channel                        {ours:7.2f}")
    for label, seconds in (
        (f"(a) a solve a position ({positions} measured)", alone),
        (f"(b) batches of {BATCH}, all pairs (1 measured)", batch),
        ("(c) image-source channel", analytic),
    ):
        print(f"  {label:<37} {seconds:7.2f}   {seconds / ours:6.1f} x")
    mine = paths.valid[some].sum(axis=1)
    print(f"  paths a position: traced channel {mine.min()} to {mine.max()}, (a) {min(counts)} to {max(counts)}:")
    print(f"  (a) has the panel {BELOW_CEILING} m below the ceiling, and so bounces on the ceiling next to it as well")


def subdivided(reflector: Reflector, times: int) -> Reflector:
    """Every triangle cut into four, some times over."""
    triangles = reflector.triangles
    for _ in range(times):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
        corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        triangles = np.concatenate([np.stack(corner, axis=1) for corner in corners])
    return replace(reflector, vertices=triangles.reshape(-1, 3), faces=np.arange(3 * len(triangles)).reshape(-1, 3))


def growth(scene: Scene) -> dict[str, tuple[list[int], list[float]]]:
    """CPU seconds against cycles, landmarks, triangles and walls, everything else as it is (200 cycles)."""
    result = {}
    counts = [10, 30, 100, 300, 1000, 3000]
    channel, agent = TracedChannel(scene, RADIO, DEPTH), scene.agent
    repeated = [longer(agent, count) for count in counts]
    result["cycles"] = counts, [cpu_seconds(lambda t=t: channel.paths(t), 2) for t in repeated]
    rng, short = np.random.default_rng(1), agent[:200]
    counts, seconds = [1, 2, 4, 8, 16], []
    for count in counts:
        places = rng.uniform([0.5, 0.5, 0.5], [5.5, 5.5, 2.5], size=(count, 3))
        spheres = tuple(Scatterer(f"s{i}", place, 0.01) for i, place in enumerate(places))
        crowded = TracedChannel(replace(scene, scatterers=spheres, ris=None), RADIO, DEPTH)
        seconds.append(cpu_seconds(lambda c=crowded: c.paths(short), 2))
    result["landmarks"] = counts, seconds
    counts, seconds = [], []
    for times in range(6):
        walls = tuple(subdivided(reflector, times) for reflector in scene.reflectors)
        counts.append(sum(len(reflector.faces) for reflector in walls))
        fine = TracedChannel(replace(scene, reflectors=walls), RADIO, DEPTH)
        seconds.append(cpu_seconds(lambda c=fine: c.paths(short), 4))
    result["triangles"] = counts, seconds
    counts, seconds = [], []
    for boards in (0, 8, 24, 56, 120):
        walls = (*scene.reflectors, *(board(i, rng) for i in range(boards)))
        counts.append(len(walls))
        furnished = TracedChannel(replace(scene, reflectors=walls), RADIO, DEPTH)
        seconds.append(cpu_seconds(lambda c=furnished: c.paths(short), 4))
    result["walls"] = counts, seconds
    return result


def board(number: int, rng: np.random.Generator) -> Reflector:
    """A square board of 0.4 m, anywhere in the upper half of the room, turned at random."""
    across = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2] * 0.2
    middle = rng.uniform([0.5, 0.5, 1.8], [5.5, 5.5, 2.7])
    corners = middle + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) @ across
    return Reflector(f"board{number}", corners, [[0, 1, 2], [0, 2, 3]], Material(reflection=0.5))


def longer(agent: Trajectory, cycles: int) -> Trajectory:
    """The room's trajectory, run through again and again."""
    index = np.arange(cycles) % len(agent)
    return replace(
        agent,
        time=np.arange(cycles) * (agent.time[1] - agent.time[0]),
        position=agent.position[index],
        velocity=agent.velocity[index],
        heading=agent.heading[index],
    )


def draw_growth(measured: dict[str, tuple[list[int], list[float]]], file: Path) -> None:
    """One panel a quantity, with a line of slope one to compare with."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 4, figsize=(12.5, 3.4), sharey=True, layout="constrained")
    fixed = {
        "cycles": "2 landmarks, 12 triangles",
        "landmarks": "200 cycles",
        "triangles": "200 cycles, 6 walls",
        "walls": "200 cycles, two bounces",
    }
    for axis, (name, (counts, seconds)) in zip(axes, measured.items(), strict=True):
        axis.loglog(counts, seconds, "o-", color="#1f5fa8", label="traced channel")
        slope = [seconds[-1] * count / counts[-1] for count in counts]
        axis.loglog(counts, slope, "--", color="0.6", label="proportional")
        axis.set_xlabel(name)
        axis.set_title(fixed[name], fontsize="medium")
        axis.grid(True, which="both", alpha=0.25)
    axes[0].set_ylabel("CPU time [s]")
    axes[0].set_ylim(min(min(s) for _, s in measured.values()) / 3.0, None)
    axes[0].legend(frameon=False)
    file.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(file, dpi=150)
    plt.close(figure)


def print_memory(scene: Scene) -> None:
    """Resident memory over ten runs through the trajectory, 6000 cycles, results dropped as they come."""
    channel = TracedChannel(scene, RADIO, DEPTH)
    sizes = []
    for _ in range(10):
        channel.paths(scene.agent)
        gc.collect()
        sizes.append(resident_megabytes())
    print(
        f"resident after {len(scene.agent)} cycles {sizes[0]:.0f} MB, after {10 * len(scene.agent)} {sizes[-1]:.0f} MB"
    )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(f"grown by {sizes[-1] - sizes[0]:.0f} MB, peak {peak:.0f} MB")


def resident_megabytes() -> float:
    """Resident size of this process now (Linux)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 2.0**20


def main() -> None:
    """Answer on the terminal."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="ratios alone")
    parser.add_argument("--positions", type=int, default=20, help="positions measured for (a)")
    parser.add_argument("--figure", type=Path, default=Path("docs/figures/trace_growth.png"))
    options = parser.parse_args()
    scene = rislam_rt.load_scene("scenes/paper_room")
    print_ratios(scene, options.positions)
    if options.quick:
        return
    print_memory(scene)
    measured = growth(scene)
    for name, (counts, seconds) in measured.items():
        print(f"{name:>10}: " + ", ".join(f"{c}: {s:.3f} s" for c, s in zip(counts, seconds, strict=True)))
    draw_growth(measured, options.figure)


if __name__ == "__main__":
    main()
