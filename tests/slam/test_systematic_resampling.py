"""Systematic resampling draws without bias, of one set of weights and of many."""

import numpy as np

from rislam_rt.slam.sampling import ancestors_at, systematic_ancestors


def test_particles_are_drawn_as_often_as_their_weights_say() -> None:
    """Mean counts over 4000 draws: each count has a standard deviation of at most 0.5."""
    rng = np.random.default_rng(1)
    weight = rng.random(20) ** 3
    draws = [np.bincount(systematic_ancestors(weight, 50, rng=rng), minlength=20) for _ in range(4000)]
    np.testing.assert_allclose(np.mean(draws, axis=0), 50 * weight / weight.sum(), atol=5 * 0.5 / np.sqrt(4000))


def test_every_row_is_drawn_by_its_own_weights() -> None:
    rows = ancestors_at(np.array([[1.0, 0.0, 1.0], [0.0, 3.0, 0.0]]), 4, np.array([0.5, 0.999]))
    np.testing.assert_array_equal(rows, [[0, 0, 2, 2], [1, 1, 1, 1]])
