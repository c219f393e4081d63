"""Pruning of landmarks: those that fail to show, contradict the measurements, double another, or follow from others."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.nested.belief_moments import Moments
from rislam_rt.slam.nested.candidates import PredictedMeasurements
from rislam_rt.slam.nested.landmark_table import LandmarkTable
from rislam_rt.slam.nested.measurement_prediction import MapBelief
from rislam_rt.slam.returns import NONE, TX, reflect

MAX_DRIFT = 0.8
"""Running mean of whitened innovations beyond which a feature is not believed: five times its own spread."""
OLD_HITS, OLD_DRIFT = 100, 1.2
"""The same for features of long standing: more must speak against them."""
MAX_RATIO, MIN_RATIO = 0.25, -2.5
"""Bounds on the log amplitude ratio of a wall: it cannot amplify, and one that swallows all is none."""
ORPHAN_HITS = 40
"""Measurements by which a wall may outlive the point that it was found by."""
MIN_SHOWN = 0.1
"""Least share of the cycles in which a feature shows, of those in which it should."""
CLOSE = 0.5
"""Gap [m] beyond which two features are never one."""
SLACK = 0.03
"""Standard deviation [m] added when two descriptions of one thing are compared."""


def keepers(
    moments: Moments, table: LandmarkTable, predicted: PredictedMeasurements, belief: MapBelief, config: SlamConfig
) -> Booleans:
    """(F,) the features that pruning keeps."""
    if not len(table.ident):
        return np.zeros(0, dtype=np.bool_)
    old = np.where(table.hits >= OLD_HITS, OLD_DRIFT, MAX_DRIFT)
    keep = (table.detection_rate > MIN_SHOWN).all(axis=1) & (np.abs(table.drift).max(axis=1) < old)
    keep &= ~(table.is_wall & ((table.ratio > MAX_RATIO) | (table.ratio < MIN_RATIO)))
    keep &= ~_doubles(moments, table, config.nested.merge_distance)
    keep[: len(belief.table.ident)] &= ~_derived(moments, predicted, belief, config.nested.merge_distance)
    keep &= ~(table.is_wall & (table.hits < ORPHAN_HITS) & np.isin(table.parent, table.ident[~keep]))
    return keep


def _doubles(moments: Moments, table: LandmarkTable, distance: float) -> Booleans:
    """(F,) features to prune as doubles: the younger of any two of one kind that the belief cannot tell apart."""
    means = moments.features
    double = np.zeros(len(table.ident), dtype=np.bool_)
    for kind in (table.points, table.walls):
        for place, young in enumerate(kind[1:], start=1):
            for old in kind[:place]:
                other = means[young]
                if table.is_wall[young]:
                    other = reflect(table.anchor[old], means[young], table.anchor[young])
                spread = moments.block(int(old)) + moments.block(int(young))
                if not double[old] and _same(means[old] - other, spread, distance):
                    double[young] = True
    return double


def _derived(moments: Moments, predicted: PredictedMeasurements, belief: MapBelief, distance: float) -> Booleans:
    """(F,) features to prune as derived: points that are images of others, walls that other walls make together.

    A corner throws an image that a single slanted wall would throw as well, and walls on both legs make a static
    point of it: both are told by the walls that the map holds besides.
    """
    table, returns = belief.table, predicted.expected.returns
    derived = np.zeros(len(table.ident), dtype=np.bool_)
    legs = np.unique(returns.legs[returns.rx], axis=0) if len(returns.rx) else np.zeros((0, 3), dtype=np.int64)
    walled = legs[(legs[:, 0] != TX) & (legs[:, 1] != NONE)]
    if not len(walled):
        return derived
    image, spread = _images(moments, belief, walled)
    reach = np.linalg.norm(belief.features - belief.poses.rx, axis=1)
    for point in table.points:
        # an image lies farther away than what it is an image of
        others = (walled[:, 0] != point) & (reach[walled[:, 0]] < reach[point])
        gaps = image[others] - belief.features[point]
        spreads = spread[others] + moments.block(int(point))
        derived[point] = any(_same(g, s, distance) for g, s in zip(gaps, spreads, strict=True))
    single = walled[:, 2] == NONE
    for leg, place, own in zip(walled[single], image[single], spread[single], strict=True):
        rivals = (walled[:, 0] == leg[0]) & ~single & (walled[:, 1:] != leg[1]).all(axis=1)
        if any(_same(place - i, own + s, distance) for i, s in zip(image[rivals], spread[rivals], strict=True)):
            derived[leg[1]] = True
    return derived


def _images(moments: Moments, belief: MapBelief, legs: Integers) -> tuple[Floats, Floats]:
    """Images (G, 3) of legs at the mean belief, for pruning what they explain, with a covariance (G, 3, 3) from their
    features one by one."""
    image = belief.features[legs[:, 0]]
    spread = np.array([moments.block(int(row)) for row in legs[:, 0]])
    for column in (1, 2):
        rows = np.flatnonzero(legs[:, column] != NONE)
        walls = legs[rows, column]
        wall, anchor = belief.features[walls], belief.table.anchor[walls]
        lever = np.linalg.norm(image[rows] - anchor, axis=-1) / np.linalg.norm(wall - anchor, axis=-1)
        image[rows] = reflect(image[rows], wall, anchor)
        blocks = np.array([moments.block(int(w)) for w in walls]).reshape(-1, 3, 3)
        spread[rows] += (1.0 + lever)[:, None, None] ** 2 * blocks
    return image, spread


def _same(gap: Floats, spread: Floats, distance: float) -> bool:
    """Whether two features a `gap` (3,) apart are one and the younger is pruned, given the covariance of the gap."""
    if gap @ gap > CLOSE**2:
        return False
    return bool(gap @ np.linalg.solve(spread + SLACK**2 * np.eye(3), gap) < distance)
