"""Explained walls: planes of the map that were born of the return over two other walls, and are taken back."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import AXES, NONE, TX, by_wall, reflect
from rislam_rt.slam.window.hypotheses.hypothesis_evidence import direction_beliefs, log_right
from rislam_rt.slam.window.landmarks.duplicate_walls import log_same_place
from rislam_rt.slam.window.landmarks.path_forms import margins
from rislam_rt.slam.window.smoother import window_gaussian
from rislam_rt.slam.window.smoother.motion_basis import HEAD
from rislam_rt.slam.window.solver_limits import NEARBY
from rislam_rt.slam.window.state import WindowState


def explained_walls(context: WindowState) -> Booleans:
    """Whether each feature (F,) of the map is a wall that two nearer walls explain: where it was born, and where it was
    heard last, they throw the agent's image to where it has it.

    The images differ by the joint covariance of all three. Else the wall has its image anywhere and in any direction,
    as births have it (`log_own_place`); that the return over two walls is held for a wall is `rare`, and it may be over
    any two that are nearer.
    """
    landmarks, walls = context.landmarks, context.landmarks.walls
    found = np.zeros(len(landmarks.ident), dtype=np.bool_)
    if len(walls) < 3 or not context.scene.use_vt:
        return found
    mean, covariance = window_gaussian.now(context.window)
    features, covariance = mean[HEAD:].reshape(-1, 3), covariance[HEAD:, HEAD:]
    place, anchor = features[walls], landmarks.anchor[walls]
    blocks = covariance.reshape(len(features), 3, len(features), 3).swapaxes(1, 2)[walls[:, None], walls]
    rows, pairs = nearer_pairs(place, anchor)
    if not len(rows):
        return found
    one = np.minimum(*(
        log_explained(spot[rows[:, 0]], rows, place, anchor, blocks) for spot in (anchor, _heard_last(context, anchor))
    ))  # fmt: skip
    odds = one + CONSTANTS.log_rare - np.log(pairs)
    for wall in np.unique(rows[:, 0]):
        others = reflect(anchor[wall], np.delete(place, wall, axis=0), np.delete(anchor, wall, axis=0))
        two = log_own_place(place[wall], blocks[wall, wall], anchor[wall], others)
        found[walls[wall]] = odds[rows[:, 0] == wall].max() - two > CONSTANTS.log_born
    return found


def nearer_pairs(place: Floats, anchor: Floats) -> tuple[Integers, Floats]:
    """Rows (N, 3) of walls and of two others over which, from where the first was born, the agent's image lies about
    where it has it, for W walls given as images `place` (W, 3) [m] of anchors (W, 3); and among how many pairs (N,)
    they are. Both others are nearer, or each of the three would be explained; and their path can be."""
    each = reflect(anchor[:, None], place, anchor)  # (W, W, 3): from where the first was born, in the second
    length = np.linalg.norm(each - anchor[:, None], axis=2)
    nearer = length < np.diagonal(length)[:, None]
    count = nearer.sum(axis=1)
    both = reflect(each[:, :, None], place, anchor)
    about = np.linalg.norm(both - place[:, None, None], axis=3) < NEARBY
    pair = nearer[:, :, None] & nearer[:, None] & ~np.eye(len(place), dtype=np.bool_)
    rows = np.stack((pair & about).nonzero(), axis=1)
    agent, over = anchor[rows[:, 0]], rows[:, 1:]
    ahead, _, outer, own = margins(agent, agent, anchor[over], place[over])
    rows = rows[(ahead > -CONSTANTS.depth) & (np.sign(own) * outer > -CONSTANTS.depth)]
    return rows, (count * (count - 1.0))[rows[:, 0]]


def log_explained(spot: Floats, rows: Integers, place: Floats, anchor: Floats, blocks: Floats) -> Floats:
    """Log density (N,) [1/m^3] of the gaps between the images of the agent at spots (N, 3) [m] in walls and over pairs
    of walls, by rows (N, 3), of walls with covariances `blocks` (W, W, 3, 3) [m^2] among them, if they are the same
    place."""
    wall, first, second = rows.T
    inner = reflect(spot, place[first], anchor[first])
    gap = reflect(inner, place[second], anchor[second]) - reflect(spot, place[wall], anchor[wall])
    span = place[second] - anchor[second]
    flip = AXES - 2.0 * span[:, :, None] * (span / np.vecdot(span, span)[:, None])[:, None, :]
    slopes = np.concatenate(
        [-by_wall(spot, place[wall], anchor[wall]), flip @ by_wall(spot, place[first], anchor[first]),
         by_wall(inner, place[second], anchor[second])], axis=2,
    )  # fmt: skip
    spread = blocks[rows[:, :, None], rows[:, None, :]].swapaxes(2, 3).reshape(-1, 9, 9)
    return log_same_place(gap, slopes @ spread @ np.swapaxes(slopes, 1, 2) + 1e-8 * AXES)


def log_own_place(place: Floats, spread: Floats, middle: Floats, others: Floats) -> float:
    """Log density [1/m^3] of a wall's place (3,) [m], the image of `middle` within a covariance `spread` (3, 3) [m^2],
    if it is a wall of its own: at any distance, in any direction but for what is known of directions beforehand
    (`direction_beliefs`, each by itself), with the images `others` (W, 3) [m] of `middle` in other walls."""
    beliefs, sure = direction_beliefs(place, middle, others), np.logaddexp(0.0, CONSTANTS.log_upright)
    reach = np.linalg.norm(place - middle)
    value = -np.log(8.0 * np.pi * CONSTANTS.size * reach**2)
    if not len(beliefs.std):
        return float(value - sure)  # it slants
    variance = np.vecdot(beliefs.axis, beliefs.axis @ spread) + beliefs.std**2
    off = beliefs.axis @ place - beliefs.aim
    told = log_right(beliefs.log_odds, off, variance)
    return float(value + (np.logaddexp(0.0, told) - sure).sum())


def _heard_last(context: WindowState, anchor: Floats) -> Floats:
    """Positions (W, 3) [m] of the agent in the last cycle of the window in which each wall was heard by itself; where
    it was born, `anchor` (W, 3), if in none."""
    log, where = context.log, window_gaussian.poses(context.window)
    spot = anchor.copy()
    single = (log.form[:, 0, :3] == [TX, NONE, NONE]).all(axis=1) & (log.form[:, 0, 4] == NONE)
    slot = log.cycle - (context.cycle - len(where) + 1)
    for row, ident in enumerate(context.landmarks.ident[context.landmarks.walls]):
        own = slot[single & (log.form[:, 0, 3] == ident) & (slot >= 0)]
        if len(own):
            spot[row] = where[own.max(), :3]
    return spot
