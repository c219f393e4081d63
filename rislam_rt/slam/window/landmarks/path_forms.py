"""Forms: the ways by which a path gets from Tx to Rx over features of the map, a point and up to two walls on either
leg.

A form is five feature rows: the base (a point, or `TX` where the Tx itself is mirrored), two walls on the Tx leg and
two on the Rx leg, the one next to the base first, `NONE` where there is none. What a form looks like from a pose, and
how that moves with pose and features, is `slam.predicted_returns`.
"""

from functools import lru_cache
from itertools import product

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.geometry.planes import crossing
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import NONE, TX, Poses, Returns
from rislam_rt.slam.window.solver_limits import STEP

UNKNOWN = -9
"""Base of a form that is not known."""


def forms_apart(forms: Integers) -> Returns:
    """Returns of the forms (R, 5), with legs stored for each return separately, shared or not."""
    count = np.arange(len(forms))
    return Returns(np.concatenate([forms[:, :3], forms[:, [0, 3, 4]]]), count, len(forms) + count)


def compile_forms(forms: Integers) -> Returns:
    """Returns of the forms (R, 5), with each distinct leg stored once."""
    legs, tx, rx = forms_apart(forms)
    base = int(legs.max(initial=0)) + 3
    code = ((legs[:, 0] + 1) * base + legs[:, 1] + 1) * base + legs[:, 2] + 1
    _, first, place = np.unique(code, return_index=True, return_inverse=True)
    return Returns(legs[first], place[tx], place[rx])


def forms_of(returns: Returns) -> Integers:
    """Forms (R, 5), base and walls on either leg, of some returns."""
    return np.concatenate([returns.legs[returns.tx], returns.legs[returns.rx][:, 1:]], axis=1)


@lru_cache(maxsize=64)
def enumerate_forms(points: tuple[int, ...], walls: tuple[int, ...], max_bounces: int) -> tuple[Returns, Integers]:
    """All returns over points and walls of the map with up to `max_bounces` walls, over legs that they share, and the
    number of walls (R,) on each."""
    single = [(w, NONE) for w in walls] if max_bounces >= 1 else []
    double = [(a, b) for a, b in product(walls, walls) if a != b] if max_bounces >= 2 else []
    ways = [(NONE, NONE), *single, *double]
    bounces = [0] + [1] * len(single) + [2] * len(double)
    upto = [1, 1 + len(single), len(ways)]  # the first ways, of so many bounces at most
    found = [
        (point, *way, *other)
        for point in points
        for way, spent in zip(ways, bounces, strict=True)
        for other in ways[: upto[max_bounces - spent]]
    ]
    found += [(TX, NONE, NONE, *way) for way in ways[1:]]
    forms = np.array(found, dtype=np.int64).reshape(-1, 5)
    return compile_forms(forms), (forms[:, 1:] != NONE).sum(axis=1)


