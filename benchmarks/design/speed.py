"""How long does a design take, and is CRLB-GA faster than a general library at equal quality?

Times every designer on panels of 36 to 4096 elements in the paper's room, and runs the genetic algorithms of `pymoo`
and `deap` (extras of the developer) on the same objective with the same population: as many generations as CRLB-GA,
and until they reach what CRLB-GA reached. Run: `python benchmarks/design/speed.py [--places 5] [--largest 4096]`.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.channel.image_source import ImageSourceChannel
from rislam_rt.design import DESIGNERS, DesignConfig, DesignProblem, Objective, build_objective, problem_from_paths
from rislam_rt.model import RadioConfig, Trajectory
from rislam_rt.scene import load_scene

LEVELS, DEPTH = 4, 1
CONFIG = DesignConfig(certify=False)


class Run(NamedTuple):
    """One run of a library."""

    value: float
    """Best objective [m^2]."""
    seconds: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--places", type=int, default=5)
    parser.add_argument("--largest", type=int, default=4096)
    arguments = parser.parse_args()
    sides = [side for side in (6, 16, 32, 64) if side * side <= arguments.largest]
    problems = {side: make_problems(side, arguments.places) for side in sides}
    print_times(problems)
    libraries = available_libraries()
    for name, run in libraries.items():
        for side in sides[:2]:
            compare(name, run, side, problems[side])
    if not libraries:
        print("neither pymoo nor deap is installed: pip install pymoo deap")


def make_problems(side: int, places: int) -> list[DesignProblem]:
    """Problems of the truth at random places of the paper's room, with a panel of side x side elements."""
    scene, radio = load_scene("scenes/paper_room"), RadioConfig()
    assert scene.ris is not None
    spec = replace(scene.ris.spec, rows=side, cols=side, levels=LEVELS)
    scene = replace(scene, ris=replace(scene.ris, spec=spec))
    rng = np.random.default_rng(36)
    position = rng.uniform([0.4, 0.4, 0.2], [5.6, 5.6, 1.4], size=(places, 3))
    still = np.zeros((places, 3))
    motion = Trajectory(np.arange(float(places)), position, still, rng.uniform(-3, 3, places), scene.agent.body)
    paths = ImageSourceChannel(scene, radio, DEPTH).paths(motion)
    prior = np.eye(2) / 0.05**2
    return [
        problem_from_paths(paths, motion.tx[k], motion.rx[k], radio, LEVELS, cycle=k, prior=prior)
        for k in range(places)
    ]


def print_times(problems: dict[int, list[DesignProblem]]) -> None:
    """Median time [ms] of each method; the whole call, bound left out, and with it for the exact method."""
    print(f"median ms a design, {next(iter(problems.values()))[0].response.shape[1]} panel paths")
    print(f"{'method':20s}" + "".join(f"{side * side:>10d}" for side in problems))
    for method in DESIGNERS:
        row = [1e3 * median_time(method, cases, CONFIG) for cases in problems.values()]
        print(f"{method:20s}" + "".join(f"{value:10.2f}" for value in row))
    row = [1e3 * median_time("exact", cases, DesignConfig()) for cases in problems.values()]
    print(f"{'exact, with bound':20s}" + "".join(f"{value:10.2f}" for value in row))


def median_time(method: str, problems: list[DesignProblem], config: DesignConfig) -> float:
    """Seconds."""
    seconds = []
    for repeat in range(3):
        for problem in problems:
            begin = time.perf_counter()
            DESIGNERS[method](problem, rng=np.random.default_rng(repeat), config=config)
            seconds.append(time.perf_counter() - begin)
    return float(np.median(seconds))


Library = Callable[[Objective, int, int, float, int], Run]
"""(objective, elements, most generations, value to stop at, seed) -> result."""


