"""Relinearisation of the window's measurements: quadratic costs on poses and features at the present estimate."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import linearise_each, poses_of
from rislam_rt.slam.window.horizon_bias import correct_horizon_bias
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN, forms_apart
from rislam_rt.slam.window.measurement_log import Residuals
from rislam_rt.slam.window.smoother.motion_basis import POSE
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic, Window, poses
from rislam_rt.slam.window.state import WindowState


def relinearise(state: WindowState, first: int) -> tuple[Window, Residuals]:
    """Re-linearise the measurements of the poses from `first` on at the window's estimate, whose last pose is that of
    the cycle; returns the window and its residuals."""
    window, log = state.window, state.log
    slot = log.cycle - (state.cycle - window.num_poses + 1)
    rows, place = (log.explained & (slot >= first)).nonzero()[0], poses(window)
    found, slopes = residuals(state, rows, slot[rows], place)
    size, many, of = slopes.shape[2], window.num_poses - first, found.slot - first
    # the components of each slot side by side
    at = np.arange(len(rows)) - np.searchsorted(of, of)
    wide = np.zeros((many, int(at.max(initial=-1)) + 1, 3, size + 1))
    weight = np.sqrt(trust(found.left))[:, None]
    wide[of, at, :, :size], wide[of, at, :, size] = weight[..., None] * slopes, weight * found.left
    flat = wide.reshape(many, -1, size + 1)
    product = np.swapaxes(flat[..., :size], 1, 2) @ flat
    hessian, gradient, middle = (field.copy() for field in window.slots)
    hessian[first:], gradient[first:] = product[..., :size], -product[..., size]
    middle[first:, :POSE], middle[first:, POSE:] = place[first:], window.features.ravel()
    return window._replace(slots=Quadratic(hessian, gradient, middle)), found


def residuals(state: WindowState, rows: Integers, slot: Integers, place: Floats) -> tuple[Residuals, Floats]:
    """Residuals (A, 3) of explained rows of the log, heard at slots (A,) of the poses (K, 4), and the predictions'
    jacobians (A, 3, 4 + 3F) by pose and features, both in standard deviations."""
    window, log, scene, form = state.window, state.log, state.scene, state.log.form[rows]
    both = (form[:, 1, 0] != UNKNOWN).nonzero()[0]
    at = np.concatenate([slot, slot[both]])
    place = place[at]
    ends = poses_of(place[:, :3], state.heading[at] + place[:, 3], scene.body)
    returns = forms_apart(state.landmarks.rows(np.concatenate([form[:, 0], form[both, 1]])))
    linear = linearise_each(returns, window.features, state.landmarks.anchor, ends, POSE)
    linear.wide[..., :3] = linear.by_pose
    if window.turns:
        linear.wide[..., 3] = linear.by_heading(ends, place[:, :3])
    count, share = len(rows), log.share[rows[both], None]
    (seen, other), (slopes, by_other) = ((each[:count], each[count:]) for each in (linear.seen, linear.wide))
    gap = other - seen[both]
    gap[:, 0] = scene.sensor.nearest(gap[:, 0])
    seen[both] += share * gap
    slopes[both] += share[..., None] * (by_other - slopes[both])
    std = np.sqrt(log.std[rows] ** 2 + log.extra[rows])
    left = log.seen[rows] - seen
    left[:, 0] = scene.sensor.nearest(left[:, 0])
    correct_horizon_bias(seen, log.std[rows], left, slopes)
    slopes /= std[..., None]
    return Residuals(rows, slot, left / std), slopes


def trust(left: Floats) -> Floats:
    """Weights (A,) of residuals (A, 3) under Student's t, for iteratively reweighted least squares."""
    return np.asarray((CONSTANTS.tail + 3.0) / (CONSTANTS.tail + np.vecdot(left, left)))
