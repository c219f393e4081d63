"""How far from the optimum are the designs, and what is the rest of the gap made of?

1. Over random places of the paper's room: CRLB-GA against the exact optimum of the direct path alone, and against the
   best known code for all paths.
2. Over random beliefs of the paper's room (its landmarks and their images in single walls, each with an error): every
   designer against the relaxation bound, the dual bound and the best of many restarts; the same with 64 levels, which
   takes the coarse phases out of the gap.
3. Panels of 3 x 3: against brute force.
4. Designs on a belief that is off by as much as it says, against the genie that knows agent and map.
Run: `python benchmarks/design/gap.py [--places 200] [--beliefs 200] [--figure FILE]`.
"""

import argparse
from dataclasses import replace
from itertools import product

import numpy as np
from convex_dual import dual_bound

from rislam_rt.arrays import Floats
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.channel.walls import build_walls
from rislam_rt.design import (
    DESIGNERS,
    DesignConfig,
    DesignProblem,
    build_objective,
    direct_only,
    problem_from_belief,
    problem_from_paths,
)
from rislam_rt.design.coordinate_descent import coordinate_descent
from rislam_rt.geometry.planes import mirror
from rislam_rt.model import MapEstimate, RadioConfig, RisSpec, Scene, SlamEstimate, Trajectory
from rislam_rt.scene import load_scene

