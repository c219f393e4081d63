"""GOSPA against its definition, searched over all assignments, and against the laws of a metric."""

from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from rislam_rt.errors import ConfigError
from rislam_rt.evaluate import gospa, match_points

POINTS = st.integers(0, 4).flatmap(
    lambda count: arrays(np.float64, (count, 2), elements=st.floats(-2.0, 2.0, width=32))
)


def by_assignments(first, second, cutoff, order):
    """GOSPA (alpha = 2) by its definition: the best of all partial assignments, `c^p / 2` for each point left out."""
    rest = cutoff**order / 2.0
    costs = [
        sum(np.linalg.norm(first[i] - second[j]) ** order for i, j in zip(rows, columns, strict=True))
        + rest * (len(first) + len(second) - 2 * pairs)
        for pairs in range(min(len(first), len(second)) + 1)
        for rows in combinations(range(len(first)), pairs)
        for columns in permutations(range(len(second)), pairs)
    ]
    return min(costs) ** (1.0 / order)


@given(POINTS, POINTS, st.sampled_from([1.0, 2.0]))
def test_gospa_is_its_definition(first, second, order):
    score = gospa(first, second, cutoff=1.0, order=order)
    assert score.distance == pytest.approx(by_assignments(first, second, 1.0, order), abs=1e-9)
    left = 0.5 * (score.missed + score.false)
    assert score.distance**order == pytest.approx(score.localisation**order + left, abs=1e-9)


@given(POINTS, POINTS, POINTS)
def test_gospa_is_a_metric(first, second, third):
    ab, ba = gospa(first, second).distance, gospa(second, first).distance
    assert ab == pytest.approx(ba, abs=1e-9)
    assert gospa(first, first).distance == 0.0
    assert ab <= gospa(first, third).distance + gospa(third, second).distance + 1e-9


def test_gospa_names_the_missed_and_the_false():
    truth = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    estimate = np.array([[0.3, 0.0, 0.0], [9.0, 0.0, 0.0], [7.0, 7.0, 0.0]])
    score = gospa(estimate, truth, cutoff=1.0, order=2.0)
    assert (score.missed, score.false) == (1, 2)
    assert score.localisation == pytest.approx(0.3)
    assert score.distance == pytest.approx(np.sqrt(0.09 + 1.5))


def test_gospa_falls_when_a_false_point_goes():
    truth, false = np.array([[0.0, 0.0, 0.0]]), np.array([[50.0, 0.0, 0.0]])
    assert gospa(false, truth).distance == 1.0
    assert gospa(np.zeros((0, 3)), truth).distance == pytest.approx(np.sqrt(0.5))
    assert gospa(np.zeros((0, 3)), np.zeros((0, 3))).distance == 0.0


def test_matching_pairs_as_many_as_it_can():
    truth = np.array([[0.0, 0.0], [1.0, 0.0], [9.0, 9.0]])
    estimate = np.array([[0.9, 0.0], [1.9, 0.0]])
    # the nearest pair alone (0.9 with 1.0) would leave the other estimate 1.9 m from its point
    np.testing.assert_array_equal(match_points(estimate, truth, cutoff=1.0), [0, 1, -1])
    np.testing.assert_array_equal(match_points(np.zeros((0, 2)), truth), [-1, -1, -1])


def test_senseless_cutoffs_are_refused():
    with pytest.raises(ConfigError, match="cutoff"):
        gospa(np.zeros((1, 3)), np.zeros((1, 3)), cutoff=0.0)
