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
from rislam_rt.slam.window.smoother.cholesky import inverse, log_evidence
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
    share = float((before @ motion.transition_over(CONSTANTS.stay, count))[-1])
    prior = np.full(len(segments), np.log(share / (1.0 - share)))
    gain = np.array(_log_ratios(window, calm, segments)) + [lively * (each.stop == count) for each in segments]
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


def _log_ratios(window: Window, calm: Floats, segments: list[slice]) -> list[float]:
    """Log ratios of the window's marginal likelihoods with all horizontal accelerations of each segment in the
    liveliest motion mode, and with prior precisions `calm` (K - 1,)."""
    first = min((each.start for each in segments), default=0)
    free = window.accel.shape[1]
    at = (len(window.head) + free * np.arange(first, len(calm))[:, None] + np.arange(2)).ravel()
    covariance, std = window.covariance[at[:, None], at], np.repeat(calm[first:] ** -0.5, 2)
    lively = np.full(len(std), CONSTANTS.liveliest)
    accel, solved = window.accel[first:, :2].ravel(), window.solved[first:, :2].ravel()
    found = []
    for segment in segments:
        own = slice(2 * (segment.start - first), 2 * (segment.stop - first))
        inner = inverse(covariance[own, own])
        pull = inner @ accel[own]
        inner.flat[:: len(inner) + 1] -= solved[own]
        found.append(log_evidence(inner, pull, lively[own]) - log_evidence(inner, pull, std[own]))
    return found