RADIO = RadioConfig()
LOWEST, HIGHEST = [0.4, 0.4, 0.2], [5.6, 5.6, 1.4]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", type=int, default=200)
    parser.add_argument("--beliefs", type=int, default=200)
    parser.add_argument("--figure", default=None, help="write CRLB-GA's convergence to this PNG file")
    arguments = parser.parse_args()
    rng = np.random.default_rng(41)
    scene = load_scene("scenes/paper_room")
    genetic_against_optimum(scene, arguments.places, arguments.figure, rng=rng)
    beliefs_against_bounds(scene, arguments.beliefs, rng=rng)
    small_panels(scene, max(arguments.beliefs // 4, 1), rng=rng)
    belief_against_genie(scene, arguments.beliefs, rng=rng)


def genetic_against_optimum(scene: Scene, places: int, figure: str | None, *, rng: np.random.Generator) -> None:
    """CRLB-GA at default settings."""
    assert scene.ris is not None
    position, still = rng.uniform(LOWEST, HIGHEST, size=(places, 3)), np.zeros((places, 3))
    motion = Trajectory(np.arange(float(places)), position, still, rng.uniform(-3, 3, places), scene.agent.body)
    paths = ImageSourceChannel(scene, RADIO, 1).paths(motion)
    gaps, excess, history = [], [], []
    for k in range(places):
        problem = problem_from_paths(
            paths, motion.tx[k], motion.rx[k], RADIO, scene.ris.spec.levels, cycle=k, prior=np.eye(2) / 0.05**2
        )
        gaps.append(DESIGNERS["genetic"](direct_only(problem), rng=rng).gap_db)
        genetic, strong = (DESIGNERS[method](problem, rng=rng) for method in ("genetic", "coordinate"))
        best = min(genetic.crlb, strong.crlb)
        excess.append(genetic.crlb / best - 1.0)
        history.append(genetic.history / best - 1.0)
    print(f"CRLB-GA, {places} places, {problem.response.shape[1]} panel paths")
    print(f"  direct path alone: gap to the exact optimum, dB: {quantiles(gaps)}")
    print(f"  all paths: CRLB above the best known, %: {quantiles(100.0 * np.array(excess))}")
    if figure is not None:
        draw_convergence(np.array(history), figure)


def beliefs_against_bounds(scene: Scene, count: int, *, rng: np.random.Generator) -> None:
    """All designers on beliefs, at 4 and at 64 levels."""
    assert scene.ris is not None
    spec = scene.ris.spec
    table: dict[str, list[Floats]] = {}
    for _ in range(count):
        belief = random_belief(scene, rng=rng)
        coarse, fine = (belief_problem(belief, replace(spec, levels=levels)) for levels in (spec.levels, 64))
        crlb = {m: DESIGNERS[m](coarse, rng=rng) for m in ("genetic", "exact", "coordinate", "random")}
        best, restarts = best_known(coarse, rng=rng)
        finest, _ = best_known(fine, rng=rng, restarts=5)
        smooth = DESIGNERS["coordinate"](fine, rng=rng)
        relaxed = crlb["exact"].bound
        dual, dual_fine = dual_bound(coarse, best), dual_bound(fine, finest)
        for method, design in crlb.items():
            table.setdefault(f"{method} above relaxation bound", []).append(design.crlb / relaxed - 1)
            table.setdefault(f"{method} above best known", []).append(design.crlb / restarts - 1)
        fine_value = float(build_objective(fine).of_index(finest))
        table.setdefault("best known above relaxation bound", []).append(restarts / relaxed - 1)
        table.setdefault("best known above dual bound", []).append(restarts / dual - 1)
        table.setdefault("best known, 4 levels above 64 levels", []).append(restarts / fine_value - 1)
        table.setdefault("64 levels: coordinate above relaxation bound", []).append(smooth.gap_crlb)
        table.setdefault("64 levels: best known above dual bound", []).append(fine_value / dual_fine - 1)
        alone = DESIGNERS["exact"](without_images(coarse), rng=rng)
        table.setdefault("direct path alone: exact above relaxation bound", []).append(alone.gap_crlb)
    print(f"beliefs of the paper's room, {count}, {coarse.response.shape[1]} panel paths; excess in %")
    for name, values in table.items():
        print(f"  {name:50s} {quantiles(100.0 * np.array(values))}")


def small_panels(scene: Scene, count: int, *, rng: np.random.Generator) -> None:
    """3 x 3 panels, 4 levels: all 4^8 codes that differ by more than a common turn."""
    assert scene.ris is not None
    spec = replace(scene.ris.spec, rows=3, cols=3)
    every = np.array(list(product(range(4), repeat=8)))
    every = np.concatenate([np.zeros((len(every), 1), dtype=np.int64), every], axis=1)
    excess, gap, dual = [], [], []
    for _ in range(count):
        problem = belief_problem(random_belief(scene, rng=rng), spec)
        objective = build_objective(problem)
        values = np.concatenate([objective.of_index(block) for block in np.array_split(every, 8)])
        least = float(values.min())
        design = DESIGNERS["coordinate"](problem, rng=rng)
        excess.append(design.crlb / least - 1)
        gap.append(least / design.bound - 1)
        dual.append(least / dual_bound(problem, every[np.argmin(values)]) - 1)
    print(f"3 x 3 panels, {count} beliefs; excess in %")
    print(f"  coordinate above the true optimum                  {quantiles(100.0 * np.array(excess))}")
    print(f"  true optimum above relaxation bound                {quantiles(100.0 * np.array(gap))}")
    print(f"  true optimum above dual bound                      {quantiles(100.0 * np.array(dual))}")


def belief_against_genie(scene: Scene, count: int, *, rng: np.random.Generator) -> None:
    """Loss in the true CRLB when pose and map are known to a standard deviation, averaged over 1, 4 or 16 samples."""
    assert scene.ris is not None
    spec = scene.ris.spec
    print(f"designs on beliefs against the genie, {count} places; loss in CRLB, %")
    for std in (0.02, 0.1, 0.3, 1.0):
        loss: dict[int, list[float]] = {1: [], 4: [], 16: []}
        for _ in range(count):
            truth = random_belief(scene, rng=rng, std=0.0)
            belief = disturbed(truth, std, rng=rng)
            real = replace(belief_problem(truth, spec), prior=np.linalg.inv(belief.covariance[:2, :2]))
            genie = DESIGNERS["coordinate"](real, rng=rng)
            for samples, losses in loss.items():
                problem = problem_from_belief(belief, spec, RADIO, samples=samples)
                assert problem is not None
                code = DESIGNERS["coordinate"](problem, rng=rng, config=DesignConfig(certify=False)).code
                losses.append(float(build_objective(real).of_index(code.index.ravel())) / genie.crlb - 1.0)
        for samples, losses in loss.items():
            print(f"  pose and map to {std:4.2f} m, {samples:2d} samples         {quantiles(100.0 * np.array(losses))}")


def disturbed(truth: SlamEstimate, std: float, *, rng: np.random.Generator) -> SlamEstimate:
    """The same with Gaussian errors [m] on pose and landmarks, and a cloud of that spread about the wrong mean."""
    level = np.array([1.0, 1.0, 0.0])
    position = truth.position + std * rng.normal(size=3) * level
    shift = std * rng.normal(size=truth.map.position.shape)
    return replace(
        truth, position=position, samples=position + std * rng.normal(size=(64, 3)) * level,
        covariance=np.diag([std**2] * 3 + [0.01] * 3), map=replace(truth.map, position=truth.map.position + shift),
    )  # fmt: skip


def random_belief(scene: Scene, *, rng: np.random.Generator, std: float = 0.05) -> SlamEstimate:
    """A pose in the room, known to `std` [m] an axis, and a map with errors of the same size."""
    assert scene.ris is not None
    walls = build_walls(scene)
    points, parent, strength = [], [], []
    for number, point in enumerate(scene.landmark_positions):
        points.append(point)
        parent.append(-1)
        panel = number == len(scene.scatterers)
        strength.append(0.0 if panel else np.sqrt(scene.scatterers[number].rcs))
    for number, point in enumerate(scene.landmark_positions):
        for wall in range(len(walls)):
            if number == len(scene.scatterers) and wall == walls.hosts[0]:
                continue
            points.append(mirror(point, walls.normal[wall], walls.offset[wall]))
            parent.append(number)
            strength.append(walls.material[wall].reflection or 0.85)
    count = len(points)
    landmarks = MapEstimate(
        np.arange(count), np.array(points) + std * rng.normal(size=(count, 3)),
        np.tile(std**2 * np.eye(3), (count, 1, 1)), np.array(parent),
        (np.arange(count) == len(scene.scatterers)).astype(float), np.array(strength),
        np.zeros((0, 3)), np.zeros(0), np.zeros((0, 2)),
    )  # fmt: skip
    position = rng.uniform(LOWEST, HIGHEST)
    cloud = position + std * rng.normal(size=(64, 3)) * [1.0, 1.0, 0.0]
    covariance = np.diag([std**2] * 3 + [0.01] * 3)
    heading = float(rng.uniform(-3.0, 3.0))
    return SlamEstimate(position, np.zeros(3), heading, covariance, cloud, scene.agent.body, landmarks)


def belief_problem(belief: SlamEstimate, spec: RisSpec) -> DesignProblem:
    """At the belief's mean."""
    problem = problem_from_belief(belief, spec, RADIO, samples=1)
    assert problem is not None
    return problem


def best_known(problem: DesignProblem, *, rng: np.random.Generator, restarts: int = 40) -> tuple[Floats, float]:
    """Best code and CRLB over descents from every path's own optimum and from random codes."""
    objective = build_objective(problem)
    paths = problem.response.shape[1]
    design = DESIGNERS["coordinate"](problem, rng=rng, config=DesignConfig(starts=paths))
    best, least = design.code.index.ravel(), design.crlb
    for _ in range(restarts):
        start = rng.integers(problem.levels, size=best.size)
        index, history = coordinate_descent(objective, start, problem.levels, 200)
        if history[-1] < least:
            best, least = index, float(history[-1])
    return best, least


def without_images(problem: DesignProblem) -> DesignProblem:
    """The direct panel path and the paths that do not meet the panel."""
    panel = problem.response.shape[1]
    keep = np.concatenate([[0], np.arange(panel, problem.gradient.shape[1])])
    return replace(problem, response=problem.response[:, :1], gradient=problem.gradient[:, keep])


def quantiles(values: list[float] | Floats) -> str:
    """Median, and the range of nine in ten."""
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
    return f"median {middle:7.3f}   5 % {low:7.3f}   95 % {high:7.3f}"


def draw_convergence(history: Floats, figure: str) -> None:
    """Excess of CRLB-GA over the best known code against its iterations."""
    import matplotlib.pyplot as plt

    low, middle, high = np.quantile(100.0 * history, [0.05, 0.5, 0.95], axis=0)
    image, axes = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
    axes.fill_between(np.arange(len(middle)), np.maximum(low, 1e-2), high, alpha=0.25, label="nine places in ten")
    axes.plot(middle, label="median")
    axes.set(yscale="log", ylim=(0.1, 1000), xlabel="iteration of CRLB-GA", ylabel="CRLB above best known code [%]")
    axes.grid(alpha=0.3)
    axes.legend()
    image.savefig(figure, dpi=120)


if __name__ == "__main__":
    main()
