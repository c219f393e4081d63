"""Marginal covariances of the window: of all poses along an axis, and of predicted measurements."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.window.smoother.motion_basis import HEAD, POSE, TURN
from rislam_rt.slam.window.smoother.window_gaussian import Window, mapped, pose_design


def prediction_variance(window: Window, slot: Integers, slopes: Floats) -> Floats:
    """Marginal variance (N, 3) of predictions for poses in slots (N,), by slopes (N, 3, 4 + 3F) with respect to pose
    and features."""
    size, first = len(window.head), int(slot.min(initial=window.num_poses - 1))
    along, free = pose_design(window)[first:], window.accel.shape[1]
    design = np.zeros((window.num_poses - first, POSE, len(window.covariance)))
    design[:, TURN, 6] = 1.0
    design[:, :free, :HEAD], design[:, :free, size:] = along[..., :HEAD], along[..., HEAD:]
    wide = (design.reshape(-1, len(window.covariance)) @ window.covariance).reshape(design.shape)
    slot = slot - first
    pose, cross, inner = (
        wide @ np.swapaxes(design, 1, 2),
        wide[:, :, HEAD:size],
        window.covariance[HEAD:size, HEAD:size],
    )
    by_pose, by_map = slopes[..., :POSE], slopes[..., POSE:]
    flat = by_map.reshape(3 * len(by_map), size - HEAD)
    found = np.vecdot(by_pose @ pose[slot], by_pose) + 2.0 * np.vecdot(by_pose @ cross[slot], by_map)
    return np.asarray(found + np.vecdot(flat @ inner, flat).reshape(found.shape))


def way_variance(window: Window, one: Integers, two: Integers) -> Floats:
    """Variances (N, 3) of the ways between poses `one` (N,) and `two` (N,) of the sliding window."""
    design = pose_design(window)
    apart = (design[two, :3] - design[one, :3]).reshape(-1, design.shape[2])
    wide = mapped(apart, window.covariance)
    own = np.vecdot(wide[:, :HEAD], apart[:, :HEAD]) + np.vecdot(wide[:, len(window.head) :], apart[:, HEAD:])
    return np.asarray(np.maximum(own, 0.0).reshape(-1, 3))


def pose_covariance(window: Window, axis: int) -> Floats:
    """Covariance (K, K) of all poses of the sliding window along one axis."""
    along = pose_design(window)[:, axis]
    return mapped(along, mapped(along, window.covariance).T)
