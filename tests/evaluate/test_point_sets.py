"""OSPA and GOSPA against their definitions, searched over all permutations, and against the laws of a metric."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rislam_rt.errors import ConfigError
from rislam_rt.evaluate import gospa, match_points, ospa

POINTS = st.integers(0, 4).flatmap(
    lambda count: arrays(np.float64, (count, 2), elements=st.floats(-2.0, 2.0, width=32))
)


def by_permutations(first, second, cutoff, order):
    """OSPA by its definition: the best permutation of the larger set."""
    small, large = sorted((first, second), key=len)
    if not len(large):
        return 0.0
    costs = [
        sum(min(np.linalg.norm(small[i] - large[j]), cutoff) ** order for i, j in enumerate(choice))
        for choice in permutations(range(len(large)), len(small))
    ]
    return ((min(costs) + cutoff**order * (len(large) - len(small))) / len(large)) ** (1.0 / order)


@given(POINTS, POINTS, st.sampled_from([1.0, 2.0]))
def test_ospa_is_its_definition(first, second, order):
    score = ospa(first, second, cutoff=1.0, order=order)
    assert score.distance == pytest.approx(by_permutations(first, second, 1.0, order), abs=1e-9)
    assert score.distance**order == pytest.approx(score.localisation**order + score.cardinality**order, abs=1e-9)


@given(POINTS, POINTS, POINTS)
def test_both_are_metrics(first, second, third):
    for metric in (ospa, gospa):
        ab, ba = metric(first, second).distance, metric(second, first).distance
        assert ab == pytest.approx(ba, abs=1e-9)
        assert metric(first, first).distance == 0.0
        assert ab <= metric(first, third).distance + metric(third, second).distance + 1e-9


def test_empty_against_anything_costs_the_cutoff():
    """Schuhmacher, Vo and Vo define the distance to the empty set as c."""
    assert ospa(np.zeros((0, 3)), np.ones((4, 3)), cutoff=2.5).distance == pytest.approx(2.5)
    assert ospa(np.zeros((0, 3)), np.zeros((0, 3))).distance == 0.0


def test_gospa_names_the_missed_and_the_false():
    truth = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    estimate = np.array([[0.3, 0.0, 0.0], [9.0, 0.0, 0.0], [7.0, 7.0, 0.0]])
    score = gospa(estimate, truth, cutoff=1.0, order=2.0)
    assert (score.missed, score.false) == (1, 2)
    assert score.localisation == pytest.approx(0.3)
    assert score.distance == pytest.approx(np.sqrt(0.09 + 1.5))


def test_gospa_falls_when_a_false_point_goes_and_ospa_need_not():
    """The point of GOSPA: in OSPA a false point beside a badly missed one costs nothing more."""
    truth, false = np.array([[0.0, 0.0, 0.0]]), np.array([[50.0, 0.0, 0.0]])
    assert ospa(false, truth).distance == ospa(np.zeros((0, 3)), truth).distance
    assert gospa(false, truth).distance > gospa(np.zeros((0, 3)), truth).distance


def test_matching_pairs_as_many_as_it_can():
    truth = np.array([[0.0, 0.0], [1.0, 0.0], [9.0, 9.0]])
    estimate = np.array([[0.9, 0.0], [1.9, 0.0]])
    # the nearest pair alone (0.9 with 1.0) would leave the other estimate 1.9 m from its point
    np.testing.assert_array_equal(match_points(estimate, truth, cutoff=1.0), [0, 1, -1])
    np.testing.assert_array_equal(match_points(np.zeros((0, 2)), truth), [-1, -1, -1])


def test_senseless_cutoffs_are_refused():
    with pytest.raises(ConfigError, match="cutoff"):
        ospa(np.zeros((1, 3)), np.zeros((1, 3)), cutoff=0.0)
