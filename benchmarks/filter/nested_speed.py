"""How fast is the nested filter, what does it need, and how does it grow?

Three questions: particle updates a second against plain numpy (in blocks that fit the cache) and against the machine's
copy bandwidth; time and memory in a run at the paper's scale (2000 agent particles, 6000 of each landmark for each of
them), from a stated number of measured cycles; and the time of a cycle against each of the three numbers, as a figure.
Times are of the processor, over all threads, so that other programs on the machine count little; with `t` threads and
an idle machine the clock shows about one t-th.
Run: `RISLAM_RT_THREADS=2 python benchmarks/filter/nested_speed.py`.
"""

import argparse
import resource
import time
from collections.abc import Callable
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import Body
from rislam_rt.slam import NestedConfig
from rislam_rt.slam.nested.particles import particle_belief
from rislam_rt.slam.nested.particles.engine_choice import pick_engine
from rislam_rt.slam.nested.particles.landmark_cloud import CloudEngine, Kernel, kernel_width
from rislam_rt.slam.nested.particles.sightline import Sighting, linear_sightline, pack, trace_sightline
from rislam_rt.slam.nested.particles.weights import Seen, update
from rislam_rt.slam.predicted_returns import NONE, Returns, observe, poses_of
from rislam_rt.tracer_backend import prepare_backend

BODY = Body(np.array([-0.04388, -0.02397, 0.0]), np.array([0.04388, 0.02397, 0.0]))
START, VELOCITY, HEADING, CYCLE, SIGMA_A = np.array([0.5, 0.7, 0.5]), np.array([0.07, 0.07, 0.0]), 0.3, 0.1, 0.01
STD = np.array([0.01, 0.01, 0.01])
BYTES = 16
"""Memory that an update must touch: a point (8) and its weight read, the weight written."""
TRAIL = 40
"""Poses of the trail."""
CYCLES = 600
"""Of a run at the paper's scale."""
ROUNDS = 7
"""In which engines are compared."""
HOME = Path(__file__).parents[2]
FIGURE = HOME / "docs" / "figures" / "filter_growth.png"
COLOURS = ("#0072B2", "#D55E00", "#009E73")


def seconds(task: Callable[[], object], repeat: int = 5) -> Floats:
    """Least processor and clock seconds (2,) of several goes."""
    spent = []
    for _ in range(repeat):
        cpu, clock = time.process_time(), time.perf_counter()
        task()
        spent.append((time.process_time() - cpu, time.perf_counter() - clock))
    return np.array(spent).min(axis=0)


