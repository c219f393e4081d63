"""Weights of what was heard: by the scatter that a form shows before and after."""

import numpy as np

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.cycle_explanation import scatter_variance, weigh_again
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.measurement_log import Log, Residuals

CYCLES = 20


def log_of(scatter):
    """Two forms in each of 20 cycles, weighed with what is known beforehand; residuals by `scatter` (20, 2)."""
    count = 2 * CYCLES
    slot, which = np.repeat(np.arange(CYCLES), 2), np.tile([0, 1], CYCLES)
    forms = np.full((count, 2, 5), UNKNOWN)
    forms[:, 0] = [-1, -1, -1, 0, -1]
    forms[:, 0, 3] = which
    std, none = np.full((count, 3), 0.01), np.zeros(count)
    shared = np.where(which == 1, 0.02**2, 0.0)[:, None] * np.ones(3)
    extra = shared + scatter_variance(np.full(count, CONSTANTS.crowd), std)
    log = Log(slot, np.zeros((count, 3)), std, none, none, slot, slot, forms, none, extra, shared)
    raw = scatter[slot, which][:, None] * np.ones(3)
    left = np.sqrt(raw / (1.0 + extra / std**2))
    return log, Residuals(np.arange(count), slot, left)


def scatter_held(log):
    """(20, 2) that the weights of the log stand for."""
    return 1.0 + ((log.extra - log.shared) / (CONSTANTS.memory * log.std**2)).mean(axis=1).reshape(CYCLES, 2)


def test_what_was_weighed_before_its_scatter_was_known_is_weighed_by_it():
    truth = np.tile([1.0, 50.0], (CYCLES, 1))
    log, left = log_of(truth)
    found = scatter_held(weigh_again(log, left, CYCLES))
    near = np.array([(0.9 ** np.abs(np.arange(CYCLES) - slot)).sum() for slot in range(CYCLES)])
    np.testing.assert_allclose(found, (CONSTANTS.crowd + near[:, None] * truth) / (1.0 + near[:, None]), rtol=1e-9)
    assert (found[:, 0] < 0.25 * CONSTANTS.crowd).all()
    assert (found[:, 1] > 5.0 * CONSTANTS.crowd * 0.8).all()


def test_neighbours_that_come_do_not_count_against_what_was_long_before():
    truth = np.ones((CYCLES, 2))
    truth[CYCLES // 2 :, 0] = 100.0
    log, left = log_of(truth)
    found = scatter_held(weigh_again(log, left, CYCLES))
    assert found[0, 0] < 0.5 * found[-1, 0]
    assert (np.diff(found[:, 0]) > 0.0).all()


def test_a_gross_error_counts_as_the_loudest_neighbour():
    truth = np.ones((CYCLES, 2))
    truth[3, 0] = 1e9
    log, left = log_of(truth)
    assert scatter_held(weigh_again(log, left, CYCLES)).max() < 1e3
