"""What could a track be? Gauss-Newton fits of a static point, an image of a known point, and a moving image."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.geometry.angles import rotation_z
from rislam_rt.slam.returns import NONE, TX, Poses, Returns, feature_jacobian, observe, reflect

POINT = Returns(np.array([[0, NONE, NONE]]), np.array([0]), np.array([0]))
"""A static point; the feature sought is row 0."""
IMAGE = Returns(np.array([[1, NONE, NONE], [1, 0, NONE]]), np.array([0]), np.array([1]))
"""Tx, point (row 1), wall (row 0, sought), Rx."""
RECIPROCAL = Returns(np.array([[1, 0, NONE], [1, NONE, NONE]]), np.array([0]), np.array([1]))
"""Tx, wall (row 0, sought), point (row 1), Rx."""
MOVING = Returns(np.array([[TX, NONE, NONE], [TX, 0, NONE]]), np.array([0]), np.array([1]))
"""Tx, wall (row 0, sought), Rx: the image of the Tx moves with the agent."""


class Fit(NamedTuple):
    """Least-squares estimates of one feature from K measurements, for any leading axes."""

    feature: Floats
    """(..., 3) [m]."""
    covariance: Floats
    """(..., 3, 3) [m^2]."""
    chi2: Floats
    """(...,) sum of squared normalised residuals; 3K - 3 on average for the right hypothesis."""


class History(NamedTuple):
    """K measurements and the poses they were taken from."""

    seen: Floats
    """(K, 3)."""
    std: Floats
    """(K, 3)."""
    poses: Poses
    """Tx and Rx (..., K, 3), heading (K,)."""


def fit_feature(
    kind: Returns, start: Floats, parent: Floats | None, anchor: Floats, history: History, steps: int
) -> Fit:
    """Gauss-Newton from `start` (..., 3); `parent` (..., 3) is the known point of an image hypothesis."""
    feature = np.array(start)
    anchors = np.stack([anchor, anchor])
    weight = 1.0 / history.std**2
    for _ in range(steps):
        known = _features(feature, parent)
        residual = history.seen - observe(kind, known, anchors, history.poses).seen[..., 0, :]
        jacobian = feature_jacobian(kind, known, anchors, history.poses)[..., 0, :, 0, :]
        normal = _normal(jacobian, weight)
        slope = np.einsum("...kia,ki,...ki->...a", jacobian, weight, residual)
        step = np.linalg.solve(normal, slope[..., None])[..., 0]
        length = np.linalg.norm(step, axis=-1, keepdims=True)
        feature = feature + step * np.minimum(1.0, 2.0 / np.maximum(length, 1e-12))
    known = _features(feature, parent)
    residual = history.seen - observe(kind, known, anchors, history.poses).seen[..., 0, :]
    jacobian = feature_jacobian(kind, known, anchors, history.poses)[..., 0, :, 0, :]
    chi2 = np.einsum("...ki,ki->...", residual**2, weight)
    return Fit(feature, np.asarray(np.linalg.inv(_normal(jacobian, weight)), dtype=np.float64), chi2)


def first_guess(kind: Returns, parent: Floats | None, anchor: Floats, history: History) -> Floats | None:
    """A start (3,) for `fit_feature` from the averages over the history, or None where the geometry forbids it."""
    seen = np.average(history.seen, axis=0, weights=1.0 / history.std[:, 0] ** 2)
    tx, rx = history.poses.tx.mean(axis=-2), history.poses.rx.mean(axis=-2)
    up = np.sqrt(max(1.0 - seen[1] ** 2 - seen[2] ** 2, 0.01))
    ray = rotation_z(np.asarray(np.mean(history.poses.heading))) @ np.array([seen[1], seen[2], up])
    ray /= np.linalg.norm(ray)
    if kind is POINT:
        base = tx - rx
        return rx + ray * (seen[0] ** 2 - base @ base) / (2.0 * (seen[0] - base @ ray))
    if kind is MOVING:
        return _wall_between(tx, rx + seen[0] * ray, anchor)
    assert parent is not None
    if kind is IMAGE:
        reach = seen[0] - float(np.linalg.norm(tx - parent))
        return _wall_between(parent, rx + reach * ray, anchor) if reach > 0.1 else None
    return None


def _wall_between(point: Floats, image: Floats, anchor: Floats) -> Floats | None:
    """The wall that mirrors `point` to `image`, as the image (3,) of the anchor; None if they nearly coincide."""
    span = image - point
    if np.linalg.norm(span) < 0.2:
        return None
    # reflect() takes a wall as an image of an anchor: here the point itself is the anchor.
    wall = reflect(anchor, image, point)
    return wall if np.linalg.norm(wall - anchor) > 0.05 else None


def _features(feature: Floats, parent: Floats | None) -> Floats:
    """(..., 1, F, 3): the axis of ones broadcasts over the K measurements."""
    rows = [feature] if parent is None else [feature, np.broadcast_to(parent, feature.shape)]
    return np.stack(rows, axis=-2)[..., None, :, :]


def _normal(jacobian: Floats, weight: Floats) -> Floats:
    """(..., 3, 3) information, with a ridge of (100 m)^-2 that keeps blind directions finite."""
    return np.einsum("...kia,ki,...kib->...ab", jacobian, weight, jacobian) + 1e-4 * np.eye(3)
