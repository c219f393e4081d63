"""Hypotheses of what caused a track: every kind of path with one new feature, with initial values; known walls as
affine maps."""

from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import AXES, NONE, by_wall, reflect
from rislam_rt.slam.sampling import square_roots
from rislam_rt.slam.window.hypotheses.hypothesis_fits import Trials
from rislam_rt.slam.window.hypotheses.track_summary import TrackSummary
from rislam_rt.slam.window.landmarks.landmark_table import WindowTable

KINDS = (
    "wall", "known, wall", "wall, known", "point", "point over rx wall", "point over tx wall", "point over same",
    "two walls", "wall beside its edge", "image of known point", "the same on the tx leg", "image, known tx wall",
    "image of image", "image over known wall", "tx image, known rx wall", "wall and known, both ways",
)  # fmt: skip
"""Names of the kinds of hypotheses, by their number; the last six but one are images of known points in new walls
(`image_hypotheses`)."""
WALL, KNOWN_WALL, WALL_KNOWN, POINT, OVER_RX, OVER_TX, OVER_SAME, TWO_WALLS, BESIDE = range(9)
# at an acute angle two walls are met in either order, by paths as long and as loud that arrive from either side of the
# edge and come out as one; at an obtuse angle there is no path, at a right one a single one
*IMAGES, BOTH_WAYS = range(9, 16)
IMAGE, TX_IMAGE, BOTH_LEGS, THEN_WALL, WALL_THEN, OTHER_LEG = IMAGES

FAR = (TX_IMAGE, OTHER_LEG)
"""Kinds whose new wall mirrors a known point on the leg to the Tx."""
WALLS = (WALL, KNOWN_WALL, WALL_KNOWN, BESIDE, *IMAGES, BOTH_WAYS)
"""Kinds whose new feature is a wall."""
IS_WALL, IS_IMAGE, IS_FAR, IS_POINT = (
    np.isin(np.arange(len(KINDS)), some) for some in (WALLS, IMAGES, FAR, (POINT, OVER_RX, OVER_TX, OVER_SAME))
)
"""Which kinds (16,) have a wall for a new feature, are images of known points, are such images on the Tx leg, and have
a point for a new feature."""


class KnownFeatures(NamedTuple):
    """Features of the map, F of them: places and, for walls, reflections as affine maps."""

    place: Floats
    """(F, 3) [m] place of a point; of a wall, the mirror image of the agent's present position."""
    root: Floats
    """(F, 3, 3) square roots of the places' covariances."""
    turn: Floats
    """(F, 3, 3) linear part of each wall's reflection; the identity for points."""
    shift: Floats
    """(F, 3) [m] its translation; zero for points."""


class Hypotheses(NamedTuple):
    """Hypotheses of what caused T tracks, H in all: kind, known features on the path, and what the fit needs."""

    kind: Integers
    """(H,) number in `KINDS`."""
    known: Integers
    """(H,) row of the known wall (of the known point, for its image in a wall), -1 for none."""
    over: Integers
    """(H,) row of a second known wall, on the path of a known point's image, -1 for none."""
    trials: Trials
    """Inputs of the fits."""

    @property
    def pair(self) -> Integers:
        """(H,) which of `_pairs` two unknown walls make: opposite ones (0, and wherever there are none), two upright
        ones (1), or an upright and a level one (2)."""
        across, up = self.trials.turn[:, 0, 0, 0], self.trials.turn[:, 0, 2, 2]
        return np.where(self.trials.is_pair & (up < 0.0), 2, self.trials.is_pair & (across < 0.0)).astype(np.int64)

    def take(self, rows: Any) -> "Hypotheses":
        """Only some of the hypotheses of what caused a track."""
        trials = Trials._make(field[rows] for field in self.trials)
        return Hypotheses(self.kind[rows], self.known[rows], self.over[rows], trials)


def known_features(mean: Floats, covariance: Floats, landmarks: WindowTable, middle: Floats) -> KnownFeatures:
    """Known features for hypotheses: places, covariance roots and reflections of the map's features (F, 3), walls as
    images of `middle`, from their covariance (3F, 3F)."""
    place, count = mean.copy(), len(mean)
    blocks = covariance.reshape(count, 3, count, 3)[np.arange(count), :, np.arange(count)]
    turn, shift = np.tile(AXES, (count, 1, 1)), np.zeros((count, 3))
    walls = landmarks.walls
    if len(walls):
        wall, anchor = place[walls], landmarks.anchor[walls]
        blocks[walls] = (slope := by_wall(middle, wall, anchor)) @ blocks[walls] @ np.swapaxes(slope, 1, 2)
        place[walls] = reflect(np.broadcast_to(middle, wall.shape), wall, anchor)
        span = place[walls] - middle
        square = np.vecdot(span, span)[:, None]
        turn[walls] = AXES - 2.0 * span[:, :, None] * (span / square)[:, None, :]
        shift[walls] = span * (np.vecdot(span, place[walls] + middle)[:, None] / square)
    return KnownFeatures(place, square_roots(blocks), turn, shift)


