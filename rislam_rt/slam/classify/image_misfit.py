"""Image misfit: how badly a track fits the image of another track's point in walls whose returns are among the tracks.

The counterpart of `echo_misfit` for landmarks: a wall's return says where the wall is, a point's where the point is; so
each path over the point and up to two of the walls, on either leg, is known in place and in strength. What lies behind
a mirror is an image as well, for no way over a wall is shorter than the straight one. Needs no map.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers

LENGTH_FLOOR, COSINE_FLOOR, STRENGTH_STD = 0.05, 0.02, 0.7
"""Least standard deviations [m] and of a cosine of a predicted image; that of its log strength."""
MAX_WALLS, MAX_POINTS = 8, 6
"""Largest number of tracks that are tried as walls and as points of an image, the likeliest first."""
LIKELY_RADIUS = 0.4
"""Radius [m] of a sphere of a track's strength above which it is hardly a point."""
NEAR_ECHO, ECHO_COST = 4.0, 6.0
"""Misfit at which an echo is half believed, and what a sure one costs a parent."""
FAR, OUTSIDE = 1e4, 3.0
"""Misfit of a track that is no point's image, and distance [m] from a mirror, where there is none."""


class Image(NamedTuple):
    """Fit of T tracks to the mirror image of the best point in the best walls."""

    misfit: Floats
    """Squared distance (T,) in standard deviations, the parents' uncertainty added; `FAR` without any."""
    strength: Floats
    """Log strength (T,) beyond the predicted one, 0 without any."""
    mirror: Floats
    """Distance (T,) [m], at most 3, by which a track's point is nearer to the Tx than to the Tx's image in a wall."""


class _Mirrors(NamedTuple):
    """Affine maps of N reflections in sequences of 0, 1 or 2 walls."""

    matrix: Floats
    """Linear parts (N, 3, 3)."""
    shift: Floats
    """Shifts (N, 3) [m]."""
    strength: Floats
    """Sums (N,) of the walls' log strengths."""
    cost: Floats
    """Sums (N,) of the walls' costs, what doubt there is that they are walls."""
    bounces: Integers
    """Number (N,) of walls."""
    walls: Integers
    """Tracks (N, 2) whose returns show the walls, -1 for none."""


def image_misfit(seen: Floats, std: Floats, strength: Floats, offset: Floats, still: Floats, echo: Floats) -> Image:
    """Misfit of each of T tracks to the image of another track's point in other tracks' walls, and distance to walls.

    `seen`, `std`, `strength`, `offset` as for `echo_misfit`; `still` (T,): probability that it moves as a static point
    does; `echo` (T,): its misfit as an echo.
    """
    count = len(seen)
    if count < 2:
        return Image(np.full(count, FAR), np.zeros(count), np.full(count, OUTSIDE))
    flat = seen[:, 1:] / np.maximum(np.linalg.norm(seen[:, 1:], axis=1, keepdims=True), 1.0)
    ray = np.concatenate([flat, np.sqrt(np.clip(1.0 - np.sum(flat**2, axis=1, keepdims=True), 0.0, 1.0))], axis=1)
    length = np.maximum(seen[:, 0], np.linalg.norm(offset) + 1e-3)
    reach = (length**2 - offset @ offset) / (2.0 * (length - ray @ offset))
    point, shown = reach[:, None] * ray, length[:, None] * ray
    echoed = ECHO_COST / (1.0 + echo / NEAR_ECHO)
    wall_cost = -2.0 * np.log(np.maximum(1.0 - still, 1e-3)) + echoed
    radius = strength + np.log(0.5 * length)
    point_cost = -2.0 * np.log(np.maximum(still, 1e-3)) + echoed
    point_cost += 2.0 * np.maximum(radius - np.log(LIKELY_RADIUS), 0.0)
    walls = np.argsort(wall_cost - 2.0 * strength + 0.3 * length, kind="stable")[:MAX_WALLS]
    points = np.argsort(point_cost + 0.7 * length, kind="stable")[:MAX_POINTS]
    mirrors = _mirrors(shown[walls], offset, strength[walls], wall_cost[walls], walls)
    place, level, uncertainty, parents = _predict(
        mirrors, point[points], offset, strength[points], length[points], points
    )
    uncertainty = uncertainty + point_cost[parents[:, 0]]
    variance = std[:, None] ** 2 + std[parents[:, 0]] ** 2 + np.array([LENGTH_FLOOR, COSINE_FLOOR, COSINE_FLOOR]) ** 2
    here = np.concatenate([seen[:, :1], flat], axis=1)
    miss = np.sum((here[:, None] - place) ** 2 / variance, axis=2)
    miss += ((strength[:, None] - level) / STRENGTH_STD) ** 2 + uncertainty
    own = (np.arange(count)[:, None, None] == parents).any(axis=2)
    miss = np.where(own, FAR, np.minimum(miss, FAR))
    best = np.argmin(miss, axis=1)
    found = miss[np.arange(count), best]
    beyond = np.where(found < FAR, strength - level[best], 0.0)
    return Image(found, np.clip(beyond, -5.0, 5.0), _mirror_gap(point, shown, offset, walls, wall_cost))


