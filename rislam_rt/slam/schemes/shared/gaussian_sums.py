"""Potential features as Gaussian sums given the agent's trajectory: their ranges, birth, motion and pruning.

A Gaussian holds three numbers about the place where the agent was at the feature's birth: distance, angle off the
direction that it walked in, and turn about that direction. On a straight walk ranges tell the first two and never the
third; in these coordinates the belief stays Gaussian while it shrinks along two axes only.
"""

from typing import Any, NamedTuple, TypeVar

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers, join_rows
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory, Step
from rislam_rt.slam.schemes.shared.ranges import Bistatic, length_of

POINT, PLANE, DRIFT = 0, 1, 2
"""Kinds of a feature's Gaussian: a static point, a wall (the image of the Tx moves), or a wandering point, as a path
over a wall and a scatterer seems to be."""
NUDGE = 1e-5
"""Step of central differences [m, m/s]."""
LEAST_SPEED = 1e-3
"""An agent that stands counts as one this fast [m/s]."""
LEAST_ACROSS = 1e-4
"""Smallest squared sine of a feature's angle, for cosines that a Gaussian has beyond one."""
UPRIGHT, UPRIGHT_STD = (0.0, 0.5 * np.pi, np.pi), 0.02
"""Turns [rad] of upright walls and the ceiling about a level direction of motion, and their deviation [rad]."""
STRONG_KINDS = np.array([0.2, 0.5, 0.3])
"""Probabilities of point, wall and wanderer for a path as strong as a wall return; a corner of two walls returns like a
point."""


def kinds_of(strong: Booleans, wanderers: float) -> Floats:
    """Prior probabilities (M, 3) of point, wall and wanderer for a new feature's Gaussian sum, by whether paths are
    strong (M,)."""
    return np.where(strong[:, None], STRONG_KINDS, np.array([1.0 - wanderers, 0.0, wanderers]))


class Sums(NamedTuple):
    """Gaussian sums of K potential features, C Gaussians in all, a feature's side by side; n numbers of trajectory."""

    base: Floats
    """Mean position (K, 3) [m] of the agent at the feature's birth."""
    base_slope: Floats
    """Derivative (K, 3, n) of that position by the trajectory."""
    walk: Floats
    """Mean velocity (K, 3) [m/s] of the agent at the feature's birth."""
    walk_slope: Floats
    """Derivative (K, 3, n) of that velocity by the trajectory."""
    speed: Floats
    """Horizontal speed (K,) [m/s] assumed at birth; a unit of the second number, and never changed."""
    existence: Floats
    """Existence probability (K,)."""
    ident: Integers
    """Number (K,) of the feature, for life."""
    owner: Integers
    """Row (C,) of each Gaussian's feature, ascending."""
    kind: Integers
    """Kind (C,) of each Gaussian: POINT, PLANE or DRIFT."""
    mean: Floats
    """Mean (C, 3) of distance [m], angle and turn [rad], with the trajectory at its mean."""
    slope: Floats
    """Derivative (C, 3, n) of the mean by the trajectory."""
    covariance: Floats
    """Covariance (C, 3, 3) given the trajectory."""
    share: Floats
    """Share (C,) of each Gaussian; those of one feature sum to one."""


OF_FEATURES = ("base", "base_slope", "walk", "walk_slope", "speed", "existence", "ident")
"""Fields of Gaussian sums that have one row per feature; all others have one per Gaussian."""
Features = TypeVar("Features", bound=Any)
"""Features as named tuples with the fields `existence`, `ident`, `owner` and `share`, as `Sums`."""


class PredictedRanges(NamedTuple):
    """Ranges that C Gaussians of features predict, to first order in all and to second in the angles."""

    length: Floats
    """Ranges (C,) [m], curvature included."""
    by_mean: Floats
    """Derivatives (C, 3) of the ranges by the Gaussian's mean."""
    by_course: Floats
    """Derivatives (C, n) of the ranges by the trajectory, through the agent and through the feature."""
    own: Floats
    """Variances (C,) [m^2] of the ranges given the trajectory."""


def no_sums(size: int) -> Sums:
    """Empty set of features' Gaussian sums, for a trajectory of `size` numbers."""
    none, whole = np.zeros(0), np.zeros(0, dtype=np.int64)
    rows, slopes = np.zeros((0, 3)), np.zeros((0, 3, size))
    return Sums(
        rows, slopes, rows, slopes, none, none, whole, whole, whole, rows, slopes, np.zeros((0, 3, 3)), none
    )  # fmt: skip