def compare(name: str, run: Library, side: int, problems: list[DesignProblem]) -> None:
    """CRLB-GA against a library: same budget, then same quality."""
    ours, same_budget, same_quality, missed = [], [], [], 0
    for seed, problem in enumerate(problems):
        objective = build_objective(problem)
        begin = time.perf_counter()
        design = DESIGNERS["genetic"](problem, rng=np.random.default_rng(seed), config=CONFIG)
        ours.append(Run(design.crlb, time.perf_counter() - begin))
        same_budget.append(run(objective, side * side, CONFIG.iterations, 0.0, seed))
        reached = run(objective, side * side, 10 * CONFIG.iterations, design.crlb, seed)
        same_quality.append(reached)
        missed += reached.value > design.crlb

    def median(runs: list[Run]) -> float:
        return float(np.median([r.seconds for r in runs]))

    excess = np.median([b.value / o.value - 1.0 for o, b in zip(ours, same_budget, strict=True)])
    budget, quality = median(same_budget), median(same_quality)
    print(
        f"{name:6s} {side * side:5d} elements: CRLB-GA {1e3 * median(ours):.1f} ms; "
        f"same {CONFIG.iterations} generations {1e3 * budget:.0f} ms ({budget / median(ours):.0f} x), "
        f"CRLB {100 * excess:+.1f} %; to equal quality {1e3 * quality:.0f} ms ({quality / median(ours):.0f} x), "
        f"{missed} of {len(problems)} not there after {10 * CONFIG.iterations} generations"
    )


def available_libraries() -> dict[str, Library]:
    """Those that can be imported."""
    found: dict[str, Library] = {}
    for name, run in (("pymoo", run_pymoo), ("deap", run_deap)):
        try:
            __import__(name)
        except ImportError:
            continue
        found[name] = run
    return found


def run_pymoo(objective: Objective, elements: int, generations: int, target: float, seed: int) -> Run:
    """pymoo's GA with integer genes: one-point cross, random-choice mutation, the whole population in one call."""
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.core.mutation import Mutation
    from pymoo.core.problem import Problem
    from pymoo.operators.crossover.pntx import PointCrossover
    from pymoo.operators.sampling.rnd import IntegerRandomSampling
    from pymoo.optimize import minimize
    from pymoo.termination.max_gen import MaximumGenerationTermination

    class Codes(Problem):
        def __init__(self) -> None:
            super().__init__(n_var=elements, n_obj=1, xl=0, xu=LEVELS - 1, vtype=int)

        def _evaluate(self, x: Integers, out: dict[str, Floats], *args: Any, **kwargs: Any) -> None:
            out["F"] = objective.of_index(x)

    class Redraw(Mutation):
        def _do(self, problem: Any, x: Integers, **kwargs: Any) -> Integers:
            generator = kwargs.get("random_state") or np.random.default_rng(seed)
            hit = generator.random(x.shape) < CONFIG.mutation
            return np.where(hit, generator.integers(LEVELS, size=x.shape), x)

    class Until(MaximumGenerationTermination):
        def _update(self, algorithm: Any) -> float:
            if algorithm.opt is not None and algorithm.opt.get("F").min() <= target:
                return 1.0
            return float(super()._update(algorithm))

    algorithm = GA(
        pop_size=CONFIG.population, sampling=IntegerRandomSampling(), crossover=PointCrossover(n_points=1),
        mutation=Redraw(),
    )  # fmt: skip
    begin = time.perf_counter()
    result = minimize(Codes(), algorithm, Until(generations), seed=seed, verbose=False)
    return Run(float(np.min(result.F)), time.perf_counter() - begin)


def run_deap(objective: Objective, elements: int, generations: int, target: float, seed: int) -> Run:
    """deap's building blocks as its users put them together: roulette, one-point cross, uniform integer mutation."""
    import random

    from deap import base, creator, tools

    if not hasattr(creator, "CrlbFitness"):
        creator.create("CrlbFitness", base.Fitness, weights=(1.0,))
        creator.create("Code", list, fitness=creator.CrlbFitness)
    random.seed(seed)
    box = base.Toolbox()
    box.register("gene", random.randrange, LEVELS)
    box.register("individual", tools.initRepeat, creator.Code, box.gene, elements)
    begin = time.perf_counter()
    population = tools.initRepeat(list, box.individual, CONFIG.population)
    best = np.inf
    for _ in range(generations + 1):
        fresh = [one for one in population if not one.fitness.valid]
        for one, value in zip(fresh, objective.of_index(np.array(fresh)), strict=True):
            one.fitness.values = (1.0 / value,)
        elite = tools.selBest(population, CONFIG.elite)
        best = 1.0 / elite[0].fitness.values[0]
        if best <= target:
            break
        children = [box.clone(one) for one in tools.selRoulette(population, CONFIG.population - CONFIG.elite)]
        for first, second in zip(children[::2], children[1::2], strict=True):
            tools.cxOnePoint(first, second)
        for child in children:
            tools.mutUniformInt(child, 0, LEVELS - 1, CONFIG.mutation)
            del child.fitness.values
        population = [box.clone(one) for one in elite] + children
    return Run(best, time.perf_counter() - begin)


if __name__ == "__main__":
    main()