def _mirrors(shown: Floats, offset: Floats, strength: Floats, cost: Floats, walls: Integers) -> _Mirrors:
    """Mirrors for the image misfit: reflections in all sequences of up to two walls, from the images (W, 3) of the Tx
    that their returns show."""
    normal = shown - offset
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    depth = np.sum(0.5 * (shown + offset) * normal, axis=1)
    flip = np.eye(3) - 2.0 * normal[:, :, None] * normal[:, None, :]
    shift = 2.0 * depth[:, None] * normal
    first, second = np.nonzero(~np.eye(len(walls), dtype=np.bool_))
    none = np.full(len(walls), -1)
    return _Mirrors(
        np.concatenate([np.eye(3)[None], flip, flip[second] @ flip[first]]),
        np.concatenate([np.zeros((1, 3)), shift, np.einsum("nij,nj->ni", flip[second], shift[first]) + shift[second]]),
        np.concatenate([[0.0], strength, strength[first] + strength[second]]),
        np.concatenate([[0.0], cost, cost[first] + cost[second]]),
        np.concatenate([[0], np.ones(len(walls), dtype=np.int64), np.full(len(first), 2)]),
        np.concatenate([[[-1, -1]], np.stack([walls, none], 1), np.stack([walls[first], walls[second]], 1)]),
    )


def _predict(
    mirrors: _Mirrors, point: Floats, offset: Floats, strength: Floats, length: Floats, points: Integers
) -> tuple[Floats, Floats, Floats, Integers]:
    """Images of points in mirrors whose misfit is asked: returns (C, 3), log strengths (C,), uncertainties (C,),
    parents (C, 5)."""
    rx, tx = np.nonzero(mirrors.bounces[:, None] + mirrors.bounces <= 2)
    keep = mirrors.bounces[rx] + mirrors.bounces[tx] > 0
    rx, tx = rx[keep], tx[keep]
    image = np.einsum("nij,pj->pni", mirrors.matrix, point) + mirrors.shift
    to_rx = np.maximum(np.linalg.norm(image, axis=2), 1e-3)
    to_tx = np.maximum(np.linalg.norm(image - offset, axis=2), 1e-3)
    total = to_rx[:, rx] + to_tx[:, tx]
    cosines = image[:, rx, :2] / to_rx[:, rx, None]
    level = (strength - np.log(length))[:, None] + np.log(total) + mirrors.strength[rx] + mirrors.strength[tx]
    level += np.log(to_rx[:, :1] * to_tx[:, :1] / (to_rx[:, rx] * to_tx[:, tx]))
    uncertainty = np.broadcast_to(mirrors.cost[rx] + mirrors.cost[tx], total.shape)
    # what would come from below the horizon is not heard
    uncertainty = np.where(image[:, rx, 2] < -COSINE_FLOOR * to_rx[:, rx], FAR, uncertainty)
    walls = np.concatenate([mirrors.walls[rx], mirrors.walls[tx]], axis=1)
    own = np.broadcast_to(points[:, None, None], (*total.shape, 1))
    parents = np.concatenate([own, np.broadcast_to(walls, (len(points), *walls.shape))], axis=2)
    place = np.concatenate([total[..., None], cosines], axis=2)
    return place.reshape(-1, 3), level.ravel(), uncertainty.ravel(), parents.reshape(-1, 5)


def _mirror_gap(point: Floats, shown: Floats, offset: Floats, walls: Integers, cost: Floats) -> Floats:
    """Distance (T,) [m] by which points are nearer to the Tx than to its images in walls, for the image misfit;
    doubtful walls count less."""
    gap = np.linalg.norm(point[:, None] - shown[walls], axis=2) - np.linalg.norm(point - offset, axis=1)[:, None]
    own: Booleans = np.arange(len(point))[:, None] == walls
    return np.asarray(np.minimum(np.where(own, OUTSIDE, gap + 0.1 * cost[walls]).min(axis=1), OUTSIDE))