def hypotheses(
    summary: TrackSummary, known: KnownFeatures, landmarks: WindowTable, *, both_ways: bool = True
) -> Hypotheses:
    """Hypotheses of every kind of what caused each track, with initial values of the new feature; images of known
    points in new walls stand in `image_hypotheses`, and `BOTH_WAYS` only if asked for."""
    (seen, tx, rx), ray, count = summary.mean, summary.direction, len(summary.seen)
    length, image, middle = seen[:, 0], rx + seen[:, :1] * ray, summary.middle
    walls, once = landmarks.walls, np.array([NONE])
    turn, shift = known.turn[walls], known.shift[walls, None]

    def mirror(spots: Floats) -> Floats:
        return np.asarray(spots @ np.swapaxes(turn, 1, 2) + shift)

    def wall_of(behind: Floats, base: Floats) -> Floats:
        return reflect(np.broadcast_to(middle, image.shape), behind, base)

    direct, alone, pairs = place_on_ray(ray, length, tx, rx), wall_of(image, tx), _pairs(ray)
    tx_image, behind, same = mirror(tx), mirror(image), mirror(direct)
    apparent = place_on_ray(ray, length, tx_image, rx)
    mirrored, aligned = mirror(apparent), walls[np.abs(turn[:, 2, 2]) > ALIGNED_TURN]
    # what lies higher comes of the edge with a level wall; what rises may itself be level, its edge an upright one's
    upright = np.column_stack([alone[:, :2], np.full(count, middle[2])])
    square = _square_to(alone, known.place[aligned] - middle, middle)
    beside = np.where((ray[:, 2] < UPRIGHT_RISE)[:, None], upright, square)
    some = walls if both_ways else walls[:0]
    acute = _acute(rx, ray, length, known.place[some] - middle, middle)
    # kind, known walls (W,), first guesses (W, T, 3), the walls on either leg, and about where these are met
    kinds: list[Any] = [
        (WALL, once, alone, NONE, NONE, tx, tx),
        (POINT, once, direct, NONE, NONE, tx, tx),
        (KNOWN_WALL, walls, wall_of(image, tx_image), walls, NONE, tx, tx),
        (WALL_KNOWN, walls, wall_of(behind, tx), NONE, walls, tx, behind),
        (OVER_RX, walls, mirrored, NONE, walls, tx, mirrored),
        (OVER_TX, walls, apparent, walls, NONE, apparent, tx),
        (OVER_SAME, walls, same, walls, walls, same, same),
        (BESIDE, aligned, beside, NONE, NONE, tx, tx),
        (BOTH_WAYS, some, acute, some, NONE, tx, tx),
        (TWO_WALLS, np.full(len(pairs), NONE), image - (pairs @ tx[..., None])[..., 0], NONE, NONE, tx, tx),
    ]
    kind, walled, *ends = (_every(kinds, column, np.int64) for column in (0, 1, 3, 4))
    start, *spots = (_every(kinds, column, np.float64, count, 3) for column in (2, 5, 6))
    legs = np.stack(ends, axis=1)
    turns, shifts, spreads = _over(known, legs, np.stack(spots, axis=1), middle)
    turns[kind == TWO_WALLS, :, 0] = pairs
    kind, walled = np.repeat(kind, count), np.repeat(walled, count)
    none = np.zeros(len(kind), dtype=np.bool_)
    trials = Trials(
        np.tile(np.arange(count), len(start)), IS_WALL[kind], kind == TWO_WALLS, start.reshape(-1, 3),
        turns.reshape(-1, 2, 3, 3), shifts.reshape(-1, 2, 3), spreads.reshape(-1, 2, 3, 3),
        np.isin(kind, (BESIDE, BOTH_WAYS)), kind == BOTH_WAYS,
        _beyond(kind, walled, known), none, none, none, np.zeros((len(kind), 3)),
    )  # fmt: skip
    return Hypotheses(kind, walled, np.full(len(kind), NONE), trials)


def _square_to(alone: Floats, across: Floats, middle: Floats) -> Floats:
    """Hypotheses of new walls at right angles to W known ones, whose images lie at `across` (W, 3) from `middle`: its
    images (W, T, 3) in them, those of walls `alone` (T, 3), but that what lies towards the known wall comes of the edge
    with that."""
    normal = across / np.maximum(np.linalg.norm(across, axis=1), 1e-6)[:, None]
    along = normal @ (alone - middle).T
    return np.asarray(alone - along[..., None] * normal[:, None])


