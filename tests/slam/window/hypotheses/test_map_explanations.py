"""What the map explains: a known return is known again, whatever is expected to share its cell."""

import numpy as np

from rislam_rt.slam.window.hypotheses.map_explanations import _log_evidence, _Predicted
from rislam_rt.slam.window.solver_limits import STRENGTHS

REPORTED = np.tile([0.001, 0.002, 0.002], (8, 1))
"""Deviations of eight normal points."""
COMPANY = (15.0 * REPORTED[0]) ** 2
"""Variance by what is expected in the cell, as in the room where the ceiling was born twice."""


def _history(off: np.ndarray) -> _Predicted:
    """History that lies `off` (8, 3), in reported deviations, from what the map predicts."""
    return _Predicted((off * REPORTED)[:, None], np.zeros((8, 1, 3, 2)), REPORTED)


def test_a_return_that_its_company_leaves_alone_is_known_again():
    """With the company for certain it would be 24 log 15 = 65 behind, and a new wall there would be believed."""
    still = _history(np.zeros((8, 3)))
    alone, beside = (_log_evidence(still, np.ones(1), extra) for extra in (np.zeros(3), COMPANY))
    assert alone - beside < np.log(STRENGTHS)


def test_a_return_that_its_company_pulls_is_known_as_well():
    pulled = _history(8.0 * np.random.default_rng(2).standard_normal((8, 3)))
    alone, beside = (_log_evidence(pulled, np.ones(1), extra) for extra in (np.zeros(3), COMPANY))
    assert beside > alone + 10.0


def test_evidence_is_the_same_however_many_unknowns_there_are():
    """More unknowns than measurements are condensed; those of no effect change nothing."""
    rng = np.random.default_rng(5)
    few = rng.standard_normal((8, 1, 3, 4)) * REPORTED[:, None, :, None]
    left = (rng.standard_normal((8, 3)) * REPORTED)[:, None]
    many = np.concatenate([few, np.zeros((8, 1, 3, 40))], axis=-1)
    found = [_log_evidence(_Predicted(left, slopes, REPORTED), np.ones(1), COMPANY) for slopes in (few, many)]
    assert np.isclose(*found, rtol=1e-9)
