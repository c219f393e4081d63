"""The Gaussian of the window: the last K poses and F features, re-linearised by Gauss-Newton.

The motion is white acceleration, constant over each step, so that the whole window's motion is a linear function of its
first pose and of the accelerations (two or three numbers a step, where poses and velocities would be twice as many and
their prior singular):

    p_k = p_0 + t_k v_0 + sum_{i < k} (T_i^2 / 2 + T_i (t_k - t_{i+1})) a_i .

Where the heading is not known either, each step has a rate of turn, likewise constant over it.

Unknowns: the head (first position, its velocity, offset of the compass; then the features, three numbers each) and
the accelerations. All of them live in vector spaces, so that no manifold is needed. What left the window stands as a
quadratic on the head (`prior`); each cycle inside it as a quadratic on its own pose and the features (`slots`), which
is made again at the present estimate whenever that is worth it. The first pose of a run is held: nothing measured
tells where the start was, whose error stands beside the Gaussian.
"""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Booleans, Floats, Integers

HEAD = 7
"""Numbers of the head before the features: position, velocity, offset of the compass."""
TURN = 3
"""Axis of the rate of turn, after those of the room."""
POSE = 4
"""Numbers of a pose that measurements depend on: position, offset of the compass."""


class Quadratic(NamedTuple):
    """`g (x - m) + (x - m)^T H (x - m) / 2`; leading axes are cycles."""

    hessian: Floats
    """(..., D, D)."""
    gradient: Floats
    """(..., D) at the middle."""
    middle: Floats
    """(..., D)."""

    def slope(self, x: Floats) -> Floats:
        """Gradient (..., D) at x (..., D)."""
        return self.gradient + (self.hessian @ (x - self.middle)[..., None])[..., 0]


class Holds(NamedTuple):
    """N beliefs about single directions of features: a wall is upright, level, at right angles to another, or not."""

    feature: Integers
    """(N,)."""
    axis: Floats
    """(N, 3) unit vectors."""
    aim: Floats
    """(N,) [m] where the feature lies along the axis, if the belief is right..."""
    std: Floats
    """(N,) [m] ...within so much."""
    log_odds: Floats
    """(N,) beforehand: of "right" against a place anywhere along the axis, times its width [m]."""
    probability: Floats
    """(N,) that it is right, at the last look: the weight with which it counts."""


def no_holds() -> Holds:
    """Nothing believed beforehand."""
    none = np.zeros(0)
    return Holds(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), none, none, none, none)


class Window(NamedTuple):
    """The belief over the last K poses and F features, relative to the run's start."""

    head: Floats
    """(7 + 3F,)."""
    accel: Floats
    """(K - 1, A) [m/s^2] over the steps between the poses, along the free axes; of `TURN`, rates [rad/s]."""
    precision: Floats
    """(K - 1, A) [s^4/m^2] of each acceleration's prior (see `motion`)."""
    step: Floats
    """(K - 1,) [s]."""
    axes: Integers
    """(A,) axes that move freely; `TURN` where the heading does."""
    prior: Quadratic
    """On the head."""
    slots: Quadratic
    """(K, 4 + 3F): on each pose and the features."""
    covariance: Floats
    """(D, D) of head and accelerations, at the last solution."""
    holds: Holds

    @property
    def num_poses(self) -> int:
        """K."""
        return len(self.step) + 1

    @property
    def features(self) -> Floats:
        """(F, 3) [m]."""
        return self.head[HEAD:].reshape(-1, 3)


def begin(position: Floats, velocity: Floats, axes: Integers, std: Floats) -> Window:
    """One pose, no features; `std` (7,) of the head's numbers, 0 for what is held."""
    head = np.concatenate([position, velocity, [0.0]])
    information = np.diag(np.maximum(std, 1e-6) ** -2.0)
    prior = Quadratic(information, np.zeros(HEAD), head)
    slots = Quadratic(np.zeros((1, POSE, POSE)), np.zeros((1, POSE)), np.concatenate([position, [0.0]])[None])
    none = np.zeros(0)
    return Window(
        head,
        none.reshape(0, len(axes)),
        none.reshape(0, len(axes)),
        none,
        axes,
        prior,
        slots,
        np.diag(np.maximum(std, 1e-6) ** 2),
        no_holds(),
    )


