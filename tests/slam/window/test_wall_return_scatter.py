"""Weights of wall returns: by the scatter that a form shows before and after."""

import numpy as np

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.landmarks.landmark_update import DIGITS, no_observations, with_scatter
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.measurement_log import Log, Residuals, reweigh_wall_returns, scatter_variance, squares

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


def test_what_came_after_a_cycle_may_be_left_out():
    """As a manoeuvre has it: the scatter is that of the cycles before, for those after as well."""
    truth = np.ones((CYCLES, 2))
    truth[CYCLES // 2 :, 0] = 100.0
    log, left = log_of(truth)
    weighed = reweigh_wall_returns(log, left, CYCLES, CYCLES // 2)
    found = scatter_held(weighed)
    assert found[:, 0].max() < CONSTANTS.crowd
    np.testing.assert_allclose(found[:, 0], found[:, 1])
    np.testing.assert_allclose(weighed.scatter(np.arange(2 * CYCLES)), found.ravel())


def test_the_record_of_paths_takes_the_last_scatter_of_each():
    forms = np.full((4, 5), UNKNOWN)
    forms[:, 0], forms[:, 3] = -1, [3, 7, 3, 9]
    known = np.sort((forms[:2] + 1) @ DIGITS)
    record = no_observations()._replace(code=known, clear=np.ones(2), scatter=np.array([9.0, 9.0]))
    np.testing.assert_array_equal(with_scatter(record, forms, np.array([2.0, 4.0, 3.0, 8.0])).scatter, [3.0, 4.0])
