"""Marginal covariances of the window: of all poses along an axis, and of predicted measurements."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.window.smoother.motion_basis import HEAD, POSE, TURN
from rislam_rt.slam.window.smoother.window_gaussian import Window, mapped, pose_design


def prediction_variance(window: Window, slot: Integers, slopes: Floats) -> Floats:
    """Marginal variance (N, 3) of predictions for poses in slots (N,), by slopes (N, 3, 4 + 3F) with respect to pose
    and features."""
    size, first = len(window.head), int(slot.min(initial=window.num_poses - 1))
    design, covariance, slot = pose_design(window)[first:], window.covariance, slot - first
    along = np.zeros((len(design), POSE, design.shape[2]))
    along[:, TURN, 6] = 1.0
    along[:, : design.shape[1]] = design
    wide = mapped(along.reshape(-1, along.shape[2]), covariance).reshape(len(along), POSE, -1)
    pose = wide[..., :HEAD] @ np.swapaxes(along[..., :HEAD], 1, 2)
    pose += wide[..., size:] @ np.swapaxes(along[..., HEAD:], 1, 2)
    # the variance by the pose, and twice the covariance with what is by the features
    joint = np.concatenate([pose, 2.0 * wide[..., HEAD:size]], axis=2)
    found = np.vecdot(slopes[..., :POSE] @ joint[slot], slopes)
    flat = slopes[..., POSE:].reshape(3 * len(slopes), size - HEAD)
    return np.asarray(found + np.vecdot(flat @ covariance[HEAD:size, HEAD:size], flat).reshape(found.shape))


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


def acceleration_covariance(window: Window, steps: int) -> Floats:
    """Covariance (3, 3) [m^2/s^4] of the mean acceleration over the window's last `steps` but one."""
    free, size = window.accel.shape[1], len(window.covariance)
    rows = slice(size - (steps + 1) * free, size - free)
    return np.asarray(window.covariance[rows, rows].reshape(steps, free, steps, free).mean(axis=(0, 2))[:3, :3])
