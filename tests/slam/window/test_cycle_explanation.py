"""Weights of what was heard: by the scatter that a form shows before and after."""

from types import SimpleNamespace

import numpy as np
import pytest

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.cycle_explanation import _names, innovations, reweigh_wall_returns, scatter_variance
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.measurement_log import Log, Residuals, squares

CYCLES = 20


def log_of(scatter, snr=1e3):
    """Two forms in each of 20 cycles, of so much SNR, weighed with what is known beforehand; residuals by `scatter`
    (20, 2)."""
    count = 2 * CYCLES
    slot, which = np.repeat(np.arange(CYCLES), 2), np.tile([0, 1], CYCLES)
    forms = np.full((count, 2, 5), UNKNOWN)
    forms[:, 0] = [-1, -1, -1, 0, -1]
    forms[:, 0, 3] = which
    std, none = np.full((count, 3), 0.01), np.zeros(count)
    shared = np.where(which == 1, 0.02**2, 0.0)[:, None] * np.ones(3)
    extra = shared + scatter_variance(np.full(count, CONSTANTS.crowd), std)
    loud = np.full(count, (2.0 * snr) ** -0.5)
    log = Log(slot, np.zeros((count, 3)), std, none, loud, slot, slot, forms, none, extra, shared)
    raw = scatter[slot, which][:, None] * np.ones(3)
    left = np.sqrt(raw / (1.0 + extra / std**2))
    rows = np.arange(count)
    return log, Residuals(rows, slot, left, np.zeros((count, 3, 4)), squares(rows, left, log, 0.0))


def scatter_held(log):
    """(20, 2) that the weights of the log stand for."""
    return 1.0 + ((log.extra - log.shared) / (CONSTANTS.memory * log.std**2)).mean(axis=1).reshape(CYCLES, 2)


def test_what_was_weighed_before_its_scatter_was_known_is_weighed_by_it():
    truth = np.tile([1.0, 50.0], (CYCLES, 1))
    log, left = log_of(truth)
    found = scatter_held(reweigh_wall_returns(log, left, CYCLES))
    near = np.array([(0.9 ** np.abs(np.arange(CYCLES) - slot)).sum() for slot in range(CYCLES)])
    np.testing.assert_allclose(found, (CONSTANTS.crowd + near[:, None] * truth) / (1.0 + near[:, None]), rtol=1e-9)
    assert (found[:, 0] < 0.25 * CONSTANTS.crowd).all()
    assert (found[:, 1] > 5.0 * CONSTANTS.crowd * 0.8).all()


def test_neighbours_that_come_do_not_count_against_what_was_long_before():
    truth = np.ones((CYCLES, 2))
    truth[CYCLES // 2 :, 0] = 100.0
    log, left = log_of(truth)
    found = scatter_held(reweigh_wall_returns(log, left, CYCLES))
    assert found[0, 0] < 0.5 * found[-1, 0]
    assert (np.diff(found[:, 0]) > 0.0).all()


def test_a_gross_error_counts_as_the_loudest_neighbour():
    truth = np.ones((CYCLES, 2))
    truth[3, 0] = 1e9
    log, left = log_of(truth)
    assert scatter_held(reweigh_wall_returns(log, left, CYCLES)).max() < 1e3


def test_a_neighbour_moves_a_component_by_as_much_as_its_own_snr_is_worth():
    """Two walls of a corridor pull a return of 50 dB by 200 reported deviations, cycle after cycle."""
    truth = np.tile([200.0**2, 200.0**2], (CYCLES, 1))
    loud, faint = (scatter_held(reweigh_wall_returns(*log_of(truth, snr), CYCLES)) for snr in (1e5, 1e2))
    assert (loud > 0.8 * 200.0**2).all()
    assert (faint < 1.0 + 1e2).all()


def test_a_level_ray_moves_nothing_where_it_is_reported_on_average():
    """Half of its reports lie on the rim of the unit disc, and those within it by 0.4 deviations in the mean."""
    std = 0.01
    inside = 1.0 - std / np.sqrt(2.0 * np.pi)
    groups = SimpleNamespace(leader=np.array([0]), partner=np.array([-1]), gap=np.zeros((1, 3)))
    expected = SimpleNamespace(seen=np.array([[5.0, 0.6, 0.8]]), jacobian=np.eye(3)[None])
    view = SimpleNamespace(row=np.array([0]), pick=np.array([0]), groups=groups, expected=expected)
    log = SimpleNamespace(
        cycle=np.array([7]), share=np.zeros(1), seen=np.array([[5.0, 0.6 * inside, 0.8 * inside]]),
        std=np.full((1, 3), std), extra=np.zeros((1, 3)),
    )  # fmt: skip
    left, slope, _ = innovations(view, log, np.ones(1, dtype=np.bool_), 7, 3)
    np.testing.assert_allclose(left, 0.0, atol=1e-9)
    assert std * slope[0, 1:, 1:] @ [0.6, 0.8] @ [0.6, 0.8] == pytest.approx(0.5)
    np.testing.assert_array_equal(expected.jacobian, np.eye(3)[None])  # another cycle's map asks it again


def test_labels_tell_points_images_walls_and_pairs_of_walls_apart():
    landmarks = SimpleNamespace(ident=np.array([4, 9, 0, 7]))  # a point, and three walls
    point, one, two, three, none, tx = 0, 1, 2, 3, -1, -1
    alike = [
        [[point, none, none, none, none]],
        [[point, one, none, none, none], [point, two, none, one, none], [point, none, none, one, two]],
        [[point, none, none, two, none]],
        [[tx, none, none, one, none]],
        [[tx, none, none, two, none]],
        [[tx, none, none, one, two], [tx, none, none, two, one]],
        [[tx, none, none, three, two], [tx, none, none, two, three]],
        [[tx, none, none, one, three], [tx, none, none, three, one]],
    ]
    found = [_names(landmarks, np.array(forms)) for forms in alike]
    assert all(len(set(names.tolist())) == 1 for names in found)
    assert len({int(names[0]) for names in found}) == len(alike)
    assert not len(_names(landmarks, np.zeros((0, 5), dtype=np.int64)))
