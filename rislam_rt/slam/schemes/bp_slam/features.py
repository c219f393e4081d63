"""Potential features: clouds with a probability of existing; birth, motion, pruning."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.schemes.bp_slam.config import BpSlamConfig
from rislam_rt.slam.schemes.bp_slam.ranges import RangeModel, random_directions


class Scan(NamedTuple):
    """What one anchor (or the agent's own receiver) measured in a step."""

    length: Floats
    """(M,) ranges [m], in no particular order."""
    std: Floats
    """(M,) standard deviations [m]."""


class Features(NamedTuple):
    """K potential features of all anchors together."""

    cloud: Floats
    """(K, N, D) equally likely positions [m]."""
    existence: Floats
    """(K,) probability."""
    anchor: Integers
    """(K,) the anchor whose ranges it explains."""
    ident: Integers
    """(K,) number for life."""
    known: Booleans
    """(K,) an anchor of known position: neither moves nor dies."""

    @property
    def mean(self) -> Floats:
        """(K, D) [m]."""
        return self.cloud.mean(axis=1)

    @property
    def covariance(self) -> Floats:
        """(K, D, D) [m^2]."""
        centred = self.cloud - self.cloud.mean(axis=1, keepdims=True)
        return np.einsum("kni,knj->kij", centred, centred) / self.cloud.shape[1]


KNOWN_FLOOR = 0.05
"""An anchor that is hidden for long is still looked for with this probability."""


def no_features(num_particles: int, dims: int) -> Features:
    """None yet."""
    whole = np.zeros(0, dtype=np.int64)
    return Features(np.zeros((0, num_particles, dims)), np.zeros(0), whole, whole, np.zeros(0, dtype=np.bool_))


def known_anchors(anchors: Floats, std: float, num_particles: int, *, rng: np.random.Generator) -> Features:
    """Features for anchors (A, D) known to `std` [m]; their numbers are 0 to A - 1."""
    count, dims = anchors.shape
    cloud = anchors[:, None] + std * rng.standard_normal((count, num_particles, dims))
    number = np.arange(count)
    return Features(cloud, np.ones(count), number, number, np.ones(count, dtype=np.bool_))


def predict_features(features: Features, config: BpSlamConfig, *, rng: np.random.Generator) -> Features:
    """Survival, and a small random walk."""
    walk = config.feature_std * rng.standard_normal(features.cloud.shape)
    existence = config.survival_probability * features.existence
    return features._replace(
        cloud=np.where(features.known[:, None, None], features.cloud, features.cloud + walk),
        existence=np.where(features.known, np.maximum(existence, KNOWN_FLOOR), existence),
    )


def birth_ratio(
    scan: Scan, undetected: float, model: RangeModel, dims: int, config: BpSlamConfig, max_range: float
) -> Floats:
    """(M,) expected density of first detections over that of clutter.

    `undetected` features are uniform over the region, whose measure is the integral of the model's shell.
    """
    inside = (scan.length > 0.0) & (scan.length <= max_range)
    length = np.where(inside, scan.length, 0.5 * max_range)
    region = model.shell(np.array(max_range), dims) * max_range / dims
    density = undetected * config.detection_probability * model.shell(length, dims) / region
    return np.where(inside, density, 0.0) / config.clutter_density


def born(
    scan: Scan, anchor: int, position: Floats, existence: Floats, model: RangeModel, first: int,
    upper_half: bool, *, rng: np.random.Generator,
) -> Features:  # fmt: skip
    """One new feature a measurement, spread over all directions from the agent particles (N, D)."""
    shown, (count, dims) = len(scan.length), position.shape
    length = scan.length[:, None] + scan.std[:, None] * rng.standard_normal((shown, count))
    direction = random_directions((shown, count), dims, upper_half, rng=rng)
    return Features(
        model.invert(position, direction, np.abs(length)),
        existence,
        np.full(shown, anchor),
        first + np.arange(shown),
        np.zeros(shown, dtype=np.bool_),
    )


def join(parts: list[Features]) -> Features:
    """All of them in one."""
    return Features(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def select(features: Features, rows: Booleans | Integers) -> Features:
    """Some of them."""
    return Features(*(column[rows] for column in features))


def prune(features: Features, config: BpSlamConfig) -> Features:
    """Without the improbable ones, and without the least probable beyond the number allowed per anchor."""
    order = np.lexsort([-features.existence, ~features.known, features.anchor])
    anchor = features.anchor[order]
    rank = np.arange(len(order)) - np.searchsorted(anchor, anchor)
    keep = np.zeros(len(order), dtype=np.bool_)
    keep[order] = rank < config.max_features
    return select(features, keep & (features.known | (features.existence >= config.pruning_threshold)))
