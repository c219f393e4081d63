"""Removal of features that the evidence contradicts, whose measurements become tracks again."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import NONE
from rislam_rt.slam.window.landmarks.horizon_detection import nothing_heard
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable, remove_features
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN
from rislam_rt.slam.window.landmarks.ris_identification import unknown
from rislam_rt.slam.window.measurement_log import Log, Residuals
from rislam_rt.slam.window.motion.track_rates import with_rates
from rislam_rt.slam.window.relinearisation import relinearise
from rislam_rt.slam.window.smoother import window_features, window_gaussian
from rislam_rt.slam.window.solver_limits import CERTAIN, FEWEST
from rislam_rt.slam.window.state import WindowState
from rislam_rt.slam.window.tracks import WindowTracks, unlike


def resolve(context: WindowState, steps: int) -> tuple[WindowState, Residuals]:
    """Solve the whole sliding window again by so many re-linearised Gauss-Newton steps; returns the state and the last
    step's residuals."""
    context = with_rates(context)
    for _ in range(steps):
        fresh, left = relinearise(context, 0)
        context = fresh._replace(window=window_gaussian.weigh_holds(window_gaussian.solve(fresh.window)))
    return context, left


def remove_from_map(context: WindowState, keep: Booleans) -> WindowState:
    """Remove features (those not marked in `keep`) from the map; the measurements that they explained go on as
    tracks."""
    if keep.all():
        return context
    landmarks, log = context.landmarks, context.log
    lost: Booleans = np.asarray(np.isin(log.form, landmarks.ident[~keep]).any(axis=(1, 2)))
    tracks, log = resume(context.tracks, log, lost, context.cycle, context.window.step)
    form = log.form.copy()
    form[lost] = UNKNOWN
    log = log._replace(form=form)
    window, landmarks = window_features.drop_features(context.window, keep), remove_features(landmarks, keep)
    context = context._replace(window=window, landmarks=landmarks, log=log, tracks=tracks)
    return resolve(context, 2)[0]


def resume(tracks: WindowTracks, log: Log, lost: Booleans, cycle: int, step: Floats) -> tuple[WindowTracks, Log]:
    """Begin a track for each recently detected path among the rows `lost` of the measurement log."""
    forms, which = np.unique(log.form[:, 0], axis=0, return_inverse=True)
    track = log.track.copy()
    fresh: list[tuple[object, ...]] = []
    ident, time, panels = tracks.next_ident, np.concatenate([[0.0], np.cumsum(step)]), tracks.log_ris.shape[1]
    for number in np.unique(which[lost]):
        rows = (lost & (which == number)).nonzero()[0]
        if len(rows) < 4 or forms[number][0] == UNKNOWN:
            continue
        late = rows[-8:]
        when = time[log.cycle[late] - cycle - 1]
        when = when - when[-1]
        design = np.stack([np.ones(len(late)), when], axis=1)
        best, *_ = np.linalg.lstsq(design, log.seen[late], rcond=None)
        spread = np.zeros((3, 2, 2))
        spread[:, 0, 0], spread[:, 1, 1] = 4.0 * log.std[late[-1]] ** 2, (0.1 * np.array([1.0, 0.3, 0.3])) ** 2
        track[rows] = ident
        fresh.append((
            ident, best.T, spread, log.log_amplitude[late[-1]], log.side[late[-1]], log.cycle[rows[0]],
            *log.cycle[late[:-3:-1]], log.log_amplitude[late[-2]], len(rows), 0, CERTAIN,
            *(field[0] for field in (*unlike(1, panels), *unknown(1, panels))), nothing_heard(1)[0],
        ))  # fmt: skip
        ident += 1
    if not fresh:
        return tracks, log._replace(track=track)
    columns = [np.array([entry[place] for entry in fresh]) for place in range(len(fresh[0]))]
    joined = (np.concatenate(pair) for pair in zip(tracks[:-1], columns, strict=True))
    return WindowTracks._make([*joined, ident]), log._replace(track=track)


def features_to_remove(landmarks: WindowTable, left: Residuals, log: Log) -> Booleans:
    """Which features (F,) of the map to remove: those that probably do not exist, and those that their residuals
    contradict."""
    gone = landmarks.log_odds < np.log(CONSTANTS.dead / (1.0 - CONSTANTS.dead))
    form = log.form[left.row, 0]
    bounces = (form[:, 1:] != NONE).sum(axis=1)
    # a wall is told of by what comes over it alone, a point by what comes straight
    own = np.where(bounces == 1, form[:, 1:].max(axis=1), np.where(bounces == 0, form[:, 0], NONE))
    square = np.vecdot(left.left, left.left)
    order = np.lexsort((square, own))
    first = np.searchsorted(own[order], landmarks.ident)
    count = np.searchsorted(own[order], landmarks.ident, side="right") - first
    told = (count >= FEWEST).nonzero()[0]
    low, high = (square[order[first[told] + half]] for half in ((count[told] - 1) // 2, count[told] // 2))
    gone[told[0.5 * (low + high) > CONSTANTS.against]] = True
    return np.asarray(gone)
