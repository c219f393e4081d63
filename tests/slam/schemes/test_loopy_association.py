"""Loopy association against the sum over all associations, and the laws that its marginals obey."""

from itertools import product

import numpy as np
import pytest

from rislam_rt.arrays import Floats
from rislam_rt.slam.schemes.shared.loopy_association import associate


def enumerate_marginals(missed: Floats, pair: Floats, fresh: Floats) -> Floats:
    """(K, M+1) exact marginals: every map of features to measurements or none, no measurement twice."""
    features, shown = pair.shape
    total = np.zeros((features, shown + 1))
    for choice in product(range(-1, shown), repeat=features):
        used = [m for m in choice if m >= 0]
        if len(set(used)) < len(used):
            continue
        weight = np.prod([missed[k] if m < 0 else pair[k, m] for k, m in enumerate(choice)])
        weight *= np.prod([fresh[m] for m in range(shown) if m not in used])
        for k, m in enumerate(choice):
            total[k, m] += weight
    return total / total.sum(axis=1, keepdims=True)


def draw(features: int, shown: int, seed: int) -> tuple[Floats, Floats, Floats]:
    rng = np.random.default_rng(seed)
    pair = np.exp(2.0 * rng.standard_normal((features, shown)))
    return 0.05 + 0.9 * rng.random(features), pair, 1.0 + rng.random(shown)


@pytest.mark.parametrize(("features", "shown"), [(1, 4), (4, 1)])
def test_exact_without_loops(features: int, shown: int) -> None:
    """One feature or one measurement: the graph is a tree, and the rule is exact up to rounding."""
    for seed in range(10):
        weights = draw(features, shown, seed)
        found = associate(*weights, 200, 1e-15).feature
        assert np.allclose(found, enumerate_marginals(*weights), rtol=0.0, atol=1e-12)


def test_near_the_exact_marginals_with_loops() -> None:
    """Three features, three measurements, weights over two decades: a few hundredths on average, never a quarter."""
    errors = []
    for seed in range(50):
        weights = draw(3, 3, seed)
        errors.append(np.abs(associate(*weights, 500, 1e-14).feature - enumerate_marginals(*weights)))
    assert np.mean(errors) < 0.03
    assert np.max(errors) < 0.25


def test_clear_pairs_are_found() -> None:
    """Ratios of 1e6 on the diagonal: the exact marginals are one up to 1e-5, and so are the loopy ones."""
    pair = np.full((3, 3), 1e-3) + 1e3 * np.eye(3)
    found = associate(np.full(3, 1e-3), pair, np.ones(3), 100, 1e-12).feature
    assert np.allclose(found[:, :3], np.eye(3), rtol=0.0, atol=1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_both_sides_agree(seed: int) -> None:
    """Rows sum to one, and so does each measurement's: at the fixed point both ends of an edge hold one marginal."""
    found = associate(*draw(4, 5, seed), 2000, 1e-14)
    assert np.allclose(found.feature.sum(axis=1), 1.0, rtol=0.0, atol=1e-12)
    assert np.allclose(found.unclaimed + found.feature[:, :-1].sum(axis=0), 1.0, rtol=0.0, atol=1e-9)


def test_order_does_not_matter() -> None:
    """Features and measurements renumbered: the same marginals, renumbered."""
    missed, pair, fresh = draw(4, 5, 7)
    rows, columns = np.array([2, 0, 3, 1]), np.array([4, 1, 0, 3, 2])
    plain = associate(missed, pair, fresh, 50, 0.0)
    mixed = associate(missed[rows], pair[rows][:, columns], fresh[columns], 50, 0.0)
    assert np.allclose(mixed.feature[:, :-1], plain.feature[rows][:, columns], rtol=1e-12)
    assert np.allclose(mixed.unclaimed, plain.unclaimed[columns], rtol=1e-12)


def test_nothing_there() -> None:
    """No features, or no measurements: empty marginals, certainty of a miss."""
    alone = associate(np.array([0.1]), np.zeros((1, 0)), np.zeros(0), 10, 1e-6)
    assert np.array_equal(alone.feature, [[1.0]])
    bare = associate(np.zeros(0), np.zeros((0, 2)), np.array([1.0, 2.0]), 10, 1e-6)
    assert bare.feature.shape == (0, 3)
    assert np.array_equal(bare.unclaimed, [1.0, 1.0])
