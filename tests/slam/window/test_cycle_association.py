"""The cycle's assignment: looking only at what is within reach changes nothing; tracks beside a panel's path."""

import numpy as np
import pytest

from rislam_rt.slam.observations import UNTOLD, Observations, side_of
from rislam_rt.slam.predicted_returns import Poses
from rislam_rt.slam.window import cycle_association, tracks
from rislam_rt.slam.window.cycle_association import _absorbed, _rivals, echoes
from rislam_rt.slam.window.landmarks.horizon_detection import elevations, nothing_heard, prior_tilts
from rislam_rt.slam.window.landmarks.measurement_prediction import ExpectedComponents
from rislam_rt.slam.window.landmarks.unresolved_clusters import cluster
from rislam_rt.slam.window.smoother.attitude import first_levels

CELL = np.array([0.3, 0.5, 0.5])


def test_returns_out_of_reach_change_nothing(monkeypatch):
    count, heard = 80, 40
    rng = np.random.default_rng(5)
    seen = rng.uniform([1.0, -1.0, -1.0], [12.0, 1.0, 1.0], (count, 3))
    root = 0.002 * rng.standard_normal((10, 10))
    expected = ExpectedComponents(
        np.column_stack([np.arange(count), np.full((count, 4), -1)]), seen, rng.standard_normal((count, 3, 10)),
        rng.uniform(-12.0, -9.0, count), np.full(count, 0.2), np.zeros(count), np.ones(count),
        elevations(np.ones(count), np.zeros(count), seen[:, 1:]),
    )  # fmt: skip
    std, own = np.full((heard, 3), 0.01), np.arange(heard)
    level = expected.log_amplitude[own] + 0.1 * rng.standard_normal(heard)
    place, one = seen[own] + 0.02 * rng.standard_normal((heard, 3)), np.ones(heard)
    observed = Observations(place, std, level, 0.1 * one, one)
    groups, tilts = cluster(expected, CELL, np.ones(count)), prior_tilts(first_levels(compass=True))
    size, none = len(groups.leader), np.zeros(0, dtype=np.int64)
    view = cycle_association.CycleAssociation(
        np.zeros(10), root @ root.T, Poses(*np.zeros((2, 3)), np.zeros(())), expected, groups, np.ones(count),
        np.ones(count), nothing_heard(count), tilts, np.ones(count), np.full(size, 0.9), groups.disturbance,
        np.full(size, UNTOLD), np.zeros(size, dtype=np.bool_), np.zeros((size, heard)), none, none, 0.0, 0.0,
    )  # fmt: skip
    given = view, seen, root @ root.T, observed, np.full(heard, 1e-3)
    near = cycle_association._associate(*given)
    looked, within = [], cycle_association.within_reach

    def look(*given):
        looked.append(within(*given)[0])
        return np.indices((size, heard)).reshape(2, -1)

    monkeypatch.setattr(cycle_association, "within_reach", look)
    every = cycle_association._associate(*given)
    assert len(np.unique(looked[0])) < 0.8 * size
    assert len(near[0]) > heard // 2
    np.testing.assert_array_equal(near[0], every[0])
    np.testing.assert_array_equal(near[1], every[1])
    np.testing.assert_allclose(near[2:], every[2:], rtol=1e-12)


def _ceiling(level):
    """Track of a path that the map lacks, heard in each of 20 cycles, and its next component."""
    seen, std = np.array([[5.0, 0.0, 0.0]]), np.array([[0.002, 0.008, 0.008]])
    observed = Observations(seen, std, np.full(1, level), np.full(1, 0.05), np.ones(1))
    found, _ = tracks.start(tracks.no_tracks(), observed, np.array([0]), np.full((1, 3), 0.1), 0)
    found = found._replace(hits=np.full(1, 20), last=np.full(1, 19), log_ris=np.full((1, 1), -30.0))
    found = found._replace(covariance=np.tile(1e-6 * np.eye(2), (1, 3, 1, 1)))
    return tracks.continuations(found, observed, np.zeros((1, 3)), 20)


def test_a_louder_track_absorbs_the_panel_in_its_cell_and_claims_its_own_component():
    count = 3
    seen = np.array([[5.1, 0.1, 0.0], [5.1, 0.7, 0.0], [7.0, 0.0, 0.0]])  # in the track's cell, across, behind
    expected = ExpectedComponents(
        np.full((count, 5), -1), seen, np.zeros((count, 3, 10)), np.full(count, -10.0), np.full(count, 0.2),
        np.zeros(count), np.ones(count), elevations(np.ones(count), np.zeros(count), seen[:, 1:]),
    )  # fmt: skip
    groups = cluster(expected, CELL, np.ones(count))
    beside, rows = _ceiling(-9.0), np.arange(count)
    alone = np.empty(count)
    alone[groups.leader] = _absorbed(groups, expected, rows, beside, CELL).by_itself
    np.testing.assert_allclose(alone, [1.0 - 21.0 / 22.0, 1.0, 1.0], atol=1e-9)
    assert (_absorbed(groups, expected, rows, _ceiling(-11.0), CELL).by_itself == 1.0).all()
    more = _rivals(np.array([True, False, True]), np.full(1, 1e-3), beside)
    assert (more[[0, 2]] > 10.0).all()
    assert (more[1] == 0.0).all()
    assert (_rivals(np.ones(count, dtype=np.bool_), np.full(1, 1e-3), None) == 0.0).all()


@pytest.mark.parametrize(
    ("odds", "fainter", "gone"),
    [
        ((0.3, -0.3), 0.8, [False, True]),  # either is what motion leaves of the other
        ((-9.0, 9.0), 3.0, [False, False]),  # a wall's return, and the panel's beside it
        ((-9.0, 1.5), 3.0, [False, False]),  # likelier the panel's than not, beside a ceiling's that is far louder
        ((-9.0, -9.0), 0.8, [False, False]),  # two paths apart: an echo is fainter by more
        ((-9.0, -9.0), 1.5, [False, True]),
    ],
)
def test_of_two_components_of_one_cell_neither_of_which_is_known_to_be_the_panels_one_is_an_echo(odds, fainter, gone):
    odds = np.array(odds)
    seen, wide = np.array([[6.0, 0.2, 0.1], [6.02, 0.21, 0.1]]), np.full(2, 0.01)
    probability = 1.0 / (1.0 + np.exp(-odds))
    observed = Observations(
        seen, np.full((2, 3), 0.01), np.array([0.0, -fainter]), wide, np.ones(2), *side_of(probability)
    )
    np.testing.assert_array_equal(echoes(observed, CELL), gone)
    apart = observed._replace(seen=seen + np.array([[0.0], [0.5]]) * [1.0, 0.0, 0.0])
    assert not echoes(apart, CELL).any()
