"""CRLB-GA: the genetic algorithm of the paper, as printed."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.design.objective import Objective
from rislam_rt.design.result import DesignConfig


def genetic_search(
    objective: Objective, num_elements: int, levels: int, *, rng: np.random.Generator, config: DesignConfig
) -> tuple[Integers, Floats]:
    """Best individual (N M,) and the best objective after each iteration (C^A + 1,), the first before any.

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
    swap = np.arange(num_elements) >= rng.integers(num_elements, size=(config.iterations, pairs))[..., None]
    mutants = rng.random((config.iterations, 2 * pairs, num_elements)) < config.mutation
    redrawn = rng.integers(levels, size=mutants.shape)
    children = np.empty((2 * pairs, num_elements), dtype=population.dtype)
    for generation in range(config.iterations):
        wheel = np.cumsum(1.0 / value)
        parent = population[np.minimum(np.searchsorted(wheel, spin[generation] * wheel[-1]), size - 1)]
        first, second, cut = parent[:pairs], parent[pairs:], swap[generation]
        children[:pairs] = np.where(cut, second, first)
        children[pairs:] = np.where(cut, first, second)
        np.copyto(children, redrawn[generation], where=mutants[generation])
        fittest = np.argsort(value, kind="stable")[:elite]
        population = np.concatenate([population[fittest], children])
        value = np.concatenate([value[fittest], objective.of_index(children)])
        history[generation + 1] = value.min()
    return population[np.argmin(value)], history
