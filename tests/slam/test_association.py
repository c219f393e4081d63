"""Association: the assignment against brute force, and its gates."""

from itertools import product

import numpy as np
import pytest

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.assignment import Candidates, cheapest, log_rayleigh, pair_costs, squared_distance
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD, Observations
from rislam_rt.slam.window.landmarks.measurement_prediction import PANEL_STD

GATE, CLUTTER = 16.3, 0.016


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20240621)


def draw_candidates(count: int, *, rng: np.random.Generator) -> Candidates:
    """Near each other, so that they compete."""
    root = rng.normal(size=(count, 3, 3))
    return Candidates(
        np.array([3.0, 0.2, 0.1]) + 0.05 * rng.normal(size=(count, 3)),
        2e-3 * root @ np.swapaxes(root, 1, 2) + 1e-4 * np.eye(3),
        0.2 * rng.normal(size=count),
        np.full(count, 0.3),
        np.log(rng.uniform(0.3, 0.95, count)),
        np.full(count, UNTOLD),
        np.zeros(count, dtype=np.bool_),
    )


def one(std: float = 0.05, side: int = UNTOLD, fades: bool = False) -> Candidates:
    """A candidate at nought, whose log amplitude has such a deviation."""
    return Candidates(
        np.zeros((1, 3)), 1e-4 * np.eye(3)[None], np.zeros(1), np.full(1, std), np.zeros(1), np.full(1, side),
        np.full(1, fades),
    )  # fmt: skip


def associate(candidates: Candidates, observations: Observations, clutter: float = CLUTTER) -> Integers:
    """Measurement (C,) of each candidate, -1 for none."""
    chosen = np.full(len(candidates.seen), -1)
    rows, columns = cheapest(pair_costs(candidates, observations, GATE, clutter))
    chosen[rows] = columns
    return chosen


def observed(seen: Floats, log_amplitude: Floats, std: float = 0.02) -> Observations:
    """Measurements as the filter looks at them."""
    count = len(seen)
    return Observations(seen, np.full((count, 3), std), log_amplitude, np.full(count, 0.1), np.zeros(count))


def test_assignment_is_the_best_of_all() -> None:
    """Against every one-to-one pairing of up to four and four, unassigned ones costing nothing."""
    rng = np.random.default_rng(5)
    contested = 0
    for _ in range(60):
        here, there = rng.integers(1, 5, size=2)
        found = draw_candidates(int(here), rng=rng)
        seen = observed(
            found.seen[rng.integers(here, size=there)] + 0.05 * rng.normal(size=(there, 3)), np.zeros(there)
        )
        cost = pair_costs(found, seen, GATE, CLUTTER)
        chosen = associate(found, seen)
        best = min(
            sum(cost[row, column] for row, column in enumerate(choice) if column >= 0)
            for choice in product(range(-1, there), repeat=int(here))
            if len(taken := [c for c in choice if c >= 0]) == len(set(taken))
        )
        got = sum(cost[row, column] for row, column in enumerate(chosen) if column >= 0)
        assert got == pytest.approx(best, abs=1e-9)
        used = chosen[chosen >= 0]
        assert len(set(used.tolist())) == len(used)
        greedy = np.argmin(cost, axis=1)
        contested += int(len(set(greedy.tolist())) < here <= there)
    # the cases are worth the name: the cheapest measurement is often the same one for several
    assert contested > 10


def test_cost_is_the_likelihood_ratio_against_clutter(rng: np.random.Generator) -> None:
    """-2 log of P_D N(gap; S) N(fade; s^2) / clutter density, by scipy."""
    from scipy.stats import multivariate_normal, norm

    found = draw_candidates(1, rng=rng)
    seen = observed(found.seen + 0.01, np.array([0.1]))
    density = multivariate_normal.logpdf(seen.seen[0], found.seen[0], found.covariance[0] + 0.02**2 * np.eye(3))
    fade = norm.logpdf(0.1, found.log_amplitude[0], np.hypot(0.3, 0.1))
    want = -2.0 * (density + fade + found.log_odds[0] - np.log(CLUTTER))
    np.testing.assert_allclose(pair_costs(found, seen, GATE, CLUTTER)[0, 0], want, rtol=1e-12)


@pytest.mark.parametrize("axis", range(4))
def test_beyond_the_gate_nothing_is_paired(axis: int) -> None:
    """Just inside the squared distance in delay, either cosine or log amplitude, and just outside."""
    found = one()
    for factor, paired in ((0.99, True), (1.01, False)):
        seen, fade = np.zeros((1, 3)), np.zeros(1)
        if axis < 3:
            seen[0, axis] = factor * np.sqrt(GATE * (1e-4 + 0.02**2))
        else:
            fade[0] = factor * np.sqrt(GATE * (0.05**2 + 0.1**2))
        # clutter is made so rare that only the gate stands between the two
        assert (associate(found, observed(seen, fade), 1e-9)[0] == 0) == paired


def test_nothing_to_assign() -> None:
    rng = np.random.default_rng(1)
    none = observed(np.zeros((0, 3)), np.zeros(0))
    np.testing.assert_array_equal(associate(draw_candidates(3, rng=rng), none), [-1, -1, -1])
    empty = Candidates._make(field[:0] for field in draw_candidates(1, rng=rng))
    assert len(associate(empty, observed(np.zeros((2, 3)), np.zeros(2)))) == 0


def test_squared_distances(rng: np.random.Generator) -> None:
    root, gap = rng.normal(size=(20, 3, 3)), rng.normal(size=(20, 3))
    matrix = root @ np.swapaxes(root, 1, 2) + 0.1 * np.eye(3)
    square, log_det = squared_distance(gap, matrix)
    # condition numbers up to 1e3: rounding below 1e-12
    np.testing.assert_allclose(square, np.vecdot(gap, np.linalg.solve(matrix, gap[..., None])[..., 0]), rtol=1e-9)
    np.testing.assert_allclose(log_det, np.linalg.slogdet(matrix)[1], atol=1e-12)


@pytest.mark.parametrize(
    ("mine", "other", "paired"), [(PANEL, OTHER, False), (PANEL, PANEL, True), (UNTOLD, OTHER, True)]
)
def test_what_runs_over_the_panel_is_not_paired_with_what_does_not(mine: int, other: int, paired: bool) -> None:
    found = one(side=mine)
    seen = observed(np.zeros((1, 3)), np.zeros(1))._replace(side=np.full(1, other))
    assert (associate(found, seen, 1e-9)[0] == 0) == paired


def test_a_panel_under_unknown_phases_is_a_rayleigh_variable_and_never_far_louder() -> None:
    surplus = np.linspace(-12.0, 4.0, 20001)
    density = np.exp(log_rayleigh(surplus)) * (surplus[1] - surplus[0])
    moments = [density.sum(), (density * surplus).sum(), (density * surplus**2).sum()]
    np.testing.assert_allclose(moments, [1.0, 0.0, PANEL_STD**2], atol=1e-5)
    for fades, louder, paired in ((True, 0.5, True), (True, 2.0, False), (False, 2.0, True)):
        found = one(PANEL_STD, fades=fades)
        assert (associate(found, observed(np.zeros((1, 3)), np.full(1, louder)))[0] == 0) == paired
