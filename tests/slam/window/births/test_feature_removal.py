"""What is taken back, and what stays: a feature goes by what it throws itself, not by where others stand."""

from types import SimpleNamespace

import numpy as np

from rislam_rt.slam.predicted_returns import NONE, TX
from rislam_rt.slam.window.births.feature_removal import features_to_remove
from rislam_rt.slam.window.landmarks.landmark_table import empty_table, enter
from rislam_rt.slam.window.landmarks.ris_identification import unknown
from rislam_rt.slam.window.solver_limits import FEWEST


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
