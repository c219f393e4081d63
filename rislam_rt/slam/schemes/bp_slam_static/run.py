"""A run of BP-SLAM in its published setting: static anchors of known position, ranges per anchor and step."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rislam_rt.arrays import Floats, Integers
from rislam_rt.errors import ConfigError
from rislam_rt.slam.schemes.bp_slam_static.config import BpSlamStaticConfig
from rislam_rt.slam.schemes.bp_slam_static.features import Features, known_anchors, select
from rislam_rt.slam.schemes.bp_slam_static.update import FactorGraphBelief, predict_belief, update_belief
from rislam_rt.slam.schemes.shared.ranges import Direct
from rislam_rt.slam.schemes.shared.scan import Scan


class FeatureTable(NamedTuple):
    """R rows: every detected feature of every step, anchors included."""

    step: Integers
    """(R,)."""
    anchor: Integers
    """(R,) anchor that it belongs to."""
    ident: Integers
    """(R,) number for life; the anchors themselves have 0 to A - 1."""
    position: Floats
    """(R, D) mean [m]."""
    std: Floats
    """(R,) square root of the mean variance [m]."""
    existence: Floats
    """(R,) probability."""

    def at(self, step: int) -> "FeatureTable":
        """Rows of the features of one step of the run."""
        return FeatureTable(*(column[self.step == step] for column in self))


class StaticResult(NamedTuple):
    """K steps in D dimensions."""

    position: Floats
    """(K, D) agent, mean [m]."""
    velocity: Floats
    """(K, D) [m/s]."""
    covariance: Floats
    """(K, 2D, 2D) of position and velocity."""
    features: FeatureTable
    effective: Floats
    """(K,) effective sample size of the agent over the number of particles."""


def run_static(
    anchors: ArrayLike, ranges: Sequence[Sequence[ArrayLike]], start: ArrayLike, start_std: ArrayLike,
    config: BpSlamStaticConfig | None = None, *, dt: float = 1.0, anchor_std: float = 0.001, rng: np.random.Generator,
) -> StaticResult:  # fmt: skip
    """Run static BP-SLAM: agent and features from ranges alone.

    Parameters
    ----------
    anchors
        (A, D) positions [m], D = 2 or 3.
    ranges
        `ranges[k][a]` holds the ranges [m] of anchor `a` in step `k`, any number, in any order.
    start, start_std
        (2D,) mean and standard deviation of position [m] and velocity [m/s] in step 0.
    dt
        Time between steps [s].
    anchor_std
        How well the anchors are known [m].

    Raises
    ------
    ConfigError
        A shape does not fit, or a range is not a finite number.
    """
    config = config or BpSlamStaticConfig()
    points, mean, std, scans = _checked(anchors, ranges, start, start_std, config)
    dims, count = points.shape[1], config.num_particles
    cloud = mean + std * rng.standard_normal((count, 2 * dims))
    belief = FactorGraphBelief(
        cloud,
        known_anchors(points, anchor_std, count, rng=rng),
        np.full(len(points), config.initial_features),
        len(points),
    )
    accelerate = np.full(dims, config.sigma_a)
    poses, moments, effective, tables = [], [], [], []
    for step, scan in enumerate(scans):
        if step:
            belief = predict_belief(belief, dt, accelerate, config, rng=rng)
        belief, info = update_belief(belief, scan, Direct(), config, rng=rng)
        poses.append(belief.state.mean(axis=0))
        moments.append(np.cov(belief.state, rowvar=False, bias=True))
        effective.append(info.effective)
        tables.append(_detected(belief.features, moments[-1], step, config))
    pose = np.reshape(poses, (-1, 2 * dims))
    table = FeatureTable(*(np.concatenate(columns) for columns in zip(*tables, strict=True)))
    return StaticResult(pose[:, :dims], pose[:, dims:], np.array(moments), table, np.array(effective))


def _detected(features: Features, agent: Floats, step: int, config: BpSlamStaticConfig) -> FeatureTable:
    found = select(features, features.existence > config.detection_threshold)
    mean, covariance = found.moments(agent)
    spread = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / mean.shape[1])
    return FeatureTable(np.full(len(mean), step), found.anchor, found.ident, mean, spread, found.existence)


def _checked(
    anchors: ArrayLike, ranges: Sequence[Sequence[ArrayLike]], start: ArrayLike, start_std: ArrayLike,
    config: BpSlamStaticConfig,
) -> tuple[Floats, Floats, Floats, list[tuple[Scan, ...]]]:  # fmt: skip
    """The run's arguments as arrays."""
    points = np.asarray(anchors, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not np.isfinite(points).all():
        raise ConfigError(f"anchors: shape {points.shape} received; give finite positions (A, 2) or (A, 3)")
    mean, std = np.asarray(start, dtype=np.float64), np.asarray(start_std, dtype=np.float64)
    width = 2 * points.shape[1]
    if mean.shape != (width,) or std.shape != (width,) or not (np.isfinite(mean).all() and (std >= 0.0).all()):
        raise ConfigError(
            f"start, start_std: shapes {mean.shape}, {std.shape} received; give ({width},) finite numbers"
        )
    if not len(ranges):
        raise ConfigError("ranges: no steps received; give at least one")
    scans = []
    for step, row in enumerate(ranges):
        if len(row) != len(points):
            raise ConfigError(f"ranges[{step}]: {len(row)} sets received; give one for each of {len(points)} anchors")
        lengths = [np.asarray(one, dtype=np.float64).reshape(-1) for one in row]
        if not all(np.isfinite(length).all() for length in lengths):
            raise ConfigError(f"ranges[{step}]: a value that is not finite; leave missing ranges out")
        scans.append(tuple(Scan(length, np.full(len(length), config.range_std)) for length in lengths))
    return points, mean, std, scans
