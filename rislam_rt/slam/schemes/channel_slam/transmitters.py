"""Virtual transmitters inside agent particles: Gaussian sums, updated by one range at a time.

Source: Gentner et al., "Multipath assisted positioning with simultaneous localization and mapping", IEEE TWC 2016 (a
virtual transmitter a path, inside every agent particle); the Gaussian sum in place of particles is that of
Ulmschneider, Gentner, Jost and Dammann, "Rao-Blackwellized Gaussian sum particle filter for multipath assisted positioning", 2018.

The covariance of a Gaussian depends on where ranges were taken, not on what they were, and hardly differs between agent
particles a few centimetres apart: one covariance serves all of them, means and shares are each particle's own.
"""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Booleans, Floats, Integers
from rislam_rt.slam.schemes.bp_slam.ranges import Bistatic, length_of

LOG_TWO_PI = float(np.log(2.0 * np.pi))
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
"""Angle from one direction to the next on a spiral that covers the sphere evenly."""


class Transmitters(NamedTuple):
    """C Gaussians of all virtual transmitters, those of one transmitter side by side, in N agent particles."""

    mean: Floats
    """(N, C, 3) [m]."""
    log_share: Floats
    """(N, C); the shares of one transmitter sum to one in every particle."""
    covariance: Floats
    """(C, 3, 3) [m^2]."""
    label: Integers
    """(C,) label of the path."""

    @property
    def starts(self) -> Integers:
        """(V,) first Gaussian of every virtual transmitter."""
        return np.flatnonzero(np.diff(self.label, prepend=self.label[:1] - 1)) if len(self.label) else self.label

    def keep(self, rows: Booleans) -> "Transmitters":
        """Some of the Gaussians."""
        return Transmitters(self.mean[:, rows], self.log_share[:, rows], self.covariance[rows], self.label[rows])


def no_transmitters(num_particles: int) -> Transmitters:
    """None yet."""
    empty = np.zeros(0, dtype=np.int64)
    return Transmitters(np.zeros((num_particles, 0, 3)), np.zeros((num_particles, 0)), np.zeros((0, 3, 3)), empty)


def join(first: Transmitters, second: Transmitters) -> Transmitters:
    """Both."""
    return Transmitters(
        np.concatenate([first.mean, second.mean], axis=1),
        np.concatenate([first.log_share, second.log_share], axis=1),
        np.concatenate([first.covariance, second.covariance]),
        np.concatenate([first.label, second.label]),
    )


def even_directions(count: int, upper_half: bool) -> Floats:
    """Unit vectors (count, 3), evenly over the sphere or its upper half, on a spiral."""
    step = (np.arange(count) + 0.5) / count
    height = step if upper_half else 1.0 - 2.0 * step
    across, angle = np.sqrt(1.0 - height**2), GOLDEN * np.arange(count)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=-1)


def born(label: int, position: Floats, length: float, std: float, model: Bistatic, count: int) -> Transmitters:
    """A virtual transmitter somewhere at range `length` [m] from agents (N, 3): `count` Gaussians on a half sphere.

    A Gaussian that lies flat on a sphere sticks out of it; each is moved inwards by what that adds to its mean range.
    """
    direction = even_directions(count, model.upper_half)
    area = (2.0 if model.upper_half else 4.0) * np.pi
    radius = 0.5 * length
    across = 0.5 * radius * np.sqrt(area / count)
    outer = direction[:, :, None] * direction[:, None]
    covariance = across**2 * (np.eye(3) - outer) + (0.5 * std) ** 2 * outer
    mean = model.invert(position[:, None], direction, np.full(count, length))
    mean = mean - across**2 / np.maximum(radius, across) * direction
    share = np.full(mean.shape[:2], -np.log(count))
    return Transmitters(mean, share, covariance, np.full(count, label))


class Update(NamedTuple):
    """After one cycle's ranges."""

    transmitters: Transmitters
    log_likelihood: Floats
    """(N,) of all ranges, given each agent particle."""
    square: Floats
    """(V,) squared normalised innovation of every virtual transmitter in the mean belief."""


