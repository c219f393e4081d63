"""Features of the window's Gaussian: one more, or fewer."""

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.slam.window.smoother.cholesky import inverse
from rislam_rt.slam.window.smoother.direction_priors import DirectionPriors
from rislam_rt.slam.window.smoother.motion_basis import HEAD, POSE
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic, Window, eliminated_noise


def add_feature(window: Window, place: Floats, holds: DirectionPriors, ridge: float = 1e-6) -> Window:
    """Sliding window with one more feature at `place` (3,), known by its direction priors `holds` and otherwise by next
    to nothing (`ridge` [1/m^2])."""
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
    joined = DirectionPriors._make(np.concatenate(pair) for pair in zip(window.holds, holds, strict=True))
    return window._replace(
        holds=joined,
        head=np.concatenate([window.head, place]),
        prior=prior,
        noise=np.pad(window.noise, (0, 3)),
        slots=Quadratic(wide, gradient, middle),
        covariance=covariance,
    )


def drop_features(window: Window, keep: Booleans) -> Window:
    """Sliding window without the features not marked in `keep` (F,): marginalised from what left the window, deleted
    from the slots, which have to be re-linearised."""
    size = len(window.head)
    stays = np.concatenate([np.ones(HEAD, dtype=np.bool_), np.repeat(keep, 3)])
    inside, out = np.flatnonzero(stays), np.flatnonzero(~stays)
    order = np.concatenate([inside, out])
    hessian, gradient = window.prior.hessian, window.prior.slope(window.head)
    spread = inverse(hessian[np.ix_(out, out)] + 1e-9 * np.eye(len(out)))
    gain = hessian[np.ix_(inside, out)] @ spread
    left = hessian[np.ix_(inside, inside)] - gain @ hessian[np.ix_(out, inside)]
    prior = Quadratic(0.5 * (left + left.T), gradient[inside] - gain @ gradient[out], window.head[inside])
    rows = np.concatenate([np.arange(POSE), POSE + np.flatnonzero(np.repeat(keep, 3))])
    old = window.slots
    slots = Quadratic(old.hessian[:, rows[:, None], rows], old.gradient[:, rows], old.middle[:, rows])
    kept = np.concatenate([inside, np.arange(size, len(window.covariance))])
    stay, number = keep[window.holds.pair].all(axis=1), np.append(np.cumsum(keep) - 1, -1)
    feature, other = number[window.holds.feature], number[window.holds.other]
    holds = DirectionPriors._make(field[stay] for field in window.holds._replace(feature=feature, other=other))
    return window._replace(
        holds=holds,
        head=window.head[inside],
        prior=prior,
        noise=eliminated_noise(window.noise[np.ix_(order, order)], len(inside), gain),
        slots=slots,
        covariance=window.covariance[np.ix_(kept, kept)],
    )
