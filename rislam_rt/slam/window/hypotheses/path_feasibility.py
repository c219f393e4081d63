"""Path feasibility: whether a path over a known and a new wall bounces in order, on one side of each, and arrives from
above.

A return over a known and a new wall has a twin: the known wall's mirror image of the new one, met in the other order,
throws the same path. Which of the two it is nothing that is measured tells, but only one of them can throw it.
"""

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.planes import crossing
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import reflect
from rislam_rt.slam.window.hypotheses.hypotheses import (
    BOTH_WAYS,
    KNOWN_WALL,
    WALL_KNOWN,
    Hypotheses,
    KnownFeatures,
)
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary
from rislam_rt.slam.window.landmarks.path_forms import margins, planes
from rislam_rt.slam.window.solver_limits import STEP


def over_known(table: Hypotheses) -> Booleans:
    """Which hypotheses (H,) are wall returns over a known wall and a new one."""
    return np.isin(table.kind, (KNOWN_WALL, WALL_KNOWN, BOTH_WAYS))


def log_possible(
    table: Hypotheses, place: Floats, spread: Floats, summary: TrackSummary, known: KnownFeatures, cell: Floats
) -> Floats:
    """Log probability (H,) that the path over a known and a new wall is geometrically possible, over that beforehand,
    with new walls at `place` (H, 3) [m] within covariances `spread` (H, 3, 3) [m^2], known ones as uncertain as they
    are; 0 for other hypotheses. Beforehand it is one half: at a right angle one of two orders is possible, and of an
    acute and an obtuse angle the acute one has paths, in both orders.

    These come out as one component, the likelier the nearer they arrive, up to a `cell` (2,) of cosines apart (that of
    the array's axes, as if it were square or the body faced along the room's).
    """
    found, rows = np.zeros(len(table.kind)), over_known(table).nonzero()[0]
    if not len(rows):
        return found
    track, wall, kind = table.trials.track[rows], table.known[rows], table.kind[rows]
    _, tx, rx = (field[track] for field in summary.mean)
    value, vector = np.linalg.eigh(spread[rows])
    roots = vector * np.sqrt(np.maximum(value, 0.0))[:, None, :]
    # each as it is, and with either wall moved along the axes of its covariance
    new, old = np.tile(place[rows], (7, 1, 1)), np.tile(known.place[wall], (7, 1, 1))
    new[1:4] += np.moveaxis(roots, 2, 0)
    old[4:] += np.moveaxis(known.root[wall], 2, 0)
    ends = np.tile(tx, (7, 1)), np.tile(rx, (7, 1))
    log_order, ray = np.empty((2, len(rows))), np.empty((2, len(rows), 2))
    for order, walls in enumerate(((old, new), (new, old))):
        inner, outer = (each.reshape(-1, 3) for each in walls)
        margin, out = _margins(*ends, inner, outer, summary.middle)
        margin, *moved = margin.reshape(7, -1, 3)
        std = np.sqrt(((np.array(moved) - margin) ** 2).sum(axis=0) + STEP**2)
        log_order[order] = scipy.special.log_ndtr(margin / std).sum(axis=1)
        ray[order] = out.reshape(7, -1, 2)[0]
    merged = 1.0 - np.minimum((np.abs(ray[0] - ray[1]) / cell).max(axis=1), 1.0)
    own = np.where(kind == WALL_KNOWN, log_order[1], log_order[0])
    other = np.where(kind == WALL_KNOWN, log_order[0], log_order[1])
    both = other + np.log(np.maximum(merged, np.exp(CONSTANTS.log_lost)))
    found[rows] = np.log(2.0) + own + np.where(kind == BOTH_WAYS, both, 0.0)
    return found


def bounces(table: Hypotheses, place: Floats, summary: TrackSummary, known: KnownFeatures) -> tuple[Integers, Floats]:
    """Rows (N,) of the hypotheses over a known and a new wall, and the points (N, 3) [m] where their paths meet the new
    wall at `place`."""
    rows = over_known(table).nonzero()[0]
    track, wall, middle = table.trials.track[rows], table.known[rows], summary.middle
    _, tx, rx = (field[track] for field in summary.mean)
    first = (table.kind[rows] == WALL_KNOWN)[:, None]  # of both ways, one
    inner, outer = np.where(first, place[rows], known.place[wall]), np.where(first, known.place[wall], place[rows])
    image = reflect(tx, inner, middle)
    last = _met(rx, reflect(image, outer, middle), outer, middle)
    return rows, np.where(first, _met(last, image, inner, middle), last)


def _met(start: Floats, stop: Floats, wall: Floats, middle: Floats) -> Floats:
    """Points (N, 3) where paths between places (N, 3) meet walls (N, 3), given as mirror images of `middle`, to see
    whether they are feasible."""
    normal, offset = planes(wall, middle)
    return crossing(start, stop, *(np.vecdot(spot, normal) - offset for spot in (start, stop)))


def _margins(tx: Floats, rx: Floats, inner: Floats, outer: Floats, middle: Floats) -> tuple[Floats, Floats]:
    """Margins (N, 3) [m] by which paths from `tx` over walls `inner` and then `outer` (N, 3), images of `middle`, to
    `rx` are possible: the image before the last wall on the Rx's side of that, the last bounce on the Tx's side of the
    first wall, and how far above the horizon the path arrives; and the cosines (N, 2) from which it does."""
    ahead, _, deep, own = margins(tx, rx, middle, np.stack([inner, outer], axis=1))
    ray = reflect(reflect(tx, inner, middle), outer, middle) - rx
    length = np.linalg.norm(ray, axis=1)
    rise = ray[:, 2] + 2.0 * CONSTANTS.dip * length
    return np.stack([np.sign(own) * deep, ahead, rise], axis=1), ray[:, :2] / length[:, None]
