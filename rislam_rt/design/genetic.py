"""CRLB-GA: the paper's genetic algorithm for the panel's phase code."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.design.design_result import DesignConfig
from rislam_rt.design.objective import Objective


def genetic_search(
    objective: Objective, num_elements: int, levels: int, *, rng: np.random.Generator, config: DesignConfig
) -> tuple[Integers, Floats]:
    """Panel code (N M,) of least expected CRLB that a genetic search finds, and the best objective after each iteration
    (C^A + 1,), the first before any.

    Selection: the Q fittest survive. Cross: (K - Q)/2 times two parents, drawn with probability proportional to
    fitness `1 / tr(...)` (the paper prints the inverse of a matrix), swap the genes from a random one to the last.
    Mutation: every gene of a child is redrawn from all H levels with probability p_m.
    """
    size, elite = config.population, config.elite
    pairs = (size - elite) // 2
    population = rng.integers(levels, size=(size, num_elements))
    value = objective.of_index(population)
    history = np.empty(config.iterations + 1)
    history[0] = value.min()
    # all random numbers at once: drawing them generation by generation costs as much as the search
    spin = rng.random((config.iterations, 2 * pairs))
    cuts = rng.integers(num_elements, size=(config.iterations, pairs, 1))
    place, gene = _mutations(config.iterations * 2 * pairs * num_elements, levels, config.mutation, rng=rng)
    bounds = np.searchsorted(place, np.arange(config.iterations + 1) * 2 * pairs * num_elements)
    element = np.arange(num_elements)
    children = np.empty((2 * pairs, num_elements), dtype=population.dtype)
    for generation in range(config.iterations):
        wheel = (1.0 / value).cumsum()
        parent = population[np.minimum(wheel.searchsorted(spin[generation] * wheel[-1]), size - 1)]
        first, second, swap = parent[:pairs], parent[pairs:], element >= cuts[generation]
        children[:pairs] = np.where(swap, second, first)
        children[pairs:] = np.where(swap, first, second)
        now = slice(bounds[generation], bounds[generation + 1])
        children.ravel()[place[now] - generation * children.size] = gene[now]
        fittest = value.argsort(kind="stable")[:elite]
        population = np.concatenate([population[fittest], children])
        value = np.concatenate([value[fittest], objective.of_index(children)])
        history[generation + 1] = value.min()
    return population[np.argmin(value)], history


def _mutations(genes: int, levels: int, probability: float, *, rng: np.random.Generator) -> tuple[Integers, Integers]:
    """Draw which of the genetic algorithm's genes mutate, all with one probability, and their new levels."""
    # The gaps between mutated genes are geometric, so that only those are drawn.
    if probability == 0.0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    expected = genes * probability
    place = np.zeros(0, dtype=np.int64)
    last = -1
    while last < genes:
        gaps = rng.geometric(probability, size=int(expected + 6.0 * np.sqrt(expected) + 10.0))
        place = np.concatenate([place, last + np.cumsum(gaps)])
        last = int(place[-1])
    place = place[: np.searchsorted(place, genes)]
    return place, rng.integers(levels, size=len(place))