def begin_with(
    position: Floats, velocity: Floats, axes: Integers, std: Floats, features: Floats, covariance: Floats
) -> Window:
    """One pose, and features (3F,) known beforehand, with a covariance (3F, 3F)."""
    alone, count = begin(position, velocity, axes, std), len(features)
    spread = scipy.linalg.block_diag(alone.covariance, covariance)
    information = scipy.linalg.block_diag(alone.prior.hessian, inverse(covariance))
    head, size = np.concatenate([alone.head, features]), POSE + count
    pose = np.concatenate([alone.slots.middle[0], features])
    slots = Quadratic(np.zeros((1, size, size)), np.zeros((1, size)), pose[None])
    prior = Quadratic(information, np.zeros(len(head)), head)
    return alone._replace(head=head, prior=prior, slots=slots, covariance=spread)


def pose_design(step: Floats, axes: Integers) -> Floats:
    """(K, 4, 7 + (K - 1) A): poses as a linear function of the head's first seven numbers and the accelerations."""
    count, free = len(step) + 1, len(axes)
    time = np.concatenate([[0.0], np.cumsum(step)])
    design = np.zeros((count, POSE, HEAD + len(step) * free))
    for axis in range(3):
        design[:, axis, axis], design[:, axis, 3 + axis] = 1.0, time
    design[:, 3, 6] = 1.0
    lag = time[:, None] - time[1:]
    after = np.arange(count)[:, None] > np.arange(len(step))
    reach = np.where(after, 0.5 * step**2 + step * lag, 0.0)
    for place, axis in enumerate(axes):
        design[:, axis, HEAD + place :: free] = np.where(after, step, 0.0) if axis == TURN else reach
    return design


def poses(window: Window) -> Floats:
    """(K, 4) positions [m] and compass offsets [rad]."""
    motion = np.concatenate([window.head[:HEAD], window.accel.ravel()])
    return np.asarray(pose_design(window.step, window.axes) @ motion)


def velocity_design(window: Window) -> Floats:
    """(3, 7 + (K - 1) A): the last velocity as a linear function of the motion's numbers."""
    design = np.zeros((3, HEAD + window.accel.size))
    design[:, 3:6] = np.eye(3)
    for place, axis in enumerate(window.axes):
        if axis != TURN:
            design[axis, HEAD + place :: len(window.axes)] = window.step
    return design


def now(window: Window) -> tuple[Floats, Floats]:
    """Mean (7 + 3F,) and covariance of the last pose, its velocity, the compass offset, and the features."""
    count, size = HEAD, len(window.head)
    total = size + window.accel.size
    design = np.zeros((size, total))
    motion = np.concatenate([np.arange(count), np.arange(size, total)])
    last = pose_design(window.step, window.axes)[-1]
    design[:3, motion], design[3:6, motion], design[6, motion] = last[:3], velocity_design(window), last[3]
    design[HEAD:size, HEAD:size] = np.eye(size - HEAD)
    mean = design @ np.concatenate([window.head, window.accel.ravel()])
    return mean, design @ window.covariance @ design.T


def extend(window: Window, dt: float, precision: Floats) -> Window:
    """One more pose, a step of `dt` [s] on, with the prior precisions (A,) of the step's acceleration."""
    free, features = len(window.axes), len(window.head) - HEAD
    step = np.append(window.step, dt)
    accel = np.concatenate([window.accel, np.zeros((1, free))])
    size = POSE + features
    blank = Quadratic(np.zeros((1, size, size)), np.zeros((1, size)), np.zeros((1, size)))
    slots = Quadratic(*(np.concatenate(pair) for pair in zip(window.slots, blank, strict=True)))
    covariance = np.zeros((len(window.covariance) + free,) * 2)
    covariance[:-free, :-free] = window.covariance
    covariance[-free:, -free:] = np.diag(1.0 / precision)
    return window._replace(
        accel=accel,
        precision=np.concatenate([window.precision, precision[None]]),
        step=step,
        slots=slots,
        covariance=covariance,
    )


