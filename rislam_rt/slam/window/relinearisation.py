"""Relinearisation of the window's measurements: quadratic costs on poses and features at the present estimate."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.predicted_returns import Poses, linearise_each, observe_each, poses_of
from rislam_rt.slam.window.landmarks.horizon_bias import correct_horizon_bias
from rislam_rt.slam.window.landmarks.path_forms import UNKNOWN, forms_apart
from rislam_rt.slam.window.measurement_log import Residuals
from rislam_rt.slam.window.smoother import attitude
from rislam_rt.slam.window.smoother.motion_basis import POSE
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic, floor_poses, poses
from rislam_rt.slam.window.solver_limits import TOLD
from rislam_rt.slam.window.state import WindowState


class Predictions(NamedTuple):
    """Predictions of A explained components of the log at the window's estimate."""

    row: Integers
    """(A,) row of each in the log."""
    slot: Integers
    """(A,) index of its pose in the window."""
    seen: Floats
    """(A, 3) length and cosines."""
    bias: Floats
    """(A, 3) by how much less is reported on average (see `horizon_bias`)."""
    slopes: Floats
    """(A, 3, D) derivatives by pose and features of what is reported, D = 4 + 3F."""


class Whitened(NamedTuple):
    """Residuals of A components of the log, in standard deviations as all else here."""

    row: Integers
    """(A,) row of each in the log."""
    slot: Integers
    """(A,) index of its pose in the window."""
    left: Floats
    """(A, 3) measured less predicted."""
    slopes: Floats
    """(A, 3, 4 + 3F) derivatives of the predictions by pose and features."""
    turned: Floats
    """(A, 3, Z) those by each cycle's nuisances: attitude and heave."""


def relinearise(
    state: WindowState, first: int, found: Predictions | None = None
) -> tuple[WindowState, Residuals]:  # fmt: skip
    """Re-linearise the measurements of the poses from `first` on at the window's estimate, whose last pose is that of
    the cycle, and level them by the attitudes that they tell; returns the state and its residuals. `found` are their
    `predictions`, where they are known."""
    found = found or predictions(state, first)
    window, variance, heard = state.window, state.nuisance_variance, whitened(state, found)
    product = _products(state, first, heard, heard.slopes, heard.turned, heard.left[..., None])
    one = attitude.marginalise(product, state.nuisance[first:], variance[first:])
    hessian, gradient, middle = (field.copy() for field in window.slots)
    hessian[first:], gradient[first:] = one.hessian, -one.slope
    middle[first:, :POSE], middle[first:, POSE:] = floor_poses(window)[first:], window.features.ravel()
    state = state._replace(window=window._replace(slots=Quadratic(hessian, gradient, middle)))
    return _levelled(state, first, heard)


def levelled(state: WindowState, first: int, found: Predictions) -> tuple[WindowState, Residuals]:
    """State and residuals as `relinearise` returns them, but for the quadratics."""
    return _levelled(state, first, whitened(state, found))


def _levelled(state: WindowState, first: int, heard: Whitened) -> tuple[WindowState, Residuals]:
    """Level measurements by the attitudes that their whitened residuals tell."""
    of, sharper = heard.slot - first, state.log.sharper(heard.row)[..., None]
    product = _products(state, first, heard, heard.turned * sharper, heard.left[..., None] * sharper)
    change = attitude.change(product, state.nuisance[first:], state.nuisance_variance[first:])
    left = heard.left - (heard.turned @ change[of][..., None])[..., 0]
    return level(state, first, change), Residuals(heard.row, heard.slot, left, heard.slopes, np.zeros(len(left)))


def heave_now(state: WindowState) -> tuple[Floats, float]:
    """What the re-linearised measurements of the last pose, after its cycle, tell of its heave: by how much (7 + 3F,)
    it is the less, the more each number of the present is (see `window_gaussian.now`), and its variance [m^2] given
    these."""
    state, last = state._replace(cycle=state.cycle - 1), state.window.num_poses - 1
    heard = whitened(state, predictions(state, last))
    product = _products(state, last, heard, heard.slopes, heard.turned, heard.left[..., None])[0]
    own = slice(-1 - heard.turned.shape[2], -1)
    spread = np.linalg.inv(product[own, own] + np.diag(1.0 / state.nuisance_variance[-1]))
    slope = spread[-1] @ product[own, : own.start]
    return np.concatenate([slope[:3], np.zeros(3), slope[3:]]), float(spread[-1, -1])


def _products(state: WindowState, first: int, heard: Whitened, *parts: Floats) -> Floats:
    """Products (K, D, D) of slopes and residuals for the re-linearisation of the poses from `first` on: of `parts`
    (A, 3, ...) side by side, by pose and features (if they count), by nuisances, and residuals.

    The start's height joins those of the run's first pose: floor, if it counts, and heave add up to what was told.
    """
    weight = np.sqrt(trust(heard.left))[:, None, None]
    weighed = [weight * part for part in parts]
    flat = _side_by_side(heard.slot - first, state.window.num_poses - first, *weighed)
    product = np.asarray(np.swapaxes(flat, 1, 2) @ flat)
    if first or state.window.num_poses <= state.cycle or not state.heaves:
        return product
    row = np.zeros(product.shape[1])
    height, std = state.start_height
    row[-2:] = 1.0, height - poses(state.window)[0, 2]
    if len(parts) > 2:
        row[2] = 1.0
    product[0] += np.outer(row, row) / (std**2 + TOLD**2)
    return product


