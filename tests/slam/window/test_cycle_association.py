"""The cycle's assignment: looking only at what is within reach changes nothing."""

import numpy as np

from rislam_rt.slam.observations import UNTOLD, Observations
from rislam_rt.slam.predicted_returns import Poses
from rislam_rt.slam.window import cycle_association
from rislam_rt.slam.window.horizon_detection import elevations, nothing_heard, prior_tilts
from rislam_rt.slam.window.landmarks.measurement_prediction import ExpectedComponents, cluster
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
        np.full(size, UNTOLD), none, none, 0.0, 0.0,
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
