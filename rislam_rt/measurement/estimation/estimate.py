"""The waveform estimator: delays, cosines and amplitudes of all paths in one sounding, without a grid.

Newtonised orthogonal matching pursuit (Mamandipoor, Ramasamy and Madhow 2016) over three parameters: find peaks in the
residual, refine all paths found so far, repeat until the residual holds no peak above the threshold. Its cyclic
single-path refinements are replaced by joint Gauss-Newton steps, which also part paths inside one resolution cell; a
path that its neighbours could explain as well as noise could is taken out again.
"""

import numpy as np

from rislam_rt.arrays import Booleans, Complexes, Floats
from rislam_rt.measurement.estimation.detect import MatchedFilterGrid, into_range, pick_peaks
from rislam_rt.measurement.estimation.path_signals import Sounding
from rislam_rt.measurement.estimation.refine import (
    LeastSquaresFit,
    amplitude_variance,
    fit_amplitudes,
    information_matrix,
    refine,
    refine_some,
    residual,
    residual_fit,
    subset_fit,
    without_idle,
)

BATCH = 16
"""Largest number of paths that are added between two refinements."""
ROUNDS = 40
"""Largest number of search rounds; each but the last adds a path."""
SEARCH_STEPS = 2
"""Refinement steps in a search round: enough for the residual of the next one."""
KNOWN_STEPS = 3
"""Largest number of refinement steps of paths known from the last cycle, which move by less than a tenth of a cell."""
FINAL_STEPS = 12
"""Largest number of refinement steps at the end of the search."""
FINAL_TOLERANCE = 0.03
"""Noise energy that the last step may leave in each path: a quarter of a standard deviation of one parameter."""
TRIAL_STEPS = 6
"""Largest number of refinement steps of the other paths after one was left out, before the costs are compared."""
TOUCHED = 1.0
"""Energy over N0 that a new path takes from an old one's signal, from which on the old one is refined with it."""
COUPLED = 0.1
"""Correlation of two signals from which on one can make up for leaving out the other."""
SLACK = 0.1
"""Distance by which (B tau, u, v) may leave the window and the unit disc during the search, so that paths on the edge
do not stick."""
NOTHING = np.zeros((0, 3))
"""Parameters of no paths."""


def estimate_paths(
    sounding: Sounding, grid: MatchedFilterGrid, samples: Complexes, threshold: float, window: tuple[float, float],
    most: int, known: Floats = NOTHING,
) -> LeastSquaresFit:  # fmt: skip
    """The waveform estimator: all paths in samples (L, M) whose noise has unit variance; detect, refine, drop, and
    repeat.

    Parameters
    ----------
    threshold
        On the measured SNR `L M |alpha|^2` of a path, linear; see `sensor_model` for the rate that it stands for.
    window
        First and last delay, in resolution cells.
    most
        Largest number of paths.
    known
        Parameters (Q, 3) of likely paths, such as those of the last sounding: the search begins with them. Each is
        tested like any other.
    """
    fit = fit_amplitudes(sounding, known[:most], samples)
    if len(known):
        fit = refine(sounding, fit, samples, steps=KNOWN_STEPS)
        fit = drop(sounding, fit, samples, threshold, window)
    for _ in range(ROUNDS):
        room = min(BATCH, most - len(fit.parameters))
        fresh = pick_peaks(sounding, grid, residual(fit, samples), threshold, window, room)
        if not len(fresh):
            break
        grown = fit_amplitudes(sounding, np.concatenate([fit.parameters, fresh]), samples)
        # From nothing, every round moves all paths; where most were known, only those that a new one touches.
        local = _touched(grown, len(fresh), samples.size) if len(known) else np.ones(len(grown.parameters), dtype=bool)
        if local.all():
            grown = refine(sounding, grown, samples, steps=SEARCH_STEPS)
        else:
            grown = refine_some(sounding, grown, samples, np.flatnonzero(local), steps=SEARCH_STEPS)
        grown = drop(sounding, grown, samples, threshold, window)
        if grown.cost >= fit.cost - threshold:
            break
        fit = grown
    # at last to convergence, and without paths that their neighbours can explain
    fit = refine(sounding, fit, samples, steps=FINAL_STEPS, tolerance=FINAL_TOLERANCE)
    fit = prune(sounding, drop(sounding, fit, samples, threshold, window), samples, threshold)
    return refine(sounding, fit, samples, steps=FINAL_STEPS, tolerance=FINAL_TOLERANCE)


def _touched(fit: LeastSquaresFit, fresh: int, num_samples: int) -> Booleans:
    """Which paths (P,) the waveform estimator refines next: the last `fresh` ones, and those from whose signal these
    take more than noise."""
    energy = np.abs(fit.amplitude[-fresh:]) ** 2 / num_samples
    touched = np.any(np.abs(fit.inner.signal[:, -fresh:]) ** 2 * energy > TOUCHED, axis=1)
    touched[-fresh:] = True
    return touched


def drop(
    sounding: Sounding, fit: LeastSquaresFit, samples: Complexes, threshold: float, window: tuple[float, float]
) -> LeastSquaresFit:
    """Step of the waveform estimator: drop paths that left the window or the unit disc, or that lower the cost too
    little."""
    keep = np.all(np.abs(fit.parameters - into_range(fit.parameters, window)) <= SLACK, axis=-1)
    if not keep.all():
        fit = subset_fit(sounding, fit, keep, samples)
    keep = without_idle(fit, threshold)
    return fit if keep.all() else subset_fit(sounding, fit, keep, samples)


def prune(sounding: Sounding, fit: LeastSquaresFit, samples: Complexes, threshold: float) -> LeastSquaresFit:
    """Step of the waveform estimator: drop paths of a fit that their neighbours, once refined, can explain as well.

    Noise alone lowers the cost by its highest peak when a path is added, so the threshold is the one of the search.
    Only paths whose amplitude is uncertain by more than that are tried, the most uncertain first.
    """
    tried = np.zeros((0, 3))
    while True:
        information = 2.0 * information_matrix(fit.inner, fit.covariance, fit.amplitude)
        variance = amplitude_variance(fit.inner, fit.covariance, fit.amplitude, information)
        certainty = np.abs(fit.amplitude) ** 2 / variance
        before = np.all(np.abs(fit.parameters[:, None] - tried) < SLACK, axis=-1).any(axis=1)
        doubtful = np.flatnonzero((certainty < threshold) & ~before)
        for row in doubtful[np.argsort(certainty[doubtful])]:
            rest = _neighbours_instead(sounding, fit, samples, int(row), fit.cost + threshold)
            if rest is not None:
                fit = fit_amplitudes(sounding, rest, samples)
                break
            tried = np.concatenate([tried, fit.parameters[row : row + 1]])
        else:
            return fit


def _neighbours_instead(
    sounding: Sounding, fit: LeastSquaresFit, samples: Complexes, row: int, enough: float
) -> Floats | None:
    """The waveform estimator's fit with one path less, its neighbours refined (P - 1, 3); None if the cost is not below
    `enough`."""
    near = np.flatnonzero(np.abs(fit.inner.signal[row]) > COUPLED * sounding.num_samples)
    whole, local = residual_fit(sounding, fit, near, samples)
    others = near != row
    trial = subset_fit(sounding, whole, others, local)
    trial = refine(sounding, trial, local, steps=TRIAL_STEPS, enough=enough)
    if trial.cost >= enough:
        return None
    rest = fit.parameters.copy()
    rest[near[others]] = trial.parameters
    return np.delete(rest, row, axis=0)
