"""Directions in which paths come in, by which the rates of their lengths tell of the motion."""

from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.measurement_log import empty_log
from rislam_rt.slam.window.motion import motion_agreement
from rislam_rt.slam.window.motion.length_rates import Heard, lengths, rates


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


def _paths_heard(beside: list[np.ndarray]):
    """Lengths of tracks to the west, each with what is beside its own, in the last of eleven cycles as it is long."""
    parts = [_wall_heard(np.zeros(len(one)), np.full((len(one), 2), 0.003)) for one in beside]
    for number, (log, one) in enumerate(zip(parts, beside, strict=True)):
        log.seen[:, 0] += one
        log.cycle[:] += 11 - len(one)
        log.track[:] = number
    joined = empty_log()._replace(
        **{name: np.concatenate([getattr(log, name) for log in parts]) for name in empty_log()._fields}
    )
    order = np.argsort(joined.cycle, kind="stable")
    return lengths(Heard(joined.take(order), np.zeros(11), np.zeros((11, 3)), 0.1, np.zeros(3), 0.5))


def test_each_path_has_the_scatter_that_it_shows_itself():
    """Three components, five, which are too few for a rate, eleven that hop, and eleven that do not."""
    hops = np.random.default_rng(5).normal(0.0, 0.1, 11)
    found = _paths_heard([hops[:3], hops[:5], hops, np.zeros(11)])
    plain, scattered = rates(found), rates(found, scattered=True)
    assert scattered.number == 2
    ratio = scattered.variance / plain.variance
    assert ratio[np.argmax(np.abs(plain.rate))] > 100.0
    assert ratio[np.argmin(np.abs(plain.rate))] == 1.0


def test_a_motion_that_is_no_quadratic_is_no_scatter_where_the_positions_follow_it():
    time = 0.1 * np.arange(11)
    place = np.stack([0.1 * np.sin(15.0 * time), np.zeros(11), np.zeros(11)], axis=1)
    log = _wall_heard(np.zeros(11), np.full((11, 2), 0.003))
    log.seen[:, 0] += 2.0 * place[:, 0]
    found = lengths(Heard(log, np.zeros(11), place, 0.1, np.zeros(3), 0.5))
    np.testing.assert_allclose(rates(found, scattered=True).variance, rates(found).variance)


def test_another_motion_is_asked_for_by_paths_as_they_scatter_and_births_by_paths_as_they_fit(monkeypatch):
    asked = []
    monkeypatch.setattr(motion_agreement, "_lengths", lambda *given: given)
    monkeypatch.setattr(motion_agreement, "is_checked", lambda state: True)
    monkeypatch.setattr(
        motion_agreement.length_rates, "rates", lambda found, scattered=False: asked.append(scattered) or NOTHING
    )
    window = SimpleNamespace(step=np.full(10, 0.1), turns=False)
    state = SimpleNamespace(window=window)
    assert motion_agreement.log_other_motion(state) == 0.0
    assert motion_agreement.log_agreement(state, window) == 0.0
    assert asked == [True, False]


NOTHING = SimpleNamespace(number=0)
