"""RIS identification: densities, brute-force Bayes, symmetry."""

from itertools import permutations

import numpy as np
import pytest

from rislam_rt.model import RadioConfig, RisCode, RisSpec
from rislam_rt.ris.path_gain import panel_path_gain, point_amplitude
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.panel_evidence import (
    STRENGTHS,
    add_evidence,
    log_missed,
    log_panel,
    log_panel_missed,
    log_rice,
    log_scatterer,
    log_scatterer_missed,
    panel_probabilities,
    weigh_silence,
)

RADIO = RadioConfig()
PANEL = RisSpec(6, 6, np.array([0.015, 0.015]), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]))


def test_rice_is_the_distribution_of_a_noisy_constant():
    """Monte Carlo: 100 000 draws, shares of ten bins within 4.5 standard deviations of a binomial count."""
    rng = np.random.default_rng(3)
    draws = np.hypot(1.3 + 0.7 * rng.standard_normal(100_000), 0.7 * rng.standard_normal(100_000))
    edges = np.linspace(0.0, 4.0, 11)
    counts, _ = np.histogram(draws, edges)
    for low, high, count in zip(edges[:-1], edges[1:], counts, strict=True):
        x = np.linspace(low, high, 201)[1:]
        share = np.exp(log_rice(x, np.array(1.3), np.array(0.7))).mean() * (high - low)
        assert abs(count - 1e5 * share) < 4.5 * np.sqrt(1e5 * share) + 1e5 * share * 5e-3  # 200-point sum: 5e-3


@pytest.mark.parametrize("mean", [0.0, 0.5, 3.0, 40.0])
def test_densities_integrate_to_one(mean):
    """Midpoint rule to 12 deviations above the mean, steps of 0.002: error below 1e-5 for a density this smooth."""
    std, step = 0.8, 2e-3
    high = 1.1 * mean + 0.2
    x = np.arange(0.5 * step, high + 12.0 * np.hypot(std, CONSTANTS.law * high), step)
    assert np.exp(log_rice(x, np.array(mean), np.array(std))).sum() * step == pytest.approx(1.0, abs=1e-5)
    spread = np.full(len(x), std)
    gain = np.broadcast_to(np.array([mean, 1.1 * mean + 0.2]) * np.exp(0.3j), (len(x), 2))
    assert np.exp(log_panel(x, spread, gain)).sum() * step == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("mean", [0.0, 0.5, 2.0, 6.0, 50.0, 1e6])
def test_a_miss_is_what_the_density_leaves(mean):
    """Seen or not: CONSTANTS.shown times the mass above the threshold, and the miss, make one (midpoint rule, 1e-5)."""
    std, threshold, step = 0.8, 2.5, 1e-3
    x = np.arange(threshold + 0.5 * step, max(mean, threshold) + 12.0 * std, step) if mean < 100.0 else None
    above = 1.0 if x is None else np.exp(log_rice(x, np.array(mean), np.array(std))).sum() * step
    missed = np.exp(log_missed(np.array(mean), np.array(std), threshold))
    assert missed + CONSTANTS.shown * above == pytest.approx(1.0, abs=1e-5)


def test_misses_speak_for_who_should_be_faint():
    std, threshold = np.array([1.0]), 4.5
    gain = np.array([[0.1 + 0.0j, 0.2j]])
    assert log_panel_missed(std, gain, threshold) > log_panel_missed(std, 100.0 * gain, threshold) + 2.0
    grid = log_scatterer_missed(np.array([1e-6]), np.ones(1), np.ones(1), RADIO, 4.5e-6)
    assert grid.shape == (1, len(STRENGTHS))
    assert (np.diff(grid) <= 1e-12).all()  # the larger, the less likely to be missed


def _data(seed, points=3, cycles=4, samples=4):
    """Amplitudes (K, P), predicted panel gains (K, P, S) and leg lengths (P,), all plausible for a scatterer."""
    rng = np.random.default_rng(seed)
    tx, rx = rng.uniform(1.0, 3.0, (2, points))
    level = point_amplitude(np.array(0.09), tx, rx, RADIO)
    amplitude = level * rng.uniform(0.85, 1.2, (cycles, points))
    gain = level[:, None] * np.exp(rng.normal(0.0, 0.25, (cycles, points, samples))) * np.exp(1j)
    return amplitude, gain, tx, rx, np.full(points, 0.15 * level.mean())


def _filtered(amplitude, gain, tx, rx, std):
    grid, odds = np.full((len(tx), len(STRENGTHS)), -np.log(len(STRENGTHS))), np.zeros(len(tx))
    for seen, predicted in zip(amplitude, gain, strict=True):
        grid, odds = add_evidence(grid, odds, log_scatterer(seen, std, tx, rx, RADIO), log_panel(seen, std, predicted))
    return odds