def _side_by_side(of: Integers, count: int, *parts: Floats) -> Floats:
    """Rows (K, N, ...) of numbers (A, 3, ...) of components in slots `of` (A,), sorted, those of one slot side by side
    for a re-linearisation."""
    many = np.bincount(of, minlength=count)
    at = np.arange(len(of)) - (np.cumsum(many) - many)[of]
    ends = np.cumsum([part.shape[2] for part in parts]).tolist()
    wide = np.zeros((count, int(at.max(initial=-1)) + 1, 3, ends[-1]))
    for part, end in zip(parts, ends, strict=True):
        wide[of, at, :, end - part.shape[2] : end] = part
    return wide.reshape(count, -1, ends[-1])


def level(state: WindowState, first: int, change: Floats) -> WindowState:
    """Level the log's measurements, as they are re-linearised, of the poses from `first` on by changes (K, Z) of their
    nuisances: attitudes [rad] and heave [m]."""
    log, by, begin = state.log, np.zeros((len(change), 3)), state.cycle - state.window.num_poses + 1 + first
    axes = len(state.sway) + 1
    by[:, :axes] = change[:, :axes]
    late = slice(np.searchsorted(log.cycle, begin), None)
    seen, rotation = log.seen.copy(), state.attitude.copy()
    seen[late, 1:] = attitude.levelled(seen[late, 1:], by[log.cycle[late] - begin])
    rotation[first:] += by
    heave = state.window.heave.copy()
    heave[first:] += change[:, axes:].sum(axis=1)
    return state._replace(log=log._replace(seen=seen), attitude=rotation, window=state.window._replace(heave=heave))


def predictions(state: WindowState, first: int, *, slopes: bool = True) -> Predictions:
    """Predictions, as re-linearised, of the explained components that were heard at the poses from `first` on; without
    `slopes`, which take half of the time, there are none (D = 0), unless a heave hangs on them."""
    window, log, scene = state.window, state.log, state.scene
    slot = log.cycle - (state.cycle - window.num_poses + 1)
    rows = (log.explained & (slot >= first)).nonzero()[0]
    form, slot = log.form[rows], slot[rows]
    both = (form[:, 1, 0] != UNKNOWN).nonzero()[0]
    at = np.concatenate([slot, slot[both]])
    place = poses(window)
    ends = Poses._make(each[at] for each in poses_of(place[:, :3], state.heading + place[:, 3], scene.body))
    returns = forms_apart(state.landmarks.rows(np.concatenate([form[:, 0], form[both, 1]])))
    known = returns, window.features, state.landmarks.anchor, ends
    if slopes or state.heaves:
        linear = linearise_each(*known, POSE)
        every, by = linear.seen, linear.wide
        by[..., :3] = linear.by_pose
        if window.turns:
            by[..., 3] = linear.by_heading(ends, place[at, :3])
    else:
        every = observe_each(*known)
        by = np.zeros((*every.shape, 0))
    count, share = len(rows), log.share[rows[both], None]
    (seen, other), (own, by_other) = ((each[:count], each[count:]) for each in (every, by))
    gap = other - seen[both]
    gap[:, 0] = scene.sensor.nearest(gap[:, 0])
    seen[both] += share * gap
    own[both] += share[..., None] * (by_other - own[both])
    bias = np.zeros(seen.shape)
    correct_horizon_bias(seen, log.std[rows], bias, own)
    return Predictions(rows, slot, seen, bias, own)


def whitened(state: WindowState, found: Predictions) -> Whitened:
    """Residuals of the log's components as re-linearised, by their predictions."""
    log, rows = state.log, found.row
    std = np.sqrt(log.std[rows] ** 2 + log.extra[rows])
    left = log.seen[rows] - found.seen
    left[:, 0] = state.scene.sensor.nearest(left[:, 0])
    left[:, 1:] = log.nearest(rows, left[:, 1:], state.scene.radio.array.spacing)
    turned = attitude.jacobian(log.seen[rows, 1:], len(state.attitude_variance))
    if state.heaves:
        turned = np.concatenate([turned, found.slopes[..., 2:3]], axis=2)
    each = std[..., None]
    return Whitened(rows, found.slot, (left + found.bias) / std, found.slopes / each, turned / each)


def trust(left: Floats) -> Floats:
    """Weights (A,) under which residuals (A, 3) are re-linearised, by Student's t, for iteratively reweighted least
    squares."""
    return np.asarray((CONSTANTS.tail + 3.0) / (CONSTANTS.tail + np.vecdot(left, left)))
