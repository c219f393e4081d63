"""Systematic resampling: which particles survive, for one weighted set or many at once."""

import numpy as np

from rislam_rt.arrays import Floats, Integers


def ancestors_at(weight: Floats, size: int, comb: Floats) -> Integers:
    """Ancestor rows (K, size) by systematic resampling of each row of weights (K, N), whose comb (K,) starts in [0, 1).

    Particle i of a row is drawn `size w_i` times on average; the ancestors come in the order of the particles.
    """
    edges = np.cumsum(weight, axis=1)
    teeth = (np.arange(size) + comb[:, None]) / size * edges[:, -1:]
    rows = [np.searchsorted(edge, tooth, side="right") for edge, tooth in zip(edges, teeth, strict=True)]
    return np.minimum(np.array(rows, dtype=np.int64).reshape(len(weight), size), weight.shape[1] - 1)


def systematic_ancestors(weight: Floats, count: int, *, rng: np.random.Generator) -> Integers:
    """Ancestor rows (count,) by systematic resampling of one set of particle weights (N,), unbiased."""
    return ancestors_at(weight[None], count, rng.random(1))[0]
