"""Relinearisation of the window's measurements: quadratic costs on poses and features at the present estimate."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import linearise_each, poses_of
from rislam_rt.slam.window.landmarks.horizon_bias import correct_horizon_bias
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN, forms_apart
from rislam_rt.slam.window.measurement_log import Residuals
from rislam_rt.slam.window.smoother import attitude
from rislam_rt.slam.window.smoother.motion_basis import POSE
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic, poses
from rislam_rt.slam.window.state import WindowState


def relinearise(state: WindowState, first: int) -> tuple[WindowState, Residuals]:
    """Re-linearise the measurements of the poses from `first` on at the window's estimate, whose last pose is that of
    the cycle, and level them by the attitudes that they tell; returns the state and its residuals."""
    window, log = state.window, state.log
    slot = log.cycle - (state.cycle - window.num_poses + 1)
    rows, place = (log.explained & (slot >= first)).nonzero()[0], poses(window)
    found, slopes = residuals(state, rows, slot[rows], place)
    size, many, of, variance = slopes.shape[2], window.num_poses - first, found.slot - first, state.attitude_variance
    turned = attitude.jacobian(log.seen[rows, 1:], len(variance)) / found.std[..., None]
    # the components of each slot side by side
    at = np.arange(len(rows)) - np.searchsorted(of, of)
    wide = np.zeros((many, int(at.max(initial=-1)) + 1, 3, size + len(variance) + 1))
    weight = np.sqrt(trust(found.left))[:, None, None]
    wide[of, at, :, :size], wide[of, at, :, size:-1] = weight * slopes, weight * turned
    wide[of, at, :, -1] = weight[..., 0] * found.left
    flat = wide.reshape(many, -1, wide.shape[-1])
    one = attitude.marginalise(np.swapaxes(flat, 1, 2) @ flat, state.attitude[first:], variance)
    own = np.zeros((many, wide.shape[1], 3, len(variance) + 1))
    own[of, at] = wide[of, at, :, size:] * log.sharper(rows)[..., None]
    own = own.reshape(many, -1, own.shape[-1])
    change = attitude.change(np.swapaxes(own, 1, 2) @ own, state.attitude[first:], variance)
    hessian, gradient, middle = (field.copy() for field in window.slots)
    hessian[first:], gradient[first:] = one.hessian, -one.slope
    middle[first:, :POSE], middle[first:, POSE:] = place[first:], window.features.ravel()
    state = state._replace(window=window._replace(slots=Quadratic(hessian, gradient, middle)))
    left = found.left - (turned @ change[of][..., None])[..., 0]
    return level(state, first, change), Residuals(
        found.row, found.slot, left, slopes, np.zeros(len(rows))
    )  # fmt: skip


def level(state: WindowState, first: int, change: Floats) -> WindowState:
    """Level the log's measurements, as they are re-linearised, of the poses from `first` on by changes (K, A) [rad] of
    their attitudes."""
    log, by, begin = state.log, np.zeros((len(change), 3)), state.cycle - state.window.num_poses + 1 + first
    by[:, : change.shape[1]] = change
    late = slice(np.searchsorted(log.cycle, begin), None)
    seen, rotation = log.seen.copy(), state.attitude.copy()
    seen[late, 1:] = attitude.levelled(seen[late, 1:], by[log.cycle[late] - begin])
    rotation[first:] += by
    return state._replace(log=log._replace(seen=seen), attitude=rotation)


class _Whitened(NamedTuple):
    """Residuals of A components of the log in standard deviations, and these."""

    row: Integers
    slot: Integers
    left: Floats
    std: Floats


def residuals(state: WindowState, rows: Integers, slot: Integers, place: Floats) -> tuple[_Whitened, Floats]:
    """Residuals (A, 3) as re-linearised of explained rows of the log, heard at slots (A,) of the poses (K, 4), and the
    predictions' jacobians (A, 3, 4 + 3F) by pose and features, both in standard deviations."""
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
    return _Whitened(rows, slot, left / std, std), slopes


def trust(left: Floats) -> Floats:
    """Weights (A,) under which residuals (A, 3) are re-linearised, by Student's t, for iteratively reweighted least
    squares."""
    return np.asarray((CONSTANTS.tail + 3.0) / (CONSTANTS.tail + np.vecdot(left, left)))
