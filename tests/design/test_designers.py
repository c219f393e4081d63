"""One list of designers drives these tests: what must hold for each, and what sets them apart."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from rislam_rt.design import DESIGNERS, DesignConfig, DesignProblem, build_objective, designer, exact_code
from rislam_rt.design import genetic as genetic_module
from rislam_rt.errors import ConfigError
from rislam_rt.information import Outcome, position_bound

DISCRETE = [name for name in DESIGNERS if name != "continuous"]


def direct_crlb(problem, xi):
    """The objective by the book: gains, information matrices, traces of inverses, sample by sample."""
    weight = np.exp(-1j * xi)
    total = 0.0
    for b in range(problem.response.shape[0]):
        gain = np.concatenate([np.sum(problem.response[b] * weight, axis=(1, 2)), problem.static_gain[b]])
        power = np.abs(gain) ** 2
        strength = problem.scale * power / (1 + (problem.least_power / power) ** 4)
        if problem.variance is not None:
            strength = 1 / (1 / strength + problem.variance[b])
        g = problem.gradient[b]
        total += float(position_bound((g * strength[:, None]).T @ g + problem.prior).variance)
    return total / problem.response.shape[0]


@pytest.mark.parametrize("method", DESIGNERS)
@pytest.mark.parametrize("samples", [1, 3])
def test_reported_figures_belong_to_the_reported_phases(method, samples, make_problem, rng):
    problem = make_problem(rng, rows=2, cols=3, samples=samples, panel=3)
    design = DESIGNERS[method](problem, rng=rng)
    assert design.method == method
    assert design.outcome is Outcome.OK
    assert design.code.index.shape == design.xi.shape == (2, 3)
    if method in DISCRETE:
        np.testing.assert_array_equal(design.code.xi, design.xi)
    assert design.crlb == pytest.approx(direct_crlb(problem, design.xi), rel=1e-10)
    assert design.history[-1] == pytest.approx(design.crlb, rel=1e-10)
    gain = np.abs(np.sum(problem.response[0, 0] * np.exp(-1j * design.xi)))
    assert design.gain_db == pytest.approx(20 * np.log10(gain), abs=1e-9)
    best = 20 * np.log10(exact_code(problem.target, problem.levels)[1])
    assert design.gap_db == pytest.approx(best - design.gain_db, abs=1e-9)


@pytest.mark.parametrize("method", DISCRETE)
def test_no_discrete_design_beats_its_bound_or_brute_force(method, make_problem):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        problem = make_problem(rng, rows=2, cols=2, levels=4, samples=2, panel=3)
        objective = build_objective(problem)
        every = np.array(list(itertools.product(range(4), repeat=4)))
        least = objective.of_index(every).min()
        design = DESIGNERS[method](problem, rng=rng)
        assert design.bound <= least * (1 + 1e-12)
        assert design.crlb >= least * (1 - 1e-12)
        assert design.gap_crlb >= -1e-12


@pytest.mark.parametrize("method", ["genetic", "coordinate"])
def test_searches_find_the_optimum_of_small_panels(method, make_problem):
    excess = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        problem = make_problem(rng, rows=2, cols=3, levels=4, panel=2)
        least = build_objective(problem).of_index(np.array(list(itertools.product(range(4), repeat=6)))).min()
        excess.append(DESIGNERS[method](problem, rng=rng).crlb / least - 1)
    assert np.median(excess) < 1e-12  # found exactly in most cases
    assert np.mean(excess) < 0.02


@pytest.mark.parametrize("method", DESIGNERS)
def test_same_seed_same_design_and_order_of_paths_does_not_matter(method, make_problem):
    problem = make_problem(np.random.default_rng(5), panel=3, static=3)
    swapped = DesignProblem(
        problem.response[:, [0, 2, 1]], problem.static_gain[:, ::-1], problem.gradient[:, [0, 2, 1, 5, 4, 3]],
        problem.prior, problem.scale, problem.levels,
    )  # fmt: skip
    first, second, third = (DESIGNERS[method](p, rng=np.random.default_rng(7)) for p in (problem, problem, swapped))
    np.testing.assert_array_equal(first.code.index, second.code.index)
    assert first.crlb == second.crlb
    if method != "genetic":  # rounding of a sum may turn a roulette wheel by one
        assert third.crlb == pytest.approx(first.crlb, rel=1e-9)


def test_variance_of_a_path_discounts_it(make_problem, rng):
    plain = make_problem(rng, panel=2, static=2)
    variance = np.array([[0.3, 0.0, 2.0, 1e12]])
    problem = DesignProblem(
        plain.response, plain.static_gain, plain.gradient, plain.prior, plain.scale, plain.levels, variance
    )
    without_last = DesignProblem(
        plain.response, plain.static_gain[:, :1], plain.gradient[:, :3], plain.prior, plain.scale, plain.levels,
        variance[:, :3],
    )  # fmt: skip
    design = DESIGNERS["coordinate"](problem, rng=rng)
    assert design.crlb == pytest.approx(direct_crlb(problem, design.xi), rel=1e-10)
    assert design.crlb > direct_crlb(plain, design.xi)
    assert design.crlb == pytest.approx(direct_crlb(without_last, design.xi), rel=1e-9)
    assert design.crlb >= design.bound


def test_paths_that_will_be_missed_are_worth_nothing(make_problem, rng):
    plain = make_problem(rng, panel=3, static=2)
    best = np.sqrt(np.max(np.sum(np.abs(plain.response), axis=(2, 3)) ** 2))
    for least in (0.0, 0.1 * best**2, 0.5 * best**2, 10.0 * best**2):
        problem = replace(plain, least_power=least)
        design = DESIGNERS["coordinate"](problem, rng=rng)
        assert design.crlb == pytest.approx(direct_crlb(problem, design.xi), rel=1e-10)
        assert design.crlb >= design.bound * (1 - 1e-12)
        assert design.crlb >= direct_crlb(plain, design.xi)


def test_genetic_keeps_its_elite_and_converges(make_problem, rng):
    problem = make_problem(rng, rows=6, cols=6, panel=1, static=2)
    design = DESIGNERS["genetic"](problem, rng=rng)
    assert len(design.history) == DesignConfig().iterations + 1
    assert (np.diff(design.history) <= 0.0).all()
    # with one panel path the bound is the optimum
    assert design.history[-1] - design.bound < 0.2 * (design.history[0] - design.bound)


def test_genetic_without_mutation_only_recombines(rng, make_problem):
    """With p_m = 0 and one cut, a gene of a child always comes from the same place of a parent."""
    problem = make_problem(rng, rows=3, cols=3, levels=16)
    config = DesignConfig(population=4, elite=0, iterations=3, mutation=0.0)
    seed = 11
    start = np.random.default_rng(seed).integers(16, size=(4, 9))
    index = DESIGNERS["genetic"](problem, rng=np.random.default_rng(seed), config=config).code.index.ravel()
    assert all(index[n] in start[:, n] for n in range(9))


def test_coordinate_stops_where_no_single_change_helps(make_problem, rng):
    problem = make_problem(rng, rows=4, cols=4, panel=3)
    design = DESIGNERS["coordinate"](problem, rng=rng)
    index = design.code.index.ravel()
    neighbours = np.array(
        [np.where(np.arange(16) == n, (index[n] + s) % 4, index) for n in range(16) for s in (1, 2, 3)]
    )
    assert (build_objective(problem).of_index(neighbours) >= design.crlb * (1 - 1e-9)).all()
    assert design.crlb <= DESIGNERS["exact"](problem, rng=rng).crlb * (1 + 1e-12)


@pytest.mark.parametrize("method", DESIGNERS)
def test_one_path_without_prior_is_unobservable_not_an_error(method, make_problem, rng):
    problem = make_problem(rng, panel=1, static=0, prior=0.0)
    design = DESIGNERS[method](problem, rng=rng)
    assert design.outcome is Outcome.UNOBSERVABLE
    assert design.crlb == np.inf
    assert np.isfinite(design.gain_db)
    if method in ("exact", "coordinate"):
        assert design.gap_db == pytest.approx(0.0, abs=1e-9)  # what is seen is still made best


@pytest.mark.parametrize("method", DESIGNERS)
def test_a_dark_panel_gives_finite_figures(method, make_problem, rng):
    problem = make_problem(rng)
    dark = DesignProblem(
        np.zeros_like(problem.response), problem.static_gain, problem.gradient, problem.prior, 1.0, problem.levels
    )
    design = DESIGNERS[method](dark, rng=rng)
    assert np.isfinite(design.crlb)
    assert design.crlb == pytest.approx(design.bound, rel=1e-9)


def test_bad_settings_are_refused():
    with pytest.raises(ConfigError, match="give one of genetic"):
        designer("annealing")
    with pytest.raises(ConfigError, match="even difference"):
        DesignConfig(population=50, elite=9)
    with pytest.raises(ConfigError, match=r"design\.mutation"):
        DesignConfig(mutation=1.5)


@pytest.mark.parametrize("probability", [0.0, 0.02, 0.5, 1.0])
def test_mutations_fall_independently(probability):
    genes, rng = 200_000, np.random.default_rng(3)
    place, gene = genetic_module._mutations(genes, 4, probability, rng=rng)
    assert (np.diff(place) > 0).all()
    assert len(place) == len(gene)
    # binomial count, five standard deviations; the halves agree as well
    spread = 5 * np.sqrt(genes * probability * (1 - probability)) + 1e-9
    assert abs(len(place) - genes * probability) <= spread
    assert abs(np.sum(place < genes // 2) - genes * probability / 2) <= spread
    if probability:
        assert place[-1] < genes
        np.testing.assert_allclose(np.bincount(gene, minlength=4) / len(gene), 0.25, atol=2.5 / np.sqrt(len(gene)))
        adjacent = np.mean(np.isin(place + 1, place))
        assert adjacent == pytest.approx(probability, abs=5 * np.sqrt(probability / len(place)) + 1e-3)