def carry(sums: Sums, step: Step, wander: Floats) -> Sums:
    """Features' Gaussian sums given the trajectory after a time step; kind DRIFT widens by deviations `wander` (3,)."""
    width = len(step.residual)
    covariance = sums.covariance.copy()
    missed = sums.slope[:, :, :width]
    covariance += missed @ step.residual @ missed.swapaxes(1, 2)
    lost = sums.base_slope[:, :, :width]
    covariance[:, 0, 0] += np.einsum("kia,ab,kib->k", lost, step.residual, lost)[sums.owner]
    covariance[sums.kind == DRIFT] += np.diag(wander**2)
    return sums._replace(
        slope=sums.slope @ step.transfer, base_slope=sums.base_slope @ step.transfer,
        walk_slope=sums.walk_slope @ step.transfer, covariance=covariance,
    )  # fmt: skip


def axes_of(walk: Floats) -> tuple[Floats, Floats]:
    """Axes (..., 2, 3) of features' Gaussian sums, along velocities (..., 3) and level across them, and horizontal
    speeds (...,) [m/s]."""
    speed = np.sqrt(walk[..., 0] ** 2 + walk[..., 1] ** 2 + LEAST_SPEED**2)
    ahead = np.stack([walk[..., 0], walk[..., 1], np.zeros_like(speed)], axis=-1) / speed[..., None]
    aside = np.stack([-ahead[..., 1], ahead[..., 0], np.zeros_like(speed)], axis=-1)
    return np.stack([ahead, aside], axis=-2), speed


def unit_of(mean: Floats, walk: Floats, usual: Floats) -> Floats:
    """Directions (..., 3) of a Gaussian sum's features from the agent's place at birth; unit length where the cosine is
    an angle's."""
    axes, speed = axes_of(walk)
    cosine = mean[..., 1] * usual / speed
    across = np.sqrt(np.maximum(1.0 - cosine**2, LEAST_ACROSS))
    level = axes[..., 0, :] * cosine[..., None] + axes[..., 1, :] * (across * np.cos(mean[..., 2]))[..., None]
    level[..., 2] += across * np.sin(mean[..., 2])
    return np.asarray(level)


def lengths(kind: Integers, mean: Floats, walk: Floats, usual: Floats, moved: Floats, model: Bistatic) -> Floats:
    """Ranges (..., C) [m] of the Gaussians in features' Gaussian sums, the agent `moved` (..., C, 3) [m] from where its
    velocity was `walk`.

    The law of cosines takes cosines beyond one without a bend, which a Gaussian has on its rim.
    """
    unit, distance = unit_of(mean, walk, usual), mean[..., 0]
    static = _leg(distance, unit, moved + model.tx) + _leg(distance, unit, moved + model.rx)
    depth = 2.0 * (distance - np.sum(unit * (moved + model.tx), axis=-1))
    image = length_of(model.tx - model.rx + depth[..., None] * unit)
    return np.where(kind == PLANE, image, static)


def _leg(distance: Floats, unit: Floats, end: Floats) -> Floats:
    """Lengths (..., C) [m] from a feature of a Gaussian sum to an end of the agent, by the law of cosines."""
    square = distance**2 - 2.0 * distance * np.sum(unit * end, axis=-1) + np.sum(end**2, axis=-1)
    return np.asarray(np.sqrt(np.maximum(square, 1e-4)))


def predict_ranges(sums: Sums, course: AgentTrajectory, place: Floats, model: Bistatic) -> PredictedRanges:
    """Ranges that all features' Gaussian sums predict from the present position `place` (3,) [m], by differences."""
    owner, kind, mean = sums.owner, sums.kind, sums.mean
    spread = np.sum((sums.slope @ course.covariance) * sums.slope, axis=2)
    std = np.sqrt(np.maximum(np.einsum("cii->ci", sums.covariance) + spread, 1e-14))
    walk, usual, moved = sums.walk[owner], sums.speed[owner], place - sums.base[owner]
    nudge = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    seen = lengths(kind, mean + nudge[:, None] * std, walk, usual, moved, model)
    shift = NUDGE * np.concatenate([np.eye(3), -np.eye(3)])[:, None]
    aside = lengths(kind, mean, walk, usual, moved + shift, model)
    faster = lengths(kind, mean, walk + shift, usual, moved, model)
    by_place, by_walk = ((side[:3] - side[3:]).T / (2.0 * NUDGE) for side in (aside, faster))
    by_mean = ((seen[1:4] - seen[4:]) / (2.0 * std.T)).T
    bend = (seen[1:4] + seen[4:] - 2.0 * seen[0]).T
    here = -sums.base_slope[owner]
    here[:, range(course.axes), range(course.axes)] += 1.0
    by_course = np.einsum("ci,cin->cn", by_place, here) + np.einsum("ci,cin->cn", by_mean, sums.slope)
    by_course += np.einsum("ci,cin->cn", by_walk, sums.walk_slope[owner])
    blind = course.turn()
    by_course -= np.outer(by_course @ blind, blind)
    own = np.einsum("ci,cij,cj->c", by_mean, sums.covariance, by_mean) + 0.5 * np.sum(bend**2, axis=1)
    return PredictedRanges(seen[0] + 0.5 * bend.sum(axis=1), by_mean, by_course, own)


