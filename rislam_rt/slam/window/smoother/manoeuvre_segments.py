"""Manoeuvre segments: manoeuvres that the last steps tell of together, and none of them alone.

Each step's motion mode is learnt from its own acceleration, the other steps' priors being what they are
(`motion_learning`). Measurements tell the sum of a manoeuvre's accelerations rather than each: while its steps are held
for lively, each is explained by the others, all are held for calm next, and the manoeuvre is undone. So a segment of
steps is asked at once whether it is lively, by the marginal likelihood of the window's Gaussian under either prior.
"""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.smoother import motion
from rislam_rt.slam.window.smoother.cholesky import form_and_log_det, inverse
from rislam_rt.slam.window.smoother.window_gaussian import Window
from rislam_rt.slam.window.solver_limits import AGO


def manoeuvring_share(window: Window, calm: Floats, before: Floats, lively: float) -> Floats:
    """Probability (K - 1,) that each of the window's steps belongs to a segment in the liveliest motion mode, beyond
    what is expected beforehand.

    `calm` (K - 1,) are the prior precisions of the horizontal accelerations by which each step is held by itself,
    `before` (L,) the probabilities of the motion modes before the window, and `lively` the log odds of a manoeuvre in
    the last step by which components were associated. At most one segment is.
    """
    count = len(window.accel)
    segments = [slice(count - first, count - last) for last in AGO for first in AGO if last < first <= count]
    share = float((before @ np.linalg.matrix_power(motion.transition(CONSTANTS.stay), count))[-1])
    prior = np.full(len(segments), np.log(share / (1.0 - share)))
    gain = np.array([_log_ratio(window, calm, each) + lively * (each.stop == count) for each in segments])
    expected, found = (_covered(segments, odds, count) for odds in (prior, prior + gain))
    return np.maximum(found - expected, 0.0) / (1.0 - expected)


def _covered(segments: list[slice], log_odds: Floats, count: int) -> Floats:
    """Probability (K - 1,) that each of the steps is in the one of S segments that is lively, of log odds (S,) against
    there being none."""
    top = max(0.0, float(log_odds.max(initial=0.0)))
    weight, share = np.exp(log_odds - top), np.zeros(count)
    for segment, part in zip(segments, weight / (weight.sum() + np.exp(-top)), strict=True):
        share[segment] += part
    return np.minimum(share, 1.0)


def _log_ratio(window: Window, calm: Floats, steps: slice) -> float:
    """Log ratio of the window's marginal likelihoods with all horizontal accelerations of a segment's `steps` in the
    liveliest motion mode, and with prior precisions `calm` (K - 1,)."""
    free, count = window.accel.shape[1], steps.stop - steps.start
    at = len(window.head) + free * np.arange(steps.start, steps.stop)[:, None] + np.arange(2)
    inner = inverse(window.covariance[np.ix_(at.ravel(), at.ravel())])
    pull = inner @ window.accel[steps, :2].ravel()
    told = inner - np.diag(window.solved[steps, :2].ravel())
    found = []
    for std in (np.full(count, CONSTANTS.liveliest), calm[steps] ** -0.5):
        each = np.repeat(std, 2)
        form, log_det = form_and_log_det(np.eye(2 * count) + each[:, None] * told * each, pull * each)
        found.append(0.5 * (form - log_det))
    return found[0] - found[1]
