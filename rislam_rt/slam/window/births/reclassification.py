"""Reclassification: walls that one path alone tells of are asked anew what they are, as that path's history grows.

A birth is one decision on six cycles and on the walls that were known then. The return over two walls that was born as
one moves the agent to where it fits, and scatters no more than a right one.
"""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import reflect
from rislam_rt.slam.window.births.births import births, classify
from rislam_rt.slam.window.births.feature_removal import remove_from_map
from rislam_rt.slam.window.births.track_classification import WallPosterior
from rislam_rt.slam.window.cycle_association import CycleAssociation
from rislam_rt.slam.window.divergence.length_rates import MEASURED
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.smoother import window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.solver_limits import GATE, STRIDE
from rislam_rt.slam.window.state import WindowState


def reclassified(state: WindowState, view: CycleAssociation) -> WindowState:
    """State without the wall that one path alone tells of, if that path's whole history says that it is none: as
    classified in a trial without the wall, in which its track may at once be what is clear then."""
    nothing = view._replace(groups=view.groups._replace(leader=view.groups.leader[:0]))
    for row, at in _due(state):
        every = state._replace(tracks=state.tracks._replace(looked=state.tracks.hits))
        trial = remove_from_map(every, np.arange(len(state.landmarks.ident)) != row)
        track = (trial.tracks.ident == trial.log.track[at[-1]]).nonzero()[0]
        if not len(track):
            continue
        decision = classify(trial, track, [at], nothing)[0][0]
        place = window_gaussian.now(state.window)[0][HEAD:].reshape(-1, 3)[row]
        image = reflect(window_gaussian.now(trial.window)[0][:3], place, state.landmarks.anchor[row])
        if _probability(decision.walls, image) < 1.0 - CONSTANTS.born:
            after = births(trial, nothing)
            looked = after.tracks.looked.copy()
            kept = np.isin(after.tracks.ident, state.tracks.ident)
            looked[kept] = state.tracks.looked[np.isin(state.tracks.ident, after.tracks.ident)]
            return after._replace(tracks=after.tracks._replace(looked=looked))
    return state


def _probability(walls: WallPosterior, image: Floats) -> float:
    """Posterior probability that a track is of a new wall in which the agent has the image (3,) [m]."""
    gap = walls.place - image
    near = np.vecdot(gap, np.linalg.solve(walls.covariance, gap[..., None])[..., 0]) < GATE
    return float(walls.probability[near].sum())


def _due(state: WindowState) -> list[tuple[int, Integers]]:
    """Rows of the walls that one path alone tells of and whose histories have grown by a half since they were asked
    last, and the rows (A,) of the log of these paths."""
    log, landmarks, found = state.log, state.landmarks, []
    for row in landmarks.walls:
        at = (log.form == landmarks.ident[row]).any(axis=(1, 2)).nonzero()[0]
        forms, count = np.unique(log.form[at].reshape(-1, 10), axis=0), len(at)
        grown = np.floor(np.log(np.maximum([count, count - STRIDE], 1) / MEASURED) / np.log(1.5))
        late = count > CONSTANTS.window - STRIDE and state.cycle % (CONSTANTS.window // 2) < STRIDE
        if len(forms) == 1 and forms[0, 5] == UNKNOWN and (grown[0] > max(grown[1], 0.0) or late):
            found.append((int(row), at))
    return found
