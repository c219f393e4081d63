"""Report of the rival filters: the outcome of a cycle, the pose and its samples, and features as points of a map."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import SlamEstimate
from rislam_rt.slam.schemes.shared.gaussian_sums import POINT, Sums, unit_of
from rislam_rt.slam.step_info import StepOutcome

STEP = 1e-6
"""Step of central differences [m, 1, rad]."""
NIS_LIMIT = 3.0
"""Running mean of the NIS per degree of freedom above which a rival filter says that it has diverged."""


def outcome_of(num_measurements: int, num_features: int, strain: float) -> StepOutcome:
    """Reported outcome of a rival filter's cycle; `strain` is the running mean of the NIS per degree of freedom."""
    if num_measurements == 0:
        return StepOutcome.NO_MEASUREMENTS
    if num_features == 0:
        return StepOutcome.NO_LANDMARKS
    return StepOutcome.DIVERGED if strain > NIS_LIMIT else StepOutcome.OK


class Points(NamedTuple):
    """V features that a rival filter reports as points of its map."""

    ident: Integers
    """Number (V,) of each feature, for life."""
    mean: Floats
    """Mean positions (V, 3) [m]."""
    covariance: Floats
    """Covariances (V, 3, 3) [m^2] of the positions."""


def lift(known: Floats, height: Floats) -> Floats:
    """Reported position and velocity (2, 3) from filtered coordinates (4,) or (6,), with `height` (2,) if lacking."""
    known = known.reshape(2, -1)
    return known if known.shape[1] == 3 else np.concatenate([known, height[:, None]], axis=1)


def position_errors(covariance: Floats, count: int) -> Floats:
    """Reported samples (count, 3) [m] of the position's error, from the covariance (6, 6) of position and velocity.

    The same draws in every cycle: the samples move smoothly, and nothing depends on who drew before.
    """
    draws = np.random.default_rng(0).standard_normal((count, 3))
    value, vector = np.linalg.eigh(covariance[:3, :3])
    return np.asarray(draws @ (vector * np.sqrt(np.maximum(value, 0.0))).T)


def ahead_of(now: SlamEstimate, dt: float) -> SlamEstimate:
    """SLAM estimate predicted `dt` [s] ahead at constant velocity without noise, as reported to the phase design."""
    move, way = np.eye(6), dt * now.velocity
    move[:3, 3:] = dt * np.eye(3)
    covariance = move @ now.covariance @ move.T
    return replace(now, position=now.position + way, covariance=covariance, samples=now.samples + way)


def known_points(sums: Sums, threshold: float) -> Points:
    """Features of Gaussian sums to report as points of the map: those that exist and are rather points than others."""
    count, point = len(sums.ident), sums.kind == POINT
    held = np.bincount(sums.owner[point], sums.share[point], minlength=count)
    shown = np.flatnonzero((sums.existence > threshold) & (held > 0.5))
    part = np.flatnonzero(point & np.isin(sums.owner, shown))
    owner = sums.owner[part]
    row, share = np.searchsorted(shown, owner), sums.share[part] / held[owner]
    moved = sums.mean[part] + STEP * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])[:, None]
    place = sums.base[owner] + moved[..., :1] * unit_of(moved, sums.walk[owner], sums.speed[owner])
    jacobian = np.moveaxis(place[1:4] - place[4:], 0, 2) / (2.0 * STEP)
    mean, covariance = np.zeros((len(shown), 3)), np.zeros((len(shown), 3, 3))
    np.add.at(mean, row, share[:, None] * place[0])
    apart = place[0] - mean[row]
    own = jacobian @ sums.covariance[part] @ jacobian.swapaxes(1, 2) + apart[:, :, None] * apart[:, None]
    np.add.at(covariance, row, share[:, None, None] * own)
    return Points(sums.ident[shown], mean, covariance)
