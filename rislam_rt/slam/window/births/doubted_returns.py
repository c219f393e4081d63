"""Doubted returns: wall returns that scatter about their wall by more than fits, asked anew what caused them.

What is associated with a wall is no track, and nothing else is asked for its cause: a ceiling's other slope, heard
where the agent has passed under the ridge, is held for the first one's return, moved by a neighbour that the map lacks.
"""

import numpy as np

from rislam_rt.arrays import Booleans, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import NONE, TX
from rislam_rt.slam.window.births.births import births
from rislam_rt.slam.window.births.feature_removal import resume
from rislam_rt.slam.window.cycle_association import CycleAssociation
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.measurement_log import Log
from rislam_rt.slam.window.motion.length_rates import MEASURED
from rislam_rt.slam.window.solver_limits import STRIDE
from rislam_rt.slam.window.state import WindowState
from rislam_rt.slam.window.tracks import looked_as_before


def with_other_cause(state: WindowState, view: CycleAssociation) -> WindowState:
    """State in which one of the doubted returns, which are asked in turn, is that of a new wall, if that is clear: its
    latest components are a track in a trial, the only one that is due for a birth."""
    doubted = _doubted(state)
    if not doubted:
        return state
    at, before, log = doubted[state.cycle // STRIDE % len(doubted)], state.tracks, state.log
    rows = np.isin(np.arange(len(log.cycle)), at)
    tracks, log = resume(before._replace(looked=before.hits), log, rows, state.cycle, state.window.step)
    form = np.where(rows[:, None, None], UNKNOWN, log.form)
    after = births(state._replace(tracks=tracks, log=log._replace(form=form)), view)
    of_one_wall = _over_one_wall(after.log)[at] & (after.log.form[at, 0, 3] >= state.landmarks.next_ident)
    if not of_one_wall.all():
        return state
    return after._replace(tracks=looked_as_before(after.tracks, before))


def _doubted(state: WindowState) -> list[Integers]:
    """Rows of the log of the latest components of each return over one wall that is heard still and has scattered by
    more than fits (`crowd`) for as many measurements as a birth asks for."""
    log = state.log
    rows = _over_one_wall(log).nonzero()[0]
    scatter, wall, doubted = log.scatter(rows), log.form[rows, 0, 3], []
    for each in np.unique(wall[log.cycle[rows] >= state.cycle - 1]):
        own = (wall == each).nonzero()[0][-2 * MEASURED :]
        fits = (scatter[own] <= CONSTANTS.crowd).nonzero()[0]
        late = own[fits[-1] + 1 :] if len(fits) else own
        if len(late) >= MEASURED:
            doubted.append(rows[late])
    return doubted


def _over_one_wall(log: Log) -> Booleans:
    """Whether the components (N,) of the log are returns over one wall alone."""
    return np.asarray((log.form[:, 0, 0] == TX) & (log.form[:, 0, [1, 2, 4]] == NONE).all(axis=1))
