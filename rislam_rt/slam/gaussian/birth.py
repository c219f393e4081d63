"""A track becomes a feature: its whole history enters at once, with the poses it was measured from."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import Body
from rislam_rt.slam.birth import Birth
from rislam_rt.slam.gaussian.particles import SLOT, Particles, slot_columns
from rislam_rt.slam.gaussian.update import FLOOR, TAIL, correct
from rislam_rt.slam.hypotheses import POINT
from rislam_rt.slam.moments import normalised, poses_of
from rislam_rt.slam.returns import Returns, linearise

ITERATIONS = 3
"""Gauss-Newton steps of the joint fit of feature, trail, and all that hangs on them."""


def settle(particles: Particles, birth: Birth, body: Body, *, rng: np.random.Generator) -> Particles:
    """Particles with one more feature, by an iterated extended Kalman filter over K past measurements."""
    kind, parent = birth.verdict.kind, birth.verdict.parent
    anchors = np.stack([birth.anchor, birth.anchor])
    count, size = particles.mean.shape
    mean = np.concatenate([particles.mean, np.tile(birth.verdict.fit.feature, (count, 1))], axis=1)
    covariance = np.zeros((count, size + 3, size + 3))
    covariance[:, :size, :size] = particles.covariance
    covariance[:, size:, size:] = birth.prior
    own = np.full(3, np.nan) if kind is POINT else birth.anchor
    wide = particles._replace(mean=mean, covariance=covariance, anchor=np.vstack([particles.anchor, own]))
    columns = np.concatenate([slot_columns(birth.slots), size + np.arange(3)])
    if parent >= 0:
        columns = np.concatenate([columns, particles.first_feature + 3 * parent + np.arange(3)])
    at, noise = mean[:, columns], (birth.std**2 + FLOOR**2).ravel()
    cross_all, start = covariance[:, :, columns], at
    for _ in range(ITERATIONS + 1):
        predicted, jacobian = _predict_history(kind, at, anchors, body, len(birth.slots))
        cross = cross_all @ np.swapaxes(jacobian, 1, 2)
        inner = jacobian @ cross[:, columns]
        innovation = birth.seen.ravel() - predicted - (jacobian @ (start - at)[..., None])[..., 0]
        trust = _trust(innovation, inner + np.diag(noise))
        moved, log_likelihood = correct(wide, cross, inner + np.diag(noise * trust), innovation)
        at = moved.mean[:, columns]
    log_weight, _ = normalised(particles.log_weight + log_likelihood)
    return moved._replace(log_weight=log_weight)


def _predict_history(kind: Returns, at: Floats, anchors: Floats, body: Body, cycles: int) -> tuple[Floats, Floats]:
    """What was to be seen (N, 3K), and its derivative (N, 3K, C) by trail, feature and parent."""
    count = len(at)
    past = at[:, : SLOT * cycles].reshape(count, cycles, SLOT)
    known = at[:, SLOT * cycles :].reshape(count, 1, -1, 3)
    position = past[..., :3]
    poses = poses_of(position, past[..., 3], body)
    linear = linearise(kind, known, anchors[: known.shape[2]], poses)
    jacobian = np.zeros((count, cycles, 3, at.shape[1]))
    by_pose = np.concatenate([linear.by_pose, linear.by_heading(poses, position)[..., None]], axis=-1).mean(axis=-3)
    for cycle in range(cycles):
        jacobian[:, cycle, :, SLOT * cycle : SLOT * (cycle + 1)] = by_pose[:, cycle]
    jacobian[..., SLOT * cycles :] = linear.by_feature.mean(axis=-4).reshape(count, cycles, 3, -1)
    return linear.seen.mean(axis=-2).reshape(count, -1), jacobian.reshape(count, 3 * cycles, -1)


def _trust(innovation: Floats, spread: Floats) -> Floats:
    """(3K,) factors on the variances by which outliers count for less (Student's t)."""
    gap = innovation[0].reshape(-1, 3)
    rows = np.arange(len(gap))
    blocks = spread[0].reshape(len(gap), 3, len(gap), 3)[rows, :, rows, :]
    square = np.einsum("ki,ki->k", gap, np.linalg.solve(blocks, gap[..., None])[..., 0])
    return np.repeat(np.maximum(1.0, (TAIL + square) / (TAIL + 3.0)), 3)
