"""Directions in which paths come in, by which the rates of their lengths tell of the motion."""

import numpy as np
import pytest

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.divergence.length_rates import Heard, lengths, rates
from rislam_rt.slam.window.measurement_log import empty_log


def _wall_heard(heading, std):
    """One track's log: a wall to the west of an agent at rest, by cosines in its own axes under each heading."""
    count = len(heading)
    seen = np.stack([np.full(count, 2.4), -np.cos(heading), np.sin(heading)], axis=1)
    log = empty_log()
    zeros = {name: np.zeros((count, *getattr(log, name).shape[1:]), getattr(log, name).dtype) for name in log._fields}
    deviations = np.column_stack([np.full(count, 1e-3), std])
    form = zeros["form"] - 9  # no path of the map
    return log._replace(**{**zeros, "seen": seen, "std": deviations, "cycle": np.arange(count), "form": form})


@pytest.mark.parametrize("turned", [1, 3, 5])
def test_a_wall_at_the_end_of_the_array_lies_where_it_lay_before_the_agent_turned(turned):
    """Along its own line the array hears both ends alike; `turned` cycles of eight are under headings that tell."""
    heading = np.zeros(8)
    heading[:turned] = np.linspace(0.8, 0.4, turned)
    std = np.full((8, 2), 0.003)
    std[turned:, 0] = 1.2
    log = _wall_heard(heading, std)
    log.seen[turned::2, 1] *= -1.0  # the one end or the other
    found = lengths(Heard(log, heading, np.zeros((8, 3)), 0.1, np.zeros(3), 0.5))
    west = np.argmin(np.abs(found.toward[:, 0] - 2.0))
    np.testing.assert_allclose(found.toward[west], [2.0, 0.0, 0.0], atol=0.02)
    assert found.blur[west] < 0.01
    # the other end, if it is asked about at all, is not believed to be sure of its direction
    others = np.arange(len(found.blur)) != west
    assert (found.blur[others] > 0.2).all()


def test_directions_count_by_how_sure_they_are():
    """Four of 0.003 and four of 0.3 that err by as much: the mean is that of the four, and so is its deviation."""
    std = np.repeat([[0.003], [0.3]], 4, axis=0) * np.ones(2)
    log = _wall_heard(np.full(8, 0.8), std)
    log.seen[4:, 1] += 0.3
    found = lengths(Heard(log, np.full(8, 0.8), np.zeros((8, 3)), 0.1, np.zeros(3), 0.5))
    np.testing.assert_allclose(found.toward[0], [2.0, 0.0, 0.0], atol=0.05)
    assert found.blur[0] == pytest.approx(2.0 * 0.003 / 2.0, rel=0.1)


@pytest.mark.parametrize("count", [6, 11])
def test_a_path_that_hops_within_its_cell_has_no_rate_and_one_that_speeds_up_has(count):
    """By hand: the mean square about a quadratic, with what is expected beforehand as `memory` components."""
    log = _wall_heard(np.zeros(count), np.full((count, 2), 0.003))
    time = 0.1 * np.arange(count)
    hops = np.random.default_rng(2).normal(0.0, 0.1, count)
    for beside in (0.5 * time**2, hops):
        one = log._replace(seen=log.seen + beside[:, None] * [1.0, 0.0, 0.0])
        found = lengths(Heard(one, np.zeros(count), np.zeros((count, 3)), 0.1, np.zeros(3), 0.5))
        plain, scattered = rates(found), rates(found, scattered=True)
        np.testing.assert_array_equal(scattered.rate, plain.rate)
        left = beside - np.polyval(np.polyfit(time, beside, 2), time)
        square = np.maximum(np.sum(left**2) / 1e-6 / (count - 3), 1.0)
        shown = (CONSTANTS.memory * CONSTANTS.crowd + (count - 3) * square) / (CONSTANTS.memory + count - 3)
        expected = np.maximum(shown / CONSTANTS.crowd, 1.0)
        np.testing.assert_allclose(scattered.variance / plain.variance, expected, rtol=1e-6)
        assert (expected > 100.0) == (beside is hops)
