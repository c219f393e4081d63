"""Which expected returns come out as one: against the definition, pair by pair."""

import numpy as np
import pytest

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.landmarks.horizon_detection import elevations
from rislam_rt.slam.window.landmarks.measurement_prediction import ExpectedComponents
from rislam_rt.slam.window.landmarks.unresolved_clusters import cluster, conditioned_share
from rislam_rt.slam.window.solver_limits import EDGE

CELL = np.array([0.3, 0.5, 0.5])


def returns(count, *, rng):
    forms = np.column_stack([np.arange(count), np.full((count, 4), -1)])
    seen = rng.uniform([0.0, -1.0, -1.0], [4.0, 1.0, 1.0], (count, 3))
    level = np.round(rng.uniform(-12.0, -9.0, count), 1)  # some are equally strong
    return ExpectedComponents(
        forms, seen, np.zeros((count, 3, 7)), level, np.full(count, 0.2), np.zeros(count), np.ones(count),
        elevations(np.ones(count), np.zeros(count), seen[:, 1:]),
    )  # fmt: skip


@pytest.mark.parametrize("told", [False, True])
def test_the_strongest_of_a_cell_takes_in_the_others(told):
    count = 60
    rng = np.random.default_rng(3)
    expected, clear = returns(count, rng=rng), rng.uniform(0.2, 1.0, count)
    sides = rng.integers(2, size=count) if told else None
    groups = cluster(expected, CELL, clear, sides)
    strength, power = expected.log_amplitude, np.exp(2.0 * expected.log_amplitude)

    def reach(one, other, cells):
        apart = np.abs(expected.seen[one] - expected.seen[other]) / CELL
        alike = sides is None or sides[one] == sides[other]
        return one != other and alike and (apart < cells).all() and strength[other] <= strength[one]

    taken, partner, alone, total = set(), np.full(count, -1), np.ones(count), power.copy()
    for leader in np.argsort(-strength, kind="stable"):
        members = [i for i in range(count) if i not in taken and reach(leader, i, 1.0)]
        if leader not in taken and members:
            taken |= set(members)
            partner[leader] = max(members, key=lambda i: strength[i])
            alone[members] = max(1.0 - clear[leader], CONSTANTS.rare)
            total[leader] += power[members].sum()
    disturbance = np.zeros((count, 3))
    for one in set(range(count)) - taken:
        for other in range(count):
            if reach(one, other, EDGE) and other != partner[one]:
                ratio = 0.5 * power[other] / power[one] * clear[other]
                disturbance[one] += ratio * (expected.seen[other] - expected.seen[one]) ** 2
    led = np.array([i for i in range(count) if i not in taken] + sorted(taken))
    assert 10 < len(taken) < count - 10
    assert (disturbance > 0.0).any()
    np.testing.assert_array_equal(groups.leader, led)
    np.testing.assert_array_equal(groups.partner, np.where(np.isin(led, list(taken)), -1, partner[led]))
    np.testing.assert_array_equal(groups.by_itself, alone[led])
    np.testing.assert_allclose(groups.disturbance, disturbance[led], rtol=1e-12)
    whole = np.where(np.isin(led, list(taken)), strength[led], 0.5 * np.log(total[led]))
    np.testing.assert_allclose(groups.log_amplitude, whole, rtol=1e-12)


def pair(clear):
    """Two returns of one cell, the weaker by a fifth, and the probabilities that nothing occludes them."""
    forms = np.array([[-1, -1, -1, 0, -1], [-1, -1, -1, 1, -1]])
    seen = np.array([[4.0, 0.1, 0.2], [4.2, 0.3, 0.1]])
    expected = ExpectedComponents(
        forms, seen, np.zeros((2, 3, 7)), np.log([1.0, 0.8]), np.full(2, 0.2), np.zeros(2), np.ones(2),
        elevations(np.ones(2), np.zeros(2), seen[:, 1:]),
    )  # fmt: skip
    return expected, cluster(expected, CELL, np.array([0.9, clear]))


def test_a_partner_that_may_be_silent_has_the_share_of_a_mixture():
    """Mean and variance of a share that is drawn as the partner is heard, or 0 where it is not; 4 standard errors."""
    _, sure = pair(1.0)
    _, groups = pair(0.3)
    rng, count = np.random.default_rng(2), 200_000
    drawn = sure.share[0] + np.sqrt(sure.share_variance[0]) * rng.standard_normal(count)
    drawn *= rng.random(count) < groups.presence[0]
    mean, variance = (field[0] for field in groups.mean_share())
    assert groups.presence[0] == pytest.approx(0.3)
    assert mean == pytest.approx(drawn.mean(), abs=4.0 * drawn.std() / np.sqrt(count))
    assert variance == pytest.approx(drawn.var(), abs=4.0 * (drawn**2).std() / np.sqrt(count))


def test_a_partner_that_is_not_heard_moves_nothing():
    expected, groups = pair(0.3)
    row, level = np.array([0]), np.array([0.1])
    share, variance = conditioned_share(groups, expected, row, level, np.array([0.02]), np.array([0.0]))
    assert share[0] == variance[0] == 0.0
    heard = conditioned_share(groups, expected, row, level, np.array([0.02]), np.array([1.0]))
    half = conditioned_share(groups, expected, row, level, np.array([0.02]), np.array([0.5]))
    assert half[0][0] == pytest.approx(0.5 * heard[0][0])
    assert half[1][0] == pytest.approx(0.5 * (heard[1][0] + heard[0][0] ** 2) - half[0][0] ** 2)