def update(
    known: Transmitters, position: Floats, weight: Floats, length: Floats, std: Floats, model: Bistatic, outlier: float
) -> Update:
    """Every virtual transmitter updated by its range: a second-order Kalman update of every Gaussian.

    Parameters
    ----------
    position, weight
        Agent particles (N, 3) [m] and their weights (N,).
    length, std
        (V,) range of every virtual transmitter and its standard deviation [m], in the order of `known.starts`.
    outlier
        Probability that a range is uniform over a metre instead.
    """
    starts = known.starts
    owner = np.repeat(np.arange(len(starts)), np.diff(starts, append=len(known.label)))
    center = np.einsum("n,nci->ci", weight, known.mean)
    slope, bend = _derivatives(model, weight @ position, center)
    curved = bend @ known.covariance
    bias = 0.5 * np.trace(curved, axis1=1, axis2=2)
    spread = known.covariance @ slope[..., None]
    variance = (slope[:, None] @ spread)[:, 0, 0] + 0.5 * np.trace(curved @ curved, axis1=1, axis2=2)
    variance = variance + std[owner] ** 2
    miss = length[owner] - model.ranges(position[:, None], known.mean) - bias
    gain = spread[..., 0] / variance[:, None]
    log_joint = known.log_share - 0.5 * (miss**2 / variance + np.log(variance) + LOG_TWO_PI)
    log_path = _log_sums(log_joint, starts)
    moved = Transmitters(
        known.mean + miss[..., None] * gain,
        log_joint - log_path[:, owner],
        known.covariance - gain[:, :, None] * spread[:, None, :, 0],
        known.label,
    )
    robust = np.logaddexp(np.log1p(-outlier) + log_path, np.log(outlier)).sum(axis=1)
    return Update(moved, robust, _squares(known, weight, miss, variance, starts))


def prune(known: Transmitters, weight: Floats, least: float) -> Transmitters:
    """Without Gaussians whose share, over all agents, is below `least`; every transmitter keeps its best."""
    if not len(known.label):
        return known
    share = weight @ np.exp(known.log_share)
    starts = known.starts
    owner = np.repeat(np.arange(len(starts)), np.diff(starts, append=len(known.label)))
    kept = known.keep((share >= least) | (share >= np.maximum.reduceat(share, starts)[owner]))
    starts = kept.starts
    owner = np.repeat(np.arange(len(starts)), np.diff(starts, append=len(kept.label)))
    return kept._replace(log_share=kept.log_share - _log_sums(kept.log_share, starts)[:, owner])


def moments(known: Transmitters, weight: Floats) -> tuple[Floats, Floats]:
    """Mean (V, 3) [m] and covariance (V, 3, 3) [m^2] of every virtual transmitter over agents and Gaussians."""
    starts = known.starts
    if not len(starts):
        return np.zeros((0, 3)), np.zeros((0, 3, 3))
    share = weight[:, None] * np.exp(known.log_share)
    total = share.sum(axis=0)
    first = np.einsum("nc,nci->ci", share, known.mean)
    second = np.einsum("nc,nci,ncj->cij", share, known.mean, known.mean) + total[:, None, None] * known.covariance
    mean = np.add.reduceat(first, starts)
    return mean, np.add.reduceat(second, starts) - mean[:, :, None] * mean[:, None]


def _derivatives(model: Bistatic, agent: Floats, point: Floats) -> tuple[Floats, Floats]:
    """First (C, 3) and second (C, 3, 3) [1/m] derivatives of the range with respect to points (C, 3)."""
    slope, bend = np.zeros(point.shape), np.zeros((*point.shape, 3))
    for end in (model.tx, model.rx):
        span = point - agent - end
        reach = np.maximum(length_of(span), 1e-3)
        unit = span / reach[:, None]
        slope += unit
        bend += (np.eye(3) - unit[:, :, None] * unit[:, None]) / reach[:, None, None]
    return slope, bend


def _log_sums(values: Floats, starts: Integers) -> Floats:
    """Logarithm (N, V) of the sums of exponentials of (N, C), transmitter by transmitter."""
    if not len(starts):
        return np.zeros((len(values), 0))
    top = np.maximum.reduceat(values, starts, axis=1)
    count = np.diff(starts, append=values.shape[1])
    sums = np.add.reduceat(np.exp(values - np.repeat(top, count, axis=1)), starts, axis=1)
    return top + np.log(sums)


def _squares(known: Transmitters, weight: Floats, miss: Floats, variance: Floats, starts: Integers) -> Floats:
    """(V,) squared innovation over its variance, both of the whole mixture over agents and Gaussians."""
    if not len(starts):
        return np.zeros(0)
    share = weight[:, None] * np.exp(known.log_share)
    mean = np.add.reduceat((share * miss).sum(axis=0), starts)
    second = np.add.reduceat((share * (miss**2 + variance)).sum(axis=0), starts)
    return mean**2 / np.maximum(second - mean**2, 1e-300)