def copy_seconds(size: int) -> float:
    """Processor seconds to move as many bytes as one pass over `size` particles must, half read and half written."""
    source = np.ones(size * BYTES // 8, dtype=np.float32)
    target = np.ones_like(source)
    return float(seconds(lambda: np.copyto(target, source))[0])


def compare_engines(agents: int, points: int) -> None:
    """One landmark, one direct return: update and resampling by numpy and by Dr.Jit, in turns.

    The clock of a shared machine changes from minute to minute: what runs next to each other is compared.
    """
    names, rng = ("numpy", "drjit"), np.random.default_rng(1)
    tasks = [task for name in names for task in _passes(pick_engine(name), agents, points, rng=rng)]
    for task in tasks:
        task()
    spent = np.array([[seconds(task, 1 + 2 * (k > 1)) for k, task in enumerate(tasks)] for _ in range(ROUNDS)])
    best, floor, count = spent.min(axis=0), copy_seconds(agents * points), agents * points
    threads = prepare_backend().threads
    print(
        f"\n{agents} agent particles, {points} landmark particles each, {threads} threads of Dr.Jit, best of {ROUNDS}"
    )
    print("| engine | update [s] | M updates/s | share of copy bandwidth | resampling [s] | update, clock [s] |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name, ((cpu, clock), (again, _)) in zip(names, best.reshape(2, 2, 2), strict=True):
        print(f"| {name} | {cpu:.3f} | {count / cpu / 1e6:.0f} | {floor / cpu:.2f} | {again:.3f} | {clock:.3f} |")
    for unit, ratio in zip(("processor time", "clock"), np.moveaxis(spent[:, :2] / spent[:, 2:], 2, 0), strict=True):
        low, middle, high = np.quantile(ratio, [0.0, 0.5, 1.0], axis=0)
        print(f"numpy over Dr.Jit, {unit}, median (least, most) of {ROUNDS} rounds: ", end="")
        print(f"update {middle[0]:.1f} ({low[0]:.1f}, {high[0]:.1f}), ", end="")
        print(f"resampling {middle[1]:.1f} ({low[1]:.1f}, {high[1]:.1f})")
    print(f"copying the same bytes takes {floor:.3f} s")


def _passes(
    engine: CloudEngine, agents: int, points: int, *, rng: np.random.Generator
) -> tuple[Callable[[], object], Callable[[], object]]:
    """An update, and a resampling, of clouds that are every agent particle's own."""
    position = START + 0.02 * rng.standard_normal((agents, 3))
    poses, place = poses_of(position, np.full(agents, HEADING), BODY), np.array([2.0, 1.0, 1.0])
    features = np.broadcast_to(place, (agents, 1, 3))
    returns = Returns(np.array([[0, NONE, NONE]]), np.array([0]), np.array([0]))
    seen = observe(returns, place[None], np.zeros((1, 3)), poses_of(START, np.asarray(HEADING), BODY)).seen[0]
    line = trace_sightline(returns, 0, 0, features, np.zeros((1, 3)), poses)
    sighting = Sighting(line, seen, np.diag(STD**2))
    kinds, constants = (line.kind,), pack([sighting], agents)
    zero = np.zeros(agents, dtype=np.int64)
    cloud = engine.build(0.05 * rng.standard_normal((1, points, 3)), np.zeros((1, points)), zero, zero)
    cloud, sums = engine.weigh(cloud, (), np.zeros((0, agents)))
    kernel = Kernel(rng.random(agents), 7919 % points, points // 12 * 4, kernel_width(points, 3))
    cloud = engine.resample(cloud, sums.covariance, points, kernel)
    cloud, sums = engine.weigh(cloud, kinds, constants)
    return (
        lambda: engine.weigh(cloud, kinds, constants),
        lambda: engine.resample(cloud, sums.covariance, points, kernel),
    )


def walk(agents: int, points: int, landmarks: int, cycles: int) -> Floats:
    """Processor seconds of each cycle of a walk at fixed numbers of particles, all landmarks seen every cycle."""
    rng = np.random.default_rng(2)
    config = NestedConfig(num_agents=agents, num_points=points, adaptive=False, engine="drjit")
    engine, start = pick_engine("drjit"), np.concatenate([START, VELOCITY, [HEADING]])
    state = particle_belief.draw(start, 0.01 * np.array([1, 1, 0, 1, 1, 0, 0]), agents, rng=rng)
    places = rng.uniform([1.0, 1.0, 1.0], [5.0, 5.0, 3.0], (landmarks, 3))
    for row, place in enumerate(places):
        at = place + 0.03 * rng.standard_normal(3)
        state = particle_belief.place_landmark(
            state, np.tile(at, (agents, 1)), 0.03**2 * np.eye(3), config, engine, rng=rng
        )
        known = linear_sightline(state.centre[:, row] - at, np.zeros(3))
        state, _ = particle_belief.absorb(state, row, [Sighting(known, np.zeros(3), 0.03**2 * np.eye(3))], engine)
    rows, anchor = np.arange(landmarks), np.zeros((landmarks, 3))
    returns = Returns(np.column_stack([rows, np.full((landmarks, 2), NONE)]), rows, rows)
    spent, noise = [], np.tile(STD**2, (landmarks, 1))
    for cycle in range(1, cycles + 1):
        poses = poses_of(START + cycle * CYCLE * VELOCITY, np.asarray(HEADING), BODY)
        seen = observe(returns, places, anchor, poses).seen + STD * rng.standard_normal((landmarks, 3))
        began = time.process_time()
        state = particle_belief.propagate(state, CYCLE, SIGMA_A * np.array([1.0, 1.0, 0.0]), 0.0, rng=rng)
        state = particle_belief.remember(state, TRAIL)
        state = update(state, Seen(returns, anchor, BODY, seen, noise), config, engine).belief
        state, _ = particle_belief.renew(state, CYCLE * np.arange(len(state.trail))[::-1], config, engine, rng=rng)
        spent.append(time.process_time() - began)
    return np.array(spent)


def paper_run(landmarks: int, cycles: int) -> None:
    """Time and memory at the paper's scale."""
    clock = time.perf_counter()
    spent = walk(2000, 6000, landmarks, cycles)
    clock = time.perf_counter() - clock
    threads = prepare_backend().threads
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    late = spent[cycles // 2 :]
    whole = (float(spent.sum()) + max(CYCLES - cycles, 0) * float(late.mean())) / 60
    print(f"\n2000 x 6000 particles, {landmarks} landmarks seen every cycle, {cycles} cycles measured:")
    print(f"{spent.mean():.2f} s of CPU a cycle ({spent.min():.2f} to {spent.max():.2f}), {clock:.0f} s on the clock")
    print(f"the second half of them, when clouds are resampled less often: {late.mean():.2f} s of CPU a cycle")
    print(f"{CYCLES} cycles, the rest like that half: {whole:.1f} min of processor, ", end="")
    print(f"{whole / threads:.1f} min if {threads} threads had a core each")
    print(f"largest memory of the process: {peak:.1f} GiB")


def draw_growth(cycles: int) -> None:
    """Least time of a cycle (none of its clouds resampled) against agents, landmarks, and landmark particles."""
    base = {"agents": 500, "points": 1000, "landmarks": 4}
    sweeps = {
        "agents": (125, 250, 500, 1000, 2000),
        "points": (252, 500, 1000, 2000, 4000),
        "landmarks": (1, 2, 4, 8, 16),
    }
    names = {"agents": "agent particles", "points": "landmark particles", "landmarks": "landmarks"}
    figure, axes = plt.subplots(1, 3, figsize=(9.0, 3.2), sharey=True, layout="constrained")
    for axis, colour, (name, values) in zip(axes, COLOURS, sweeps.items(), strict=True):
        times = [1e3 * float(np.min(walk(**{**base, name: value}, cycles=cycles))) for value in values]
        print(f"{names[name]}: " + ", ".join(f"{v}: {t:.0f} ms" for v, t in zip(values, times, strict=True)))
        axis.loglog(values, times, "o-", color=colour)
        axis.loglog(values, [times[-1] * v / values[-1] for v in values], ":", color="0.5", label="proportional")
        axis.set_xlabel(names[name])
        axis.set_xticks(values, [str(v) for v in values], fontsize=8)
        axis.minorticks_off()
        axis.set_title(", ".join(f"{base[k]} {names[k]}" for k in base if k != name), fontsize=8)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("CPU time of a cycle\nwithout resampling [ms]")
    axes[0].legend(frameon=False, fontsize=8)
    figure.savefig(FIGURE, dpi=150)


def main() -> None:
    """Answer all three, or some."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--parts", nargs="+", default=["engines", "paper", "growth"])
    parser.add_argument("--cycles", type=int, default=20)
    parser.add_argument("--landmarks", type=int, default=10)
    arguments = parser.parse_args()
    if "engines" in arguments.parts:
        compare_engines(2000, 6000)
    if "paper" in arguments.parts:
        paper_run(arguments.landmarks, arguments.cycles)
    if "growth" in arguments.parts:
        draw_growth(arguments.cycles)


if __name__ == "__main__":
    main()
