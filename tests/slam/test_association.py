"""Association: the assignment against brute force, its gates, tracks that give way, and what comes out as one."""

from itertools import product

import numpy as np
import pytest

from rislam_rt.arrays import Floats
from rislam_rt.slam.associate import Candidates, associate, inverse_3x3, pair_costs
from rislam_rt.slam.nested.candidates import (
    PredictedMeasurements,
    UnresolvedGroups,
    candidates,
    hidden_tracks,
    merge_returns,
)
from rislam_rt.slam.nested.measurement_prediction import ExpectedReturns
from rislam_rt.slam.nested.tracks import LandmarkTracks, begin, no_tracks
from rislam_rt.slam.observations import OTHER, PANEL, UNTOLD, Observations
from rislam_rt.slam.returns import NONE, Returns

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
    )


def observed(seen: Floats, log_amplitude: Floats, std: float = 0.02) -> Observations:
    """Measurements as the filter looks at them."""
    count = len(seen)
    return Observations(
        seen, np.full((count, 3), std), log_amplitude, np.full(count, 0.1), np.ones(count), np.zeros(count)
    )


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
        chosen = associate(found, seen, GATE, CLUTTER)
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
    found = Candidates(
        np.zeros((1, 3)), 1e-4 * np.eye(3)[None], np.zeros(1), np.full(1, 0.05), np.zeros(1), np.full(1, UNTOLD)
    )  # fmt: skip
    for factor, paired in ((0.99, True), (1.01, False)):
        seen, fade = np.zeros((1, 3)), np.zeros(1)
        if axis < 3:
            seen[0, axis] = factor * np.sqrt(GATE * (1e-4 + 0.02**2))
        else:
            fade[0] = factor * np.sqrt(GATE * (0.05**2 + 0.1**2))
        # clutter is made so rare that only the gate stands between the two
        assert (associate(found, observed(seen, fade), GATE, 1e-9)[0] == 0) == paired


def test_nothing_to_assign() -> None:
    rng = np.random.default_rng(1)
    none = observed(np.zeros((0, 3)), np.zeros(0))
    np.testing.assert_array_equal(associate(draw_candidates(3, rng=rng), none, GATE, CLUTTER), [-1, -1, -1])
    empty = Candidates._make(field[:0] for field in draw_candidates(1, rng=rng))
    assert len(associate(empty, observed(np.zeros((2, 3)), np.zeros(2)), GATE, CLUTTER)) == 0


