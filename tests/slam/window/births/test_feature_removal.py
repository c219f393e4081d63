"""What is taken back, and what stays: a feature goes by what it throws itself, not by where others stand."""

from types import SimpleNamespace

import numpy as np

from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import NONE, TX
from rislam_rt.slam.window.births.feature_removal import features_to_remove, resume
from rislam_rt.slam.window.landmarks.landmark_table import empty_table, enter
from rislam_rt.slam.window.landmarks.ris_identification import unknown
from rislam_rt.slam.window.measurement_log import empty_log
from rislam_rt.slam.window.solver_limits import CERTAIN, FEWEST
from rislam_rt.slam.window.tracks import no_tracks


def _judged(residual, log_odds=(5.0, 5.0), count=FEWEST):
    """Two walls, one behind the other; the first one's returns are off by as much [deviations]."""
    landmarks = empty_table(1)
    for odds in log_odds:
        landmarks = enter(landmarks, True, np.zeros(3), 10, odds, unknown(1, 1))
    rows = np.arange(2 * count)
    form = np.full((2 * count, 2, 5), NONE)
    form[:, 0] = [TX, NONE, NONE, 0, NONE]
    form[count:, 0, 3] = 1
    left = np.zeros((2 * count, 3))
    left[:count, 0] = residual
    return features_to_remove(landmarks, SimpleNamespace(row=rows, left=left), SimpleNamespace(form=form))


def test_what_fits_stays_wherever_it_stands():
    assert not _judged(1.0).any()


def test_what_its_measurements_contradict_goes():
    assert _judged(4.0).tolist() == [True, False]
    assert not _judged(4.0, count=FEWEST - 1).any()  # a few say nothing yet


def test_what_is_not_there_goes():
    assert _judged(1.0, log_odds=(5.0, -5.0)).tolist() == [False, True]


def test_what_is_taken_back_is_a_track_again_as_it_was_heard():
    """Six returns of one path, 0.1 s apart, that grows by 1 cm a cycle."""
    count, panels = 6, 2
    form = np.full((count, 2, 5), NONE)
    form[:, 0] = [TX, NONE, NONE, 0, NONE]
    cycle, level = np.array([3, 4, 5, 7, 8, 9]), np.linspace(-3.0, -2.0, count)
    log = empty_log()._replace(
        cycle=cycle, seen=np.array([5.0, 0.1, 0.2]) + 0.01 * cycle[:, None] * [1.0, 0.0, 0.0], form=form,
        std=np.full((count, 3), 1e-3), log_amplitude=level, side=np.zeros(count, dtype=np.int64),
        track=np.full(count, -1),
    )  # fmt: skip
    found, log = resume(no_tracks(panels), log, np.ones(count, dtype=np.bool_), 9, np.full(9, 0.1))
    assert (found.born[0], found.earlier[0], found.last[0], found.hits[0]) == (3, 8, 9, count)
    np.testing.assert_allclose([found.earlier_log_amplitude[0], found.log_amplitude[0]], level[-2:])
    np.testing.assert_allclose(found.mean[0, 0], [5.09, 0.1], atol=1e-9)
    np.testing.assert_array_equal(found.log_direct, np.zeros((1, panels)))
    np.testing.assert_array_equal(found.log_leak, np.full((1, panels), CONSTANTS.log_rare))
    assert found.log_real[0] == CERTAIN
    assert (log.track == found.ident[0]).all()
