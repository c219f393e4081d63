"""Track fragments: tracks that broke off, of paths that the map explains before or after.

Who sets off faster than was thought leaves tracks behind, and new ones begin where their paths are heard then. The
births that follow have the new tracks' histories alone, and nothing ties the way since to the place before it.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.observations import PANEL
from rislam_rt.slam.predicted_returns import TX
from rislam_rt.slam.window.births.feature_removal import resolve
from rislam_rt.slam.window.measurement_log import Log, unique_forms
from rislam_rt.slam.window.motion import motion_agreement
from rislam_rt.slam.window.motion.length_rates import MEASURED
from rislam_rt.slam.window.relinearisation import predictions, whitened
from rislam_rt.slam.window.smoother.marginals import prediction_variance
from rislam_rt.slam.window.solver_limits import GATE
from rislam_rt.slam.window.state import WindowState


class _Pairs(NamedTuple):
    """Pairs of a track fragment and a path of the map that was heard in other cycles, P of them, by rows of the log."""

    fragment: Integers
    """(P,) number of the fragment."""
    row: Integers
    """(P,) its component that is nearest in time to one of the path..."""
    known: Integers
    """(P,) ...and that one."""


def with_fragments(state: WindowState) -> WindowState:
    """State in which tracks that ended are associated with the paths of the map that they are of: their component next
    to what was heard of the path is likelier to be of it than new (as `tracks.match` has it), and all of theirs fit."""
    log = state.log
    over_panel = np.unique(log.track[log.side >= PANEL])
    ended = ~np.isin(log.track, np.concatenate([state.tracks.ident, over_panel]))
    loose = (~log.explained & (log.track >= 0) & ended).nonzero()[0]
    which = np.unique(log.track[loose], return_inverse=True)[1]
    pairs = _pairs(state, loose, which)
    if not len(pairs.row):
        return state
    log_odds = _log_same(state, pairs)
    trial, taken, total = log, list[_Fragment](), 0.0
    for at in np.argsort(-log_odds):
        rows, known = loose[which == pairs.fragment[at]], int(pairs.known[at])
        if log_odds[at] <= 0.0 or trial.explained[rows[0]]:
            continue
        same = (trial.form == log.form[known, 0]).all(axis=2).any(axis=1)
        if not np.isin(trial.cycle[rows], trial.cycle[same]).any():  # else it is heard there as another component
            trial, total = _joined(trial, rows, known), total + float(log_odds[at])
            taken.append(_Fragment(rows, known, float(log_odds[at])))
    if not taken:
        return state
    grown, fits = _solved(state, trial, taken)
    if not all(fits):  # what does not fit is no reason against what does
        trial, total = log, 0.0
        taken = [each for each, fine in zip(taken, fits, strict=True) if fine]
        for each in taken:
            trial, total = _joined(trial, each.rows, each.known), total + each.log_odds
        grown, fits = _solved(state, trial, taken)
    agrees = taken and all(fits) and total + motion_agreement.log_agreement(state, grown.window) > 0.0
    return grown if agrees else state


class _Fragment(NamedTuple):
    """A track fragment that is likelier to be of a path than new."""

    rows: Integers
    """(A,) of the log."""
    known: int
    """Row of a component of the path."""
    log_odds: float


def _solved(state: WindowState, log: Log, taken: list[_Fragment]) -> tuple[WindowState, list[bool]]:
    """State solved with fragments associated as the measurement log has them, and whether each fits."""
    grown, left = resolve(state._replace(log=log), 3)
    square = np.vecdot(left.left, left.left)
    finite = bool(np.isfinite(grown.window.head).all())
    return grown, [finite and square[np.isin(left.row, each.rows)].mean() <= CONSTANTS.crowd for each in taken]


def _pairs(state: WindowState, loose: Integers, which: Integers) -> _Pairs:
    """Pairs of fragments, rows `loose` (N,) of the log of fragment `which` (N,), and paths over walls alone that have
    as many measurements as a birth asks for, none of them in a cycle of the fragment."""
    log, none = state.log, np.zeros(0, dtype=np.int64)
    rows = (log.form[:, 0, 0] == TX).nonzero()[0]
    rows = rows[log.scatter(rows) <= CONSTANTS.crowd]  # what scatters by more fits anything
    if not len(loose) or not len(rows):
        return _Pairs(none, none, none)
    _, path = unique_forms(log.form[rows, 0])
    slot = log.cycle - (state.cycle - state.window.num_poses + 1)
    heard = np.zeros((path.max() + 1, state.window.num_poses), dtype=np.bool_)
    heard[path, slot[rows]] = True
    ended = np.zeros((which.max() + 1, state.window.num_poses), dtype=np.bool_)
    ended[which, slot[loose]] = True
    apart = (heard.astype(np.int64) @ ended.T == 0) & (heard.sum(axis=1) >= MEASURED)[:, None]
    found = []
    for one, fragment in zip(*apart.nonzero(), strict=True):
        mine, theirs = rows[path == one], loose[which == fragment]
        gap = np.abs(log.cycle[theirs][:, None] - log.cycle[mine])
        row, known = np.unravel_index(int(gap.argmin()), gap.shape)
        found.append((fragment, theirs[row], mine[known]))
    return _Pairs(*np.array(found, dtype=np.int64).reshape(-1, 3).T)


def _joined(log: Log, rows: Integers, known: Integers | int) -> Log:
    """Measurement log in which the components `rows` (A,) are associated with the path of the component `known` (A,) or
    one for all, and scatter as it does."""
    known = np.broadcast_to(known, rows.shape)
    scatter = (log.extra[known] - log.shared[known]) / log.std[known] ** 2 * log.std[rows] ** 2
    return log.explain(rows, log.form[known], log.share[known], log.shared[known], scatter)


def _log_same(state: WindowState, pairs: _Pairs) -> Floats:
    """Log likelihood ratios (P,) of the fragments' components being of the paths of `pairs`, against their being new,
    at the window's estimate."""
    log, known = state.log, pairs.known
    one = _joined(log.take(np.append(pairs.row, known)), np.arange(len(known)), np.arange(len(known)) + len(known))
    one = one.take(slice(len(known)))
    trial = state._replace(log=one)
    found = whitened(trial, predictions(trial, 0))
    spread = 1.0 + prediction_variance(state.window, found.slot, found.slopes)
    square = (found.left**2 / spread).sum(axis=1)
    log_like = -0.5 * (square + np.log(2.0 * np.pi * spread * (one.std**2 + one.extra)).sum(axis=1))
    # over walls it is as loud as before
    alike = 2.0 * CONSTANTS.fading**2 + one.log_amplitude_std**2 + log.log_amplitude_std[known] ** 2
    log_like -= 0.5 * ((one.log_amplitude - log.log_amplitude[known]) ** 2 / alike + np.log(2.0 * np.pi * alike))
    return np.where(square < GATE, log_like - np.log(state.config.new_density), -np.inf)
