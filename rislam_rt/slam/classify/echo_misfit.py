"""Echo misfit: how badly a track fits the double bounce over two walls whose own returns are among the tracks.

A wall's return says where its image of the Tx is, hence where the wall is: halfway. The image over two walls is then
known, in place and in strength, without any map.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats

LENGTH_FLOOR, COSINE_FLOOR = 0.05, 0.03
"""Least standard deviations [m] and of a cosine of a predicted echo."""
MARGIN = 0.1
"""Log strength by which a wall's own return may be weaker than a double bounce over it and another."""
MAX_PARENTS = 24
"""Largest number of tracks, the strongest, that may be single walls' returns."""
FAR = 1e4
"""Misfit of a track that no pair of walls may explain."""


class Echo(NamedTuple):
    """Fit of T tracks to the double bounce over the best pair of walls."""

    misfit: Floats
    """Squared distance (T,), in standard deviations, from the predicted double bounce; `FAR` without any."""
    strength: Floats
    """Log strength (T,) beyond the product of both walls', 0 without any."""


def echo_misfit(seen: Floats, std: Floats, strength: Floats, offset: Floats) -> Echo:
    """Misfit of each of T tracks to the double bounce (echo) over the best two walls that other tracks show.

    `seen` (T, 3): length [m] and two cosines in the room's axes; `strength` (T,): log amplitude over that of free
    space of the same length; `offset` (3,) [m]: from Rx to Tx, in the room's axes.
    """
    count = len(seen)
    parents = np.argsort(-strength, kind="stable")[:MAX_PARENTS]
    if len(parents) < 2 or not count:
        return Echo(np.full(count, FAR), np.zeros(count))
    reach = np.maximum(np.linalg.norm(seen[:, 1:], axis=1, keepdims=True), 1.0)
    flat = seen[:, 1:] / reach
    # on the horizon noise alone would lift every other track: what one deviation explains counts as level
    blur = 2.0 * std[:, 1:].max(axis=1)
    up = np.sqrt(np.clip(1.0 - np.sum(flat**2, axis=1) - blur, 0.0, 1.0))
    image = seen[parents, :1] * np.concatenate([flat, up[:, None]], axis=1)[parents] - offset  # as seen from the Tx
    normal = image / np.maximum(np.linalg.norm(image, axis=1, keepdims=True), 1e-9)
    first, second = np.nonzero(~np.eye(len(parents), dtype=np.bool_))
    # the first wall's image of the Tx, mirrored in the second wall
    depth = np.sum(image[first] * normal[second], axis=1)
    double = image[first] + image[second] - 2.0 * depth[:, None] * normal[second] + offset
    length = np.linalg.norm(double, axis=1)
    cosines = double[:, :2] / np.maximum(length, 1e-9)[:, None]
    own = std**2 + np.array([LENGTH_FLOOR, COSINE_FLOOR, COSINE_FLOOR]) ** 2
    variance = own[:, None] + std[parents[first]] ** 2 + std[parents[second]] ** 2
    there = np.concatenate([length[:, None], cosines], axis=1)
    here = np.concatenate([seen[:, :1], flat], axis=1)
    miss = np.sum((here[:, None] - there) ** 2 / variance, axis=2)
    product = strength[parents[first]] + strength[parents[second]]
    weakest = np.minimum(strength[parents[first]], strength[parents[second]])
    rows = np.arange(count)[:, None]
    barred = (rows == parents[first]) | (rows == parents[second]) | (weakest < strength[:, None] - MARGIN)
    longest = np.maximum(seen[parents[first], 0], seen[parents[second], 0])
    barred |= (longest > seen[:, :1]) | (double[:, 2] < -COSINE_FLOOR * length)
    miss = np.where(barred, FAR, np.minimum(miss, FAR))
    best = np.argmin(miss, axis=1)
    found = miss[np.arange(count), best]
    return Echo(found, np.where(found < FAR, strength - product[best], 0.0))