def slide(window: Window) -> Window:
    """Marginalise the oldest pose, at the present estimate."""
    size, free = len(window.head), len(window.axes)
    first = np.concatenate([[0, 1, 2, 6], np.arange(HEAD, size)])
    hessian, gradient = window.prior.hessian.copy(), window.prior.slope(window.head)
    oldest = Quadratic(*(field[0] for field in window.slots))
    hessian[np.ix_(first, first)] += oldest.hessian
    gradient[first] += oldest.slope(window.head[first])
    # the next pose and the acceleration in between, instead of the oldest pose
    dt, accel = window.step[0], window.accel[0]
    change = np.eye(size, size + free)
    change[:3, 3:6] = -dt * np.eye(3)
    for place, axis in enumerate(window.axes):
        if axis == TURN:
            change[6, size + place] = -dt
        else:
            change[axis, size + place], change[3 + axis, size + place] = 0.5 * dt**2, -dt
    wide, steep = change.T @ hessian @ change, change.T @ gradient
    wide[size:, size:] += np.diag(window.precision[0])
    steep[size:] += window.precision[0] * accel
    gain = np.linalg.solve(wide[size:, size:], wide[size:, :size]).T
    head = window.head.copy()
    head[:3] += dt * head[3:6]
    moves = window.axes != TURN
    head[window.axes[moves]] += 0.5 * dt**2 * accel[moves]
    head[3 + window.axes[moves]] += dt * accel[moves]
    head[6] += dt * accel[~moves].sum()
    left = wide[:size, :size] - gain @ wide[size:, :size]
    prior = Quadratic(0.5 * (left + left.T), steep[:size] - gain @ steep[size:], head)
    back = np.eye(size + window.accel.size)
    back[:3, 3:6] = dt * np.eye(3)
    for place, axis in enumerate(window.axes):
        if axis == TURN:
            back[6, size + place] = dt
        else:
            back[axis, size + place], back[3 + axis, size + place] = 0.5 * dt**2, dt
    covariance = back @ window.covariance @ back.T
    kept = np.concatenate([np.arange(size), np.arange(size + free, len(covariance))])
    return window._replace(
        head=head,
        accel=window.accel[1:],
        precision=window.precision[1:],
        step=window.step[1:],
        prior=prior,
        slots=Quadratic(*(field[1:] for field in window.slots)),
        covariance=covariance[np.ix_(kept, kept)],
    )


def solve(window: Window) -> Window:
    """One Gauss-Newton step on the present quadratics, and the covariance there."""
    size, features = len(window.head), len(window.head) - HEAD
    total = size + window.accel.size
    motion = np.concatenate([np.arange(HEAD), np.arange(size, total)])
    design = pose_design(window.step, window.axes)
    place = design @ np.concatenate([window.head[:HEAD], window.accel.ravel()])
    spot = np.concatenate([place, np.broadcast_to(window.head[HEAD:], (len(place), features))], axis=1)
    slope, slots = window.slots.slope(spot), window.slots.hessian
    tall = design.reshape(-1, len(motion))
    hessian, gradient = np.zeros((total, total)), np.zeros(total)
    hessian[np.ix_(motion, motion)] = tall.T @ (slots[:, :POSE, :POSE] @ design).reshape(tall.shape)
    cross = tall.T @ slots[:, :POSE, POSE:].reshape(POSE * len(place), features)
    hessian[motion, HEAD:size] = cross
    hessian[HEAD:size, motion] = cross.T
    hessian[HEAD:size, HEAD:size] = slots[:, POSE:, POSE:].sum(axis=0)
    gradient[motion] = tall.T @ slope[:, :POSE].ravel()
    gradient[HEAD:size] = slope[:, POSE:].sum(axis=0)
    hessian[:size, :size] += window.prior.hessian
    gradient[:size] += window.prior.slope(window.head)
    for feature, pull, information in zip(*_pulls(window), strict=True):
        own = slice(HEAD + 3 * feature, HEAD + 3 * feature + 3)
        hessian[own, own] += information
        gradient[own] += pull
    free = window.precision.ravel()
    at = np.arange(size, total)
    hessian[at, at] += free
    gradient[at] += free * window.accel.ravel()
    covariance = inverse(hessian)
    change = -covariance @ gradient
    return window._replace(
        head=window.head + change[:size],
        accel=window.accel + change[size:].reshape(window.accel.shape),
        covariance=covariance,
    )


def _pulls(window: Window) -> tuple[Integers, Floats, Floats]:
    """Features (N,), gradients (N, 3) and information (N, 3, 3) of what is held of them."""
    holds = window.holds
    weight = holds.probability / holds.std**2
    off = np.vecdot(holds.axis, window.features[holds.feature]) - holds.aim if len(weight) else weight
    return (
        holds.feature, (weight * off)[:, None] * holds.axis,
        weight[:, None, None] * holds.axis[:, :, None] * holds.axis[:, None, :],
    )  # fmt: skip


