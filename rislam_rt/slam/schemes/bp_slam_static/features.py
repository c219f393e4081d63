"""Potential features: clouds with a probability of existing; birth, motion, pruning."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.schemes.bp_slam_static.config import BpSlamStaticConfig
from rislam_rt.slam.schemes.shared.ranges import RangeModel, random_directions
from rislam_rt.slam.schemes.shared.resampling import (
    cell_levels,
    cell_order,
    effective_fraction,
    normalised_rows,
    resample_systematic,
)
from rislam_rt.slam.schemes.shared.scan import Scan

RESAMPLE_BELOW = 0.25
"""Effective fraction of a feature's particles below which it is resampled."""
SHARE = 0.7
"""Power of the weights by which resampling draws; the rest stays with the particles."""
KNOWN_FLOOR = 0.05
"""An anchor that is hidden for long is still looked for with this probability."""


class Features(NamedTuple):
    """K potential features of all anchors together."""

    cloud: Floats
    """(K, N, D) positions [m], where the agent is at its mean."""
    log_weight: Floats
    """(K, N), up to a constant a row."""
    slope: Floats
    """(K, 2D, D) by how much a feature moves with the agent's position and velocity; see `coupling`."""
    existence: Floats
    """(K,) probability."""
    anchor: Integers
    """(K,) the anchor whose ranges it explains."""
    ident: Integers
    """(K,) number for life."""
    known: Booleans
    """(K,) an anchor of known position: neither moves nor dies."""

    @property
    def weight(self) -> Floats:
        """(K, N), every row summing to one."""
        return normalised_rows(self.log_weight)

    def moments(self, agent: Floats) -> tuple[Floats, Floats]:
        """Mean (K, D) [m] and covariance (K, D, D) [m^2], given the covariance (2D, 2D) of the agent's state."""
        weight = self.weight
        mean = np.einsum("kn,knd->kd", weight, self.cloud)
        centred = self.cloud - mean[:, None]
        covariance = np.einsum("kn,kni,knj->kij", weight, centred, centred)
        return mean, covariance + np.swapaxes(self.slope, 1, 2) @ agent @ self.slope


def make_features(cloud: Floats, existence: Floats, anchor: Integers, ident: Integers, known: bool = False) -> Features:
    """Features of equally likely particles that owe nothing to the agent's present state."""
    count, particles, dims = cloud.shape
    return Features(
        cloud,
        np.zeros((count, particles)),
        np.zeros((count, 2 * dims, dims)),
        existence,
        anchor,
        ident,
        np.full(count, known),
    )


def no_features(num_particles: int, dims: int) -> Features:
    """No features of static BP-SLAM yet."""
    whole = np.zeros(0, dtype=np.int64)
    return make_features(np.zeros((0, num_particles, dims)), np.zeros(0), whole, whole)


def known_anchors(anchors: Floats, std: float, num_particles: int, *, rng: np.random.Generator) -> Features:
    """Features for anchors (A, D) known to `std` [m]; their numbers are 0 to A - 1."""
    count, dims = anchors.shape
    cloud = anchors[:, None] + std * rng.standard_normal((count, num_particles, dims))
    number = np.arange(count)
    return make_features(cloud, np.ones(count), number, number, known=True)


def predict_features(features: Features, config: BpSlamStaticConfig, *, rng: np.random.Generator) -> Features:
    """Static features one step on: survival, and a small random walk."""
    walk = config.feature_std * rng.standard_normal(features.cloud.shape)
    existence = config.survival_probability * features.existence
    return features._replace(
        cloud=np.where(features.known[:, None, None], features.cloud, features.cloud + walk),
        existence=np.where(features.known, np.maximum(existence, KNOWN_FLOOR), existence),
    )


def born(
    scan: Scan, anchor: int, position: Floats, existence: Floats, model: RangeModel, first: int,
    config: BpSlamStaticConfig, *, rng: np.random.Generator,
) -> Features:  # fmt: skip
    """One new feature a measurement, numbered from `first`, spread over all directions from agents (N, D).

    A new feature moves with the agent's position one to one: the ring is drawn about wherever the agent is.
    """
    shown, (count, dims) = len(scan.length), position.shape
    length = scan.length[:, None] + scan.std[:, None] * rng.standard_normal((shown, count))
    direction = random_directions((shown, count), dims, model.upper_half, rng=rng)
    center = position.mean(axis=0) if config.coupled else position
    cloud = model.invert(center, direction, np.abs(length))
    if dims > 2:
        cloud = np.take_along_axis(cloud, cell_order(cloud, cell_levels(count))[..., None], axis=1)
    new = make_features(cloud, existence, np.full(shown, anchor), first + np.arange(shown))
    new.slope[:, :dims] = np.eye(dims) if config.coupled else 0.0
    return new


def refresh(features: Features, *, rng: np.random.Generator) -> Features:
    """Those features resampled whose weights rest on too few particles."""
    rows = np.flatnonzero(effective_fraction(features.weight) < RESAMPLE_BELOW)
    if not len(rows):
        return features
    cloud, log_weight = features.cloud.copy(), features.log_weight.copy()
    cloud[rows], log_weight[rows] = resample_systematic(cloud[rows], log_weight[rows], SHARE, rng=rng)
    return features._replace(cloud=cloud, log_weight=log_weight)


def join(parts: list[Features]) -> Features:
    """All sets of features in one."""
    return Features._make(np.concatenate(columns) for columns in zip(*parts, strict=True))


def select(features: Features, rows: Booleans | Integers) -> Features:
    """Some of the features of static BP-SLAM."""
    return Features._make(column[rows] for column in features)


def prune(features: Features, config: BpSlamStaticConfig) -> Features:
    """Static features without improbable ones, and without the least probable beyond the number allowed per anchor."""
    order = np.lexsort([-features.existence, ~features.known, features.anchor])
    anchor = features.anchor[order]
    rank = np.arange(len(order)) - np.searchsorted(anchor, anchor)
    keep = np.zeros(len(order), dtype=np.bool_)
    keep[order] = rank < config.max_features
    return select(features, keep & (features.known | (features.existence >= config.pruning_threshold)))
