"""Marginal covariances of the window: of all poses along an axis, and of predicted measurements."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.window.smoother.motion_basis import FIRST, HEAD, POSE, TURN, basis
from rislam_rt.slam.window.smoother.window_gaussian import Window


def prediction_variance(window: Window, slot: Integers, slopes: Floats) -> Floats:
    """Marginal variance (N, 3) of predictions for poses in slots (N,), by slopes (N, 3, 4 + 3F) with respect to pose
    and features."""
    size, free, first = len(window.head), window.accel.shape[1], int(slot.min(initial=window.num_poses - 1))
    design = np.zeros((window.num_poses - first, POSE, len(window.covariance)))
    design[:, TURN, 6] = 1.0
    for axis, along in enumerate(basis(window.step.tobytes(), window.turns)[:, first:]):
        design[:, axis, FIRST[axis]] = along[:, 0]
        if axis != TURN:
            design[:, axis, 3 + axis] = along[:, 1]
        design[:, axis, size + axis :: free] = along[:, 2:]
    wide, slot = design @ window.covariance, slot - first
    pose, cross, inner = (
        wide @ np.swapaxes(design, 1, 2),
        wide[:, :, HEAD:size],
        window.covariance[HEAD:size, HEAD:size],
    )
    by_pose, by_map = slopes[..., :POSE], slopes[..., POSE:]
    flat = by_map.reshape(3 * len(by_map), size - HEAD)
    found = np.vecdot(by_pose @ pose[slot], by_pose) + 2.0 * np.vecdot(by_pose @ cross[slot], by_map)
    return np.asarray(found + np.vecdot(flat @ inner, flat).reshape(found.shape))


def pose_covariance(window: Window, axis: int) -> Floats:
    """Covariance (K, K) of all poses of the sliding window along one axis."""
    along, size, free = basis(window.step.tobytes(), window.turns)[axis], len(window.head), window.accel.shape[1]
    rate = [] if axis == TURN else [3 + axis]
    rows = np.concatenate([[FIRST[axis]], rate, np.arange(size + axis, len(window.covariance), free)]).astype(np.int64)
    used = along if rate else np.delete(along, 1, axis=1)
    return np.asarray(used @ window.covariance[np.ix_(rows, rows)] @ used.T)