def weigh_holds(window: Window) -> Window:
    """Each belief about a direction by what all else tells of it (its cavity): is it right?"""
    holds = window.holds
    if not len(holds.feature):
        return window
    rows = HEAD + 3 * holds.feature[:, None] + np.arange(3)
    block = window.covariance[rows[:, :, None], rows[:, None, :]]
    variance = np.vecdot(holds.axis, (block @ holds.axis[..., None])[..., 0])
    middle = np.vecdot(holds.axis, window.features[holds.feature])
    own = holds.probability / holds.std**2
    left = np.maximum(1.0 / variance - own, 1e-3)
    cavity = (middle / variance - own * holds.aim) / left
    spread = 1.0 / left + holds.std**2
    log_right = -0.5 * (cavity - holds.aim) ** 2 / spread - 0.5 * np.log(2.0 * np.pi * spread)
    odds = np.clip(holds.log_odds + log_right, -30.0, 30.0)
    return window._replace(holds=holds._replace(probability=1.0 / (1.0 + np.exp(-odds))))


def inverse(matrix: Floats) -> Floats:
    """Of a symmetric positive matrix, scaled to a unit diagonal first; damped where rounding made it indefinite."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(matrix), 1e-30))
    scaled = matrix * scale * scale[:, None]
    for damping in (0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e3):
        factor, bad = scipy.linalg.lapack.dpotrf(scaled + damping * np.eye(len(scaled)), lower=1)
        if not bad:
            break
    inside, _ = scipy.linalg.lapack.dpotri(factor, lower=1)
    full = np.tril(inside) + np.tril(inside, -1).T
    return np.asarray(full * scale * scale[:, None])


def add_feature(window: Window, place: Floats, holds: Holds, ridge: float = 1e-6) -> Window:
    """One more feature at `place` (3,), with what is held of it; all else is open, `ridge` [1/m^2] apart."""
    size = len(window.head)
    hessian = np.zeros((size + 3, size + 3))
    hessian[:size, :size], hessian[size:, size:] = window.prior.hessian, ridge * np.eye(3)
    prior = Quadratic(
        hessian, np.concatenate([window.prior.gradient, np.zeros(3)]), np.concatenate([window.prior.middle, place])
    )
    count, old = window.num_poses, window.slots
    wide = np.zeros((count, POSE + size - HEAD + 3, POSE + size - HEAD + 3))
    wide[:, :-3, :-3] = old.hessian
    gradient = np.concatenate([old.gradient, np.zeros((count, 3))], axis=1)
    middle = np.concatenate([old.middle, np.broadcast_to(place, (count, 3))], axis=1)
    covariance = np.insert(np.insert(window.covariance, size * np.ones(3, int), 0.0, axis=0), [size] * 3, 0.0, axis=1)
    covariance[size : size + 3, size : size + 3] = np.eye(3)
    joined = Holds._make(np.concatenate(pair) for pair in zip(window.holds, holds, strict=True))
    return window._replace(
        holds=joined,
        head=np.concatenate([window.head, place]),
        prior=prior,
        slots=Quadratic(wide, gradient, middle),
        covariance=covariance,
    )


def drop_features(window: Window, keep: Booleans) -> Window:
    """Only the features (F,) that are kept: the others are marginalised from what left the window, and struck from the
    rest, whose slots have to be made again."""
    size = len(window.head)
    stays = np.concatenate([np.ones(HEAD, dtype=np.bool_), np.repeat(keep, 3)])
    inside, out = np.flatnonzero(stays), np.flatnonzero(~stays)
    hessian, gradient = window.prior.hessian, window.prior.slope(window.head)
    spread = inverse(hessian[np.ix_(out, out)] + 1e-9 * np.eye(len(out)))
    gain = hessian[np.ix_(inside, out)] @ spread
    left = hessian[np.ix_(inside, inside)] - gain @ hessian[np.ix_(out, inside)]
    prior = Quadratic(0.5 * (left + left.T), gradient[inside] - gain @ gradient[out], window.head[inside])
    rows = np.concatenate([np.arange(POSE), POSE + np.flatnonzero(np.repeat(keep, 3))])
    old = window.slots
    slots = Quadratic(old.hessian[:, rows[:, None], rows], old.gradient[:, rows], old.middle[:, rows])
    kept = np.concatenate([inside, np.arange(size, len(window.covariance))])
    stay = keep[window.holds.feature]
    holds = window.holds._replace(feature=(np.cumsum(keep) - 1)[window.holds.feature])
    holds = Holds._make(field[stay] for field in holds)
    return window._replace(
        holds=holds,
        head=window.head[inside],
        prior=prior,
        slots=slots,
        covariance=window.covariance[np.ix_(kept, kept)],
    )