def possible_legs(legs: Integers, features: Floats, covariance: Floats, anchor: Floats, poses: Poses) -> Booleans:
    """Whether each leg (G, 3) of a path's form is geometrically possible: every bounce has both its neighbours on one
    side of its wall, at the poses of one cycle.

    Two walls at right angles throw a path back in one order or the other: the ray meets both near their edge, and which
    comes first hangs on the baseline between Tx and Rx, and on angles of which the features (F, 3) know no more than
    `covariance` (3F, 3F). If neither order is possible at the mean, the nearer one is, within two deviations. Legs are
    sorted as `compile_forms` sorts them, and come in both orders.

    The Tx and Rx are near each other: one serves for both. A point that lies in the wall (the panel in its host) has no
    image in it.
    """
    count = len(legs)
    base = np.where((legs[:, 0] == TX)[:, None], poses.tx, features[legs[:, 0]] if len(features) else 0.0)
    sound, ahead = np.ones(count, dtype=np.bool_), np.full(count, np.inf)
    one, two = ((legs[:, 1] != NONE) & (legs[:, 2] == NONE)).nonzero()[0], (legs[:, 2] != NONE).nonzero()[0]
    normal, offset = planes(features[legs[one, 1]], anchor[legs[one, 1]])
    near = np.vecdot(base[one], normal) - offset
    sound[one], ahead[one] = np.abs(near) > CONSTANTS.depth, np.sign(near) * (normal @ poses.rx - offset)
    ahead[two], near, outer, own = margins(base[two], poses.rx, anchor[legs[two, 1:]], features[legs[two, 1:]])
    sound[two] = (outer * own > 0.0) & (np.minimum(np.abs(near), np.abs(outer)) > CONSTANTS.depth)
    fine = sound & (ahead > 0.0)
    mate = _swapped(legs, two)
    edge = two[sound[two] & ~fine[two] & ~fine[mate]]
    if len(edge):
        behind = np.full(count, np.inf)
        behind[edge] = -ahead[edge] / _margin_std(base[edge], poses.rx, anchor, features, legs[edge, 1:], covariance)
        nearer = (behind[two] < behind[mate]) | ((behind[two] == behind[mate]) & (two < mate))
        fine[two] |= nearer & (behind[two] < 2.0)
    return fine


def margins(base: Floats, device: Floats, anchor: Floats, walls: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Margins (..., N) [m] of forms over two walls: how far the bounce on the second of the `walls` (..., N, 2, 3) lies
    on the base's side of the first, for the ray from `device` (3,) or (N, 3) over both walls to `base` (N, 3).

    Also depths (..., N): of the base before the first wall, and of its image and of the device before the second, which
    are on one side if the path can be.
    """
    normal, offset = planes(walls, anchor)
    (first, second), (start, stop) = np.moveaxis(normal, -2, 0), np.moveaxis(offset, -1, 0)
    near = np.vecdot(base, first) - start
    image = base - 2.0 * near[..., None] * first
    outer, own = np.vecdot(image, second) - stop, np.vecdot(device, second) - stop
    # where the ray from the device meets the outer wall: the next end for the inner one
    edge = crossing(device, image - 2.0 * outer[..., None] * second, own, -outer)
    return np.sign(near) * (np.vecdot(edge, first) - start), near, outer, own


def _margin_std(
    base: Floats, device: Floats, anchor: Floats, features: Floats, walls: Integers, covariance: Floats
) -> Floats:
    """Standard deviations (N,) [m] of the margins of legs over two walls (N, 2), from the covariance of these walls."""
    moves = STEP * np.eye(7, 6, -1).reshape(7, 1, 2, 3)
    every = margins(base, device, anchor[walls], features[walls] + moves)[0]
    along = ((every[1:] - every[0]) / STEP).T
    rows = (3 * walls[:, :, None] + np.arange(3)).reshape(len(walls), 6)
    block = covariance[rows[:, :, None], rows[:, None, :]]
    return np.asarray(np.sqrt(np.maximum(np.vecdot(along, (block @ along[..., None])[..., 0]), STEP**2)))


def _swapped(legs: Integers, two: Integers) -> Integers:
    """Rows of the legs of paths' forms that run over the same two walls as the legs `two`, in the other order."""
    base = int(legs.max(initial=0)) + 3
    code, other = (
        ((row[:, 0] + 1) * base + row[:, 1] + 1) * base + row[:, 2] + 1 for row in (legs, legs[two][:, [0, 2, 1]])
    )
    return np.searchsorted(code, other)


def planes(wall: Floats, anchor: Floats) -> tuple[Floats, Floats]:
    """Unit normals (..., 3) and offsets (...,) of the planes of walls in paths' forms, `n . x = offset`, from the
    mirror images (..., 3) of anchors in them."""
    span = wall - anchor
    normal = np.asarray(span / np.sqrt(np.vecdot(span, span))[..., None])
    return normal, 0.5 * np.vecdot(wall + anchor, normal)