def _brute_force(amplitude, gain, tx, rx, std):
    """Joint likelihoods of "point i is the panel, the others scatterers" and of "none is", sums of plain products."""

    def rice(a, mean, spread):
        angle = np.linspace(0.0, 2.0 * np.pi, 241)[:-1]
        power = a**2 + mean**2 - 2.0 * a * mean * np.cos(angle)
        return a / spread**2 * np.exp(-0.5 * power / spread**2).mean()

    points = len(tx)
    as_scatterer, as_panel = np.zeros(points), np.ones(points)
    for p in range(points):
        for strength in np.exp(STRENGTHS):
            mean = point_amplitude(strength, tx[p], rx[p], RADIO)
            spread = np.hypot(std[p], CONSTANTS.law * mean)
            as_scatterer[p] += np.prod([rice(a, mean, spread) for a in amplitude[:, p]]) / len(STRENGTHS)
        for a, means in zip(amplitude[:, p], np.abs(gain[:, p]), strict=True):
            as_panel[p] *= np.mean([rice(a, mean, np.hypot(std[p], CONSTANTS.law * mean)) for mean in means])
    whole = np.prod(as_scatterer)
    joint = np.array([whole / as_scatterer[p] * as_panel[p] for p in range(points)] + [whole])
    return (joint / joint.sum())[:-1]


@pytest.mark.parametrize("seed", [1, 2])
def test_posterior_equals_brute_force_bayes(seed):
    """Float rounding only: the trapezoidal rule over a period is exact to it. No cycle's ratio may be clipped."""
    data = _data(seed)
    steps = np.diff([_filtered(data[0][:k], data[1][:k], *data[2:]) for k in range(5)], axis=0)
    assert np.abs(steps).max() < CONSTANTS.max_log_ratio
    expected = _brute_force(*data)
    assert panel_probabilities(_filtered(*data)) == pytest.approx(expected, rel=1e-8)


def test_landmarks_have_no_order():
    amplitude, gain, tx, rx, std = _data(5)
    whole = panel_probabilities(_filtered(amplitude, gain, tx, rx, std))
    for order in map(list, permutations(range(3))):
        other = panel_probabilities(_filtered(amplitude[:, order], gain[:, order], tx[order], rx[order], std[order]))
        assert other == pytest.approx(whole[order], rel=1e-10)


def test_changing_codes_find_the_panel_where_a_held_one_cannot():
    """A sphere as strong as the panel under the held code, both measured without error."""
    rng = np.random.default_rng(8)
    center, tx, rx = np.array([3.0, 3.0, 3.0]), np.array([2.1, 2.6, 0.5]), np.array([2.2, 2.65, 0.5])
    lengths = [np.array([np.linalg.norm(center - end)] * 2) for end in (tx, rx)]
    std = np.full(2, 1e-7)
    odds = {}
    for held in (True, False):
        codes = [RisCode(rng.integers(4, size=(6, 6)), 4) for _ in range(20)]
        codes = [codes[0]] * 20 if held else codes
        gain = np.array([panel_path_gain(PANEL, c, center, tx, rx, np.ones(1), RADIO)[0] for c in codes])
        seen = np.abs(np.stack([np.full(20, gain[0]), gain], axis=1))
        odds[held] = _filtered(seen, np.repeat(gain[:, None, None], 2, axis=1), *lengths, std)
    assert odds[True][0] == pytest.approx(odds[True][1], abs=1e-9)
    assert odds[False][1] > 10.0 > 0.0 > odds[False][0]


def test_empty_map_has_no_probabilities():
    assert panel_probabilities(np.zeros(0)).shape == (0,)


def test_a_long_gap_tells_no_more_than_its_beginning():
    """What is blocked is silent, be it the panel or not: of a scatterer that should show, silence must not make one."""
    hidden, odds, missed = np.zeros((1, 2)), [0.0], np.array([[1.0, 0.1]])
    for _ in range(200):
        hidden, surplus = weigh_silence(hidden, missed)
        odds.append(odds[-1] + float(surplus[0, 0]))
    assert odds[1] == pytest.approx(-np.log(CONSTANTS.rare + (1.0 - CONSTANTS.rare) * 0.1))
    assert odds[100] == pytest.approx(odds[-1], abs=1e-6)
    assert odds[-1] < -np.log(CONSTANTS.rare)
    assert weigh_silence(np.zeros((1, 2)), np.array([[0.3, 0.3]]))[1][0, 0] == pytest.approx(0.0)
