"""Reclassification: walls that one path alone tells of are asked anew what they are.

A birth is one decision on six cycles and on the walls that were known then. A return over two walls that was born as
one wall moves the agent to where that fits, and scatters no more than a right one.
"""

import numpy as np

from rislam_rt.arrays import Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.births.births import births
from rislam_rt.slam.window.births.feature_removal import remove_from_map
from rislam_rt.slam.window.cycle_association import CycleAssociation
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.motion.length_rates import MEASURED
from rislam_rt.slam.window.solver_limits import STRIDE
from rislam_rt.slam.window.state import WindowState
from rislam_rt.slam.window.tracks import looked_as_before


def reclassified(state: WindowState, view: CycleAssociation) -> WindowState:
    """State in which the path of a wall that nothing else tells of is over another new feature, if what the window
    holds of it clearly is: in a trial without the wall its track is the only one due for a birth.

    Another order of the same walls, or a partner beside them, is no other feature. The map's own returns are not among
    the path's causes.
    """
    nothing = view._replace(groups=view.groups._replace(leader=view.groups.leader[:0]))
    for row, at in _due(state):
        every = state._replace(tracks=state.tracks._replace(looked=state.tracks.hits))
        after = births(remove_from_map(every, np.arange(len(state.landmarks.ident)) != row), nothing)
        found, new = after.log.form[at, 0], state.landmarks.next_ident
        again = np.sort(np.where(found == new, state.landmarks.ident[row], found)) == np.sort(state.log.form[at, 0])
        if after.landmarks.next_ident > new and not again.all():
            return after._replace(tracks=looked_as_before(after.tracks, state.tracks))
    return state


def _due(state: WindowState) -> list[tuple[int, Integers]]:
    """Rows of the walls that one path alone tells of, each in its turn once in half a window, as soon as the path has
    half as many measurements again as a birth asks for; and the rows (A,) of the log of these paths."""
    log, landmarks, found = state.log, state.landmarks, []
    turns = CONSTANTS.window // (2 * STRIDE)
    for row in landmarks.walls[(landmarks.ident[landmarks.walls] - state.cycle // STRIDE) % turns == 0]:
        at = (log.form == landmarks.ident[row]).any(axis=(1, 2)).nonzero()[0]
        forms = np.unique(log.form[at].reshape(-1, 10), axis=0)
        if len(forms) == 1 and forms[0, 5] == UNKNOWN and len(at) >= 1.5 * MEASURED:
            found.append((int(row), at))
    return found
