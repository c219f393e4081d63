"""Track fragments: earlier tracks that broke off, of a path whose cause has become clear.

Who sets off faster than was thought leaves tracks behind, and new ones begin where their paths are heard then. The
birth that follows has the new track's history alone, and nothing ties the way since to the place before it.
"""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.births.feature_removal import resolve
from rislam_rt.slam.window.divergence import motion_agreement
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.relinearisation import predictions, whitened
from rislam_rt.slam.window.smoother.marginals import prediction_variance
from rislam_rt.slam.window.solver_limits import GATE
from rislam_rt.slam.window.state import WindowState
from rislam_rt.slam.window.tracks import WANDER


def assign(context: WindowState, at: Integers, forms: Integers, scatter: Floats, part: float) -> WindowState:
    """Associate rows of the log with the paths of forms (2, 5) of idents, with extra variance by the track's
    scatter (3,)."""
    extra = CONSTANTS.memory * context.log.std[at] ** 2 * (scatter**2 - 1.0)
    return context._replace(log=context.log.explain(at, forms, part if forms[1, 0] != UNKNOWN else 0.0, 0.0, extra))


def with_fragments(
    context: WindowState, at: Integers, forms: Integers, scatter: Floats, part: float
) -> WindowState:  # fmt: skip
    """State in which tracks that ended before the one of rows `at` began are associated with its path as well, of forms
    (2, 5), if their last component is likelier to be of that path than new (as `tracks.match` has it) and all of theirs
    fit it."""
    log, first = context.log, int(context.log.cycle[at].min())
    loose = (~log.explained & (log.track >= 0)).nonzero()[0]
    loose = loose[~np.isin(log.track[loose], log.track[loose[log.cycle[loose] >= first]])]
    if not len(loose):
        return context
    name, which = np.unique(log.track[loose], return_inverse=True)
    last = np.zeros(len(name), dtype=np.int64)
    np.maximum.at(last, which, loose)
    log_odds = _log_continued(context, last, at, forms, scatter, part)
    for number in np.argsort(-log_odds):
        if log_odds[number] <= 0.0:
            break
        rows = loose[which == number]
        if np.isin(log.cycle[rows], context.log.cycle[at]).any():
            continue
        grown, left = resolve(assign(context, rows, forms, scatter, part), 3)
        fresh = left.left[np.isin(left.row, rows)]
        if not np.isfinite(grown.window.head).all() or np.vecdot(fresh, fresh).mean() > 3.0 * CONSTANTS.fit:
            continue
        if log_odds[number] + motion_agreement.log_agreement(context, grown.window) > 0.0:
            context, at = grown, np.append(at, rows)
    return context


def _log_continued(
    context: WindowState, last: Integers, at: Integers, forms: Integers, scatter: Floats, part: float
) -> Floats:
    """Log likelihood ratios (A,) of components `last` (A,) being of the path that the track of rows `at` is of, against
    their being new, at the window's estimate."""
    trial = assign(context, last, forms, scatter, part)
    log, found = trial.log, whitened(trial, predictions(trial, 0))
    keep = np.isin(found.row, last)
    row, left, slopes = found.row[keep], found.left[keep], found.slopes[keep]
    spread = 1.0 + prediction_variance(trial.window, found.slot[keep], slopes)
    begin = at[np.argmin(log.cycle[at])]
    wander = WANDER**2 + log.log_amplitude_std[row] ** 2 + log.log_amplitude_std[begin] ** 2
    surplus = log.log_amplitude[row] - log.log_amplitude[begin]
    square = (left**2 / spread).sum(axis=1)
    variance = spread * (log.std[row] ** 2 + log.extra[row])
    log_like = -0.5 * (square + np.log(2.0 * np.pi * variance).sum(axis=1))
    log_like -= 0.5 * (surplus**2 / wander + np.log(2.0 * np.pi * wander))
    odds = np.full(len(last), -np.inf)
    order = np.argsort(last)
    odds[order[np.searchsorted(last, row, sorter=order)]] = np.where(
        square < GATE, log_like - np.log(context.config.new_density), -np.inf
    )
    return odds