def test_small_inverses(rng: np.random.Generator) -> None:
    root = rng.normal(size=(20, 3, 3))
    matrix = root @ np.swapaxes(root, 1, 2) + 0.1 * np.eye(3)
    inverse, log_det = inverse_3x3(matrix)
    # condition numbers up to 1e3: rounding below 1e-12
    np.testing.assert_allclose(inverse, np.linalg.inv(matrix), rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(log_det, np.linalg.slogdet(matrix)[1], atol=1e-12)


def outlook(seen: Floats, log_amplitude: Floats) -> PredictedMeasurements:
    """Returns that are expected there, and merge with nothing."""
    count = len(seen)
    legs = np.stack([np.arange(count), np.full(count, NONE), np.full(count, NONE)], axis=1)
    rows, ones = np.arange(count), np.ones(count, dtype=np.bool_)
    alone = UnresolvedGroups(np.full(count, -1), ~ones, np.zeros((count, 3)), ~ones)
    expected = ExpectedReturns(
        Returns(legs, rows, rows), log_amplitude, np.full(count, 0.2), 0 * rows, rows, ones, np.full(count, -1), ones
    )
    spread = np.tile(1e-4 * np.eye(3), (count, 1, 1))
    cell = np.array([0.3, 0.5, 0.5])
    return PredictedMeasurements(
        expected, seen, spread, log_amplitude, np.full(count, 0.2), ones, alone, cell, np.full(count, UNTOLD)
    )


def follow(seen: Floats, log_amplitude: Floats, shine: Floats, side: int = UNTOLD) -> LandmarkTracks:
    """Tracks at some places."""
    count = len(seen)
    fields = {name: np.zeros((count, *field.shape[1:]), field.dtype) for name, field in no_tracks(4)._asdict().items()}
    mean = np.stack([seen, np.zeros((count, 3))], axis=-1)
    spread = np.tile(1e-4 * np.eye(2), (count, 3, 1, 1))
    return LandmarkTracks(
        **{**fields, "mean": mean, "covariance": spread, "log_amplitude": log_amplitude, "shine": shine,
           "side": np.full(count, side)}
    )  # fmt: skip


def test_tracks_behind_an_expected_return_give_way() -> None:
    """One on it, one on it but ten times stronger, one on it but a wall return, one elsewhere."""
    place = np.array([3.0, 0.2, 0.1])
    ahead = outlook(place[None], np.zeros(1))
    tracks = follow(
        np.stack([place, place, place, place + 0.2]), np.array([0.0, 2.3, 0.0, 0.0]), np.array([0.0, 0.0, 1.0, 0.0])
    )
    hidden = hidden_tracks(ahead, tracks, GATE)
    np.testing.assert_array_equal(hidden, [True, False, False, False])
    # and a hidden one gets nothing, even where it fits better than the return
    found = candidates(ahead, tracks, hidden)
    chosen = associate(found, observed(place[None], np.zeros(1)), GATE, CLUTTER)
    assert chosen[0] == 0
    assert chosen[1] == -1


def _expected(strength: Floats) -> ExpectedReturns:
    return outlook(np.zeros((len(strength), 3)), np.log(strength)).expected


def test_reciprocals_come_out_halfway_and_shift_nothing() -> None:
    """A pair in one cell names each other's place; alone in its cell it is disturbed by nobody."""
    place = np.array([[5.0, 0.1, 0.1], [5.05, 0.12, 0.1], [9.0, 0.1, 0.1]])
    expected = _expected(np.array([1.0, 1.0, 1.0]))._replace(twin=np.array([1, 0, -1]))
    groups = merge_returns(place, expected, no_tracks(4), np.array([0.3, 0.5, 0.5]), np.full(len(place), UNTOLD))
    leader = int(np.flatnonzero(~groups.absorbed[:2])[0])
    assert groups.partner[leader] == 1 - leader
    assert groups.partner[2] == -1
    assert not groups.absorbed[2]
    np.testing.assert_array_equal(groups.disturbance[[leader, 2]], 0.0)


def test_disturbance_is_what_random_phases_make_of_a_weaker_path() -> None:
    """Root mean square of Re sum alpha_i conj(alpha) z_i / |alpha|^2 over phases, by drawing 20 000 of them.

    To first order in the amplitude ratio 0.2, so that the next order leaves (0.2)^2 = 4 %; the draws add 1 %.
    """
    rng = np.random.default_rng(3)
    place = np.array([[5.0, 0.1, 0.1], [5.1, 0.2, 0.05]])
    groups = merge_returns(
        place, _expected(np.array([1.0, 0.2])), no_tracks(4), np.array([0.3, 0.5, 0.5]), np.full(2, UNTOLD)
    )
    gain = np.stack([np.ones(20_000, complex), 0.2 * np.exp(2j * np.pi * rng.uniform(size=20_000))])
    total = gain.sum(axis=0)
    came = np.einsum("pn,pa->na", (gain * total.conj()).real / np.abs(total) ** 2, place)
    np.testing.assert_allclose(groups.disturbance[0], np.sqrt(np.mean((came - place[0]) ** 2, axis=0)), rtol=0.06)


@pytest.mark.parametrize(
    ("mine", "other", "paired"), [(PANEL, OTHER, False), (PANEL, PANEL, True), (UNTOLD, OTHER, True)]
)
def test_what_runs_over_the_panel_is_not_paired_with_what_does_not(mine: int, other: int, paired: bool) -> None:
    found = Candidates(
        np.zeros((1, 3)), 1e-4 * np.eye(3)[None], np.zeros(1), np.full(1, 0.05), np.zeros(1), np.full(1, mine)
    )
    seen = observed(np.zeros((1, 3)), np.zeros(1))._replace(side=np.full(1, other))
    assert (associate(found, seen, GATE, 1e-9)[0] == 0) == paired


def test_under_alternated_codes_the_panel_merges_with_nothing_else() -> None:
    """Three in one cell: the weaker of one side is taken in, and neither side shifts or outshines the other."""
    place = np.array([[5.0, 0.0, 0.0], [5.05, 0.1, 0.0], [5.1, 0.0, 0.1]])
    expected, cell = _expected(np.array([3.0, 1.0, 0.2])), np.array([0.3, 0.5, 0.5])
    apart = merge_returns(place, expected, no_tracks(4), cell, np.array([OTHER, PANEL, PANEL]))
    np.testing.assert_array_equal(apart.absorbed, [False, False, True])
    np.testing.assert_array_equal(apart.outshone, [False, False, True])
    np.testing.assert_array_equal(apart.disturbance[0], 0.0)
    together = merge_returns(place, expected, no_tracks(4), cell, np.full(3, UNTOLD))
    np.testing.assert_array_equal(together.absorbed, [False, True, True])


def test_a_track_keeps_the_side_of_its_measurements() -> None:
    place = np.array([[3.0, 0.2, 0.1], [4.0, 0.0, 0.0]])
    seen = observed(place, np.zeros(2))._replace(side=np.array([PANEL, OTHER]))
    dull = np.zeros(2, dtype=np.bool_)
    tracks = begin(no_tracks(4), seen, np.arange(2), dull, np.full(3, 0.1), 0)
    np.testing.assert_array_equal(tracks.side, [PANEL, OTHER])
    np.testing.assert_array_equal(hidden_tracks(outlook(place, np.zeros(2)), tracks, GATE), [True, True])
    known = outlook(place, np.zeros(2))._replace(side=np.array([OTHER, OTHER]))
    np.testing.assert_array_equal(hidden_tracks(known, tracks, GATE), [False, True])