def spread_of(sight: PredictedRanges, course: AgentTrajectory) -> Floats:
    """Variance (C,) of ranges predicted from Gaussian sums [m^2]."""
    return np.asarray(sight.own + np.sum((sight.by_course @ course.covariance) * sight.by_course, axis=1))


def born(
    length: Floats, std: Floats, kinds: Floats, existence: Floats, course: AgentTrajectory, place: Floats, turns: int,
    first: int,
) -> Sums:  # fmt: skip
    """New features' Gaussian sums over the upper half space, one feature a range; `kinds` (M, 3) are probabilities."""
    count, size = len(length), len(course.mean)
    speed = np.zeros(3)
    speed[: course.axes] = course.mean[course.axes : 2 * course.axes]
    turn = (np.arange(turns) + 0.5) * np.pi / turns
    direction = np.concatenate([turn, np.array(UPRIGHT), [0.5 * np.pi]])
    kind = np.repeat([POINT, PLANE, DRIFT], [turns, len(UPRIGHT), 1])
    spread = np.repeat([0.5 * np.pi / turns if turns > 1 else 0.9, UPRIGHT_STD, 0.5], [turns, len(UPRIGHT), 1])
    prior = 1.0 / np.bincount(kind)[kind]
    mean = np.zeros((count, len(kind), 3))
    mean[..., 0], mean[..., 2] = 0.5 * length[:, None], direction
    covariance = np.zeros((count, len(kind), 3, 3))
    covariance[..., 0, 0] = (0.5 * std[:, None]) ** 2
    covariance[..., 1, 1], covariance[..., 2, 2] = 1.0 / 3.0, spread**2
    share = kinds[:, kind] * prior
    used = (share > 0.0).ravel()
    base_slope = np.zeros((count, 3, size))
    base_slope[:, range(course.axes), range(course.axes)] = 1.0
    walk_slope = np.zeros((count, 3, size))
    walk_slope[:, range(course.axes), range(course.axes, 2 * course.axes)] = 1.0
    total = int(used.sum())
    return Sums(
        np.tile(place, (count, 1)), base_slope, np.tile(speed, (count, 1)), walk_slope,
        np.full(count, axes_of(speed)[1]), existence, first + np.arange(count),
        np.repeat(np.arange(count), len(kind))[used], np.tile(kind, count)[used], mean.reshape(-1, 3)[used],
        np.zeros((total, 3, size)), covariance.reshape(-1, 3, 3)[used], share.ravel()[used],
    )  # fmt: skip


def join(one: Features, other: Features) -> Features:
    """Two sets of features' Gaussian sums, concatenated."""
    return join_rows([one, other._replace(owner=other.owner + len(one.ident))])


def prune(features: Features, least_existence: float, least_share: float, most: int) -> Features:
    """Features' Gaussian sums without improbable features and Gaussians of small share; each feature keeps its best."""
    rank = np.argsort(np.argsort(-features.existence, kind="stable"), kind="stable")
    keep = (features.existence >= least_existence) & (rank < most)
    best = np.zeros(len(keep))
    np.maximum.at(best, features.owner, features.share)
    rows = keep[features.owner] & ((features.share >= least_share) | (features.share >= best[features.owner]))
    owner = (np.cumsum(keep) - 1)[features.owner[rows]]
    total = np.bincount(owner, features.share[rows], minlength=int(keep.sum()))
    kept = {name: value[keep if name in OF_FEATURES else rows] for name, value in features._asdict().items()}
    return features._replace(**kept | {"owner": owner, "share": kept["share"] / total[owner]})


def range_moments(sums: Sums, sight: PredictedRanges, course: AgentTrajectory) -> tuple[Floats, Floats]:
    """Mean [m] and variance [m^2] (F,) of each feature's predicted range, over its whole Gaussian sum."""
    count = len(sums.ident)
    mean = np.bincount(sums.owner, sums.share * sight.length, minlength=count).astype(float)
    apart = spread_of(sight, course) + (sight.length - mean[sums.owner]) ** 2
    return mean, np.bincount(sums.owner, sums.share * apart, minlength=count).astype(float)
