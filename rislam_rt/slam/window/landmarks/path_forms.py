"""Forms: the ways by which a signal gets from Tx to Rx over the features of the map.

A form is five feature rows: the base (a point, or `TX` where the Tx itself is mirrored), two walls on the Tx leg and
two on the Rx leg, the one next to the base first, `NONE` where there is none. What a form looks like from a pose, and
how that moves with pose and features, is `slam.returns`.
"""

from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.returns import NONE, TX, Poses, Returns, reflect

UNKNOWN = -9
"""In a form's base: it is not known."""


class FormLegs(NamedTuple):
    """Forms, joined from legs that many of them share."""

    returns: Returns
    bounces: Integers
    """(R,) on both legs together."""


def compile_forms(forms: Integers) -> Returns:
    """Forms (R, 5) as returns over the legs that they need."""
    legs = np.concatenate([forms[:, :3], forms[:, [0, 3, 4]]])
    base = int(legs.max(initial=0)) + 3
    code = ((legs[:, 0] + 1) * base + legs[:, 1] + 1) * base + legs[:, 2] + 1
    _, first, place = np.unique(code, return_index=True, return_inverse=True)
    return Returns(legs[first], place[: len(forms)], place[len(forms) :])


def forms_of(returns: Returns) -> Integers:
    """(R, 5)."""
    return np.concatenate([returns.legs[returns.tx], returns.legs[returns.rx][:, 1:]], axis=1)


@lru_cache(maxsize=64)
def enumerate_forms(points: tuple[int, ...], walls: tuple[int, ...], max_bounces: int, use_vt: bool) -> FormLegs:
    """Every point over every pair of legs, and with `use_vt` the images of the Tx."""
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
    if use_vt:
        found += [(TX, NONE, NONE, *way) for way in ways[1:]]
    forms = np.array(found, dtype=np.int64).reshape(-1, 5)
    return FormLegs(compile_forms(forms), (forms[:, 1:] != NONE).sum(axis=1))


def possible_legs(legs: Integers, features: Floats, anchor: Floats, poses: Poses) -> Booleans:
    """(G,) whether each bounce of a leg (G, 3) has both its neighbours on one side of its wall; poses of one cycle.

    The Tx and Rx are near each other: one serves for both. A point that lies in the wall (the panel in its host) has no
    image in it.
    """
    count = len(legs)
    base = np.where((legs[:, 0] == TX)[:, None], poses.tx, features[legs[:, 0]] if len(features) else 0.0)
    far = np.broadcast_to(poses.rx, base.shape).copy()
    fine = np.ones(count, dtype=np.bool_)
    image = base.copy()
    one = (legs[:, 1] != NONE).nonzero()[0]
    image[one] = reflect(base[one], features[legs[one, 1]], anchor[legs[one, 1]])
    two = (legs[:, 2] != NONE).nonzero()[0]
    near, device = _depths(legs[two, 2], image[two], far[two], features, anchor)
    fine[two] = (near * device > 0.0) & (np.abs(near) > CONSTANTS.depth)
    # where the ray from the device meets the outer wall: the next end for the inner one
    mirrored = image[two] - 2.0 * near[:, None] * _normals(legs[two, 2], features, anchor)
    share = device / np.where(np.abs(device + near) > 1e-9, device + near, 1e-9)
    far[two] += np.clip(share, 0.0, 1.0)[:, None] * (mirrored - far[two])
    near, device = _depths(legs[one, 1], base[one], far[one], features, anchor)
    fine[one] &= (near * device > 0.0) & (np.abs(near) > CONSTANTS.depth)
    return fine


def _normals(walls: Integers, features: Floats, anchor: Floats) -> Floats:
    span = features[walls] - anchor[walls]
    return np.asarray(span / np.sqrt(np.vecdot(span, span))[:, None])


def _depths(walls: Integers, first: Floats, second: Floats, features: Floats, anchor: Floats) -> tuple[Floats, Floats]:
    """Signed distances (W,) of two sets of points (W, 3) from walls."""
    normal, middle = _normals(walls, features, anchor), 0.5 * (features[walls] + anchor[walls])
    return np.vecdot(first - middle, normal), np.vecdot(second - middle, normal)