def _acute(rx: Floats, heard: Floats, length: Floats, out: Floats, middle: Floats) -> Floats:
    """Images (W, T, 3) of `middle` in new walls that meet known ones, whose images lie at `out` (W, 3) from it, at an
    acute angle, along the edge towards which rays (T, 3) are `heard` at `rx` (T, 3): the paths' `length` (T,) is twice
    the edge's distance times the sine of the angle, and the mean of their directions is as much shorter than one.

    So that mean lies on the sphere whose diameter is the known wall's normal times `length` over twice its distance. Of
    the two points there above what is heard, the higher one counts, if it is within the unit sphere.
    """
    reach = np.maximum(np.linalg.norm(out, axis=1), 1e-6)
    normal = out / reach[:, None]
    depth = np.maximum(0.5 * reach[:, None] - normal @ (rx - middle).T, CONSTANTS.depth)
    diameter, flat = length / (2.0 * depth), np.vecdot(heard[:, :2], heard[:, :2])
    half, top = 0.5 * diameter * normal[:, 2:], np.sqrt(np.maximum(1.0 - flat, 0.0))
    root = np.sqrt(np.maximum(half**2 + diameter * (normal[:, :2] @ heard[:, :2].T) - flat, 0.0))
    rise = np.clip(np.where(half + root <= top, half + root, half - root), 0.0, top)
    ray = np.concatenate([np.broadcast_to(heard[:, :2], (*rise.shape, 2)), rise[..., None]], axis=-1)
    ray /= np.maximum(np.linalg.norm(ray, axis=-1, keepdims=True), 1e-6)
    toward = np.maximum((ray @ normal[..., None])[..., 0], CONSTANTS.dip)
    edge = depth / toward
    cos = np.sqrt(np.clip(1.0 - (length / (2.0 * edge)) ** 2, CONSTANTS.dip**2, 0.5))[..., None]
    along = ray - toward[..., None] * normal[:, None]
    along /= np.maximum(np.linalg.norm(along, axis=-1), 1e-6)[..., None]
    new = np.sqrt(1.0 - cos**2) * along - cos * normal[:, None]
    return np.asarray(middle + 2.0 * np.vecdot(new, rx - middle + edge[..., None] * ray)[..., None] * new)


def _every(kinds: list[Any], column: int, dtype: Any, *shape: int) -> Any:
    """One column of the table of hypothesis kinds, broadcast to a shape for each of their known walls."""
    stop = list(accumulate(len(kind[1]) for kind in kinds))
    found = np.empty((stop[-1], *shape), dtype)
    for kind, begin, end in zip(kinds, [0, *stop], stop, strict=False):
        found[begin:end] = kind[column]
    return found


def _over(known: KnownFeatures, legs: Integers, spots: Floats, middle: Floats) -> tuple[Floats, Floats, Floats]:
    """Linear parts (N, T, 2, 3, 3), translations (N, T, 2, 3) and error roots (N, T, 2, 3, 3) of the reflections in
    known walls on either leg (N, 2) of N hypotheses, `NONE` for none, at about the places (N, 2, T, 3) of T tracks."""
    count, nowhere = spots.shape[2], (middle + 1.0, np.zeros((3, 3)), AXES, np.zeros(3))
    place, root, turn, shift = (np.concatenate([field, none[None]]) for field, none in zip(known, nowhere, strict=True))
    slope = by_wall(spots, place[legs][:, :, None], middle)
    uncertainty = np.swapaxes(slope @ root[legs][:, :, None], 1, 2)
    turns, shifts = (np.repeat(field[legs][:, None], count, axis=1) for field in (turn, shift))
    return turns, shifts, uncertainty


def _beyond(kind: Integers, walled: Integers, known: KnownFeatures) -> Floats:
    """Linear part and translation (H, 3, 4) of the reflection in the known wall of hypotheses of a new wall whose
    return is unresolved from one that ends with that; zero elsewhere."""
    found, rows = np.zeros((len(kind), 3, 4)), np.isin(kind, (BESIDE, BOTH_WAYS)).nonzero()[0]
    if len(rows):
        found[rows, :, :3], found[rows, :, 3] = known.turn[walled[rows]], known.shift[walled[rows]]
    return found


UPRIGHT_RISE = 0.35
"""Vertical share of the way to a wall's image below which the wall may be upright."""
ALIGNED_TURN = 0.9
"""Vertical part of a reflection, kept or turned over, from which on its wall is upright or level."""


def _pairs(ray: Floats) -> Floats:
    """Linear parts (3, T, 3, 3) of reflections in two unknown walls: opposite ones, two upright ones, an upright and a
    level one."""
    count = len(ray)
    corner = np.broadcast_to(np.diag([-1.0, -1.0, 1.0]), (count, 3, 3))
    edge = np.stack([-ray[:, 1], ray[:, 0], np.zeros(count)], axis=1)
    edge = edge / np.maximum(np.linalg.norm(edge, axis=1), 1e-6)[:, None]
    return np.stack([np.broadcast_to(AXES, (count, 3, 3)), corner, 2.0 * edge[:, :, None] * edge[:, None, :] - AXES])


def place_on_ray(ray: Floats, length: Floats, tx: Floats, rx: Floats) -> Floats:
    """Points (..., 3) on arrival rays (..., 3) from Rx at which a path from Tx positions (..., 3), mirrored or not, has
    the given length."""
    base = tx - rx
    reach = (length**2 - np.vecdot(base, base)) / np.maximum(2.0 * (length - np.vecdot(base, ray)), 1e-3)
    return np.asarray(rx + np.maximum(reach, 0.05)[..., None] * ray)
