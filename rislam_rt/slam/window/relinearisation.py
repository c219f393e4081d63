"""Relinearisation: the quadratics of the window's measurements on poses and features, at the present estimate."""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.returns import linearise_each, poses_of
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN, compile_forms
from rislam_rt.slam.window.measurement_log import Residuals
from rislam_rt.slam.window.smoother.steps import POSE
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic, Window, poses
from rislam_rt.slam.window.state import WindowState


def renew(state: WindowState, slots: Integers) -> tuple[Window, Residuals]:
    """The window with the quadratics of some slots as they are at its estimate; the last pose is that of the cycle."""
    window, log = state.window, state.log
    slot = log.cycle - (state.cycle - window.num_poses + 1)
    rows = (log.explained & np.isin(slot, slots)).nonzero()[0]
    found, slopes = residuals(state, rows, slot[rows])
    size, many = slopes.shape[2], len(slots)
    # the components of each slot side by side
    of, first = np.searchsorted(slots, found.slot), np.searchsorted(found.slot, slots)
    at = np.arange(len(rows)) - first[of]
    most = int(at.max(initial=-1)) + 1
    wide, heavy, left = (np.zeros((many, most, 3, width)) for width in (size, 1, 1))
    wide[of, at], heavy[of, at], left[of, at, :, 0] = slopes, trust(found.left)[:, None, None], found.left
    flat, thick = (each.reshape(many, 3 * most, size) for each in (wide, heavy * wide))
    hessian, gradient, middle = (field.copy() for field in window.slots)
    hessian[slots] = np.swapaxes(thick, 1, 2) @ flat
    gradient[slots] = -(np.swapaxes(thick, 1, 2) @ left.reshape(many, 3 * most, 1))[..., 0]
    middle[slots, :POSE], middle[slots, POSE:] = poses(window)[slots], window.features.ravel()
    return window._replace(slots=Quadratic(hessian, gradient, middle)), found


def residuals(state: WindowState, rows: Integers, slot: Integers) -> tuple[Residuals, Floats]:
    """Of some explained rows of the log, heard at those poses, with the slopes (A, 3, 4 + 3F) of the predictions by
    pose and features, likewise in standard deviations."""
    window, log, scene, form = state.window, state.log, state.scene, state.log.form[rows]
    both = (form[:, 1, 0] != UNKNOWN).nonzero()[0]
    at = np.concatenate([slot, slot[both]])
    place = poses(window)[at]
    ends = poses_of(place[:, :3], state.heading[at] + place[:, 3], scene.body)
    returns = compile_forms(state.landmarks.rows(np.concatenate([form[:, 0], form[both, 1]])), at)
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
    slopes /= std[..., None]
    return Residuals(rows, slot, left / std), slopes


def trust(left: Floats) -> Floats:
    """(A,) weight that Student's t gives residuals (A, 3)."""
    return np.asarray((CONSTANTS.tail + 3.0) / (CONSTANTS.tail + np.vecdot(left, left)))
