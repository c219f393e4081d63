"""The Gaussian of the window: the last K poses and F features, re-linearised by Gauss-Newton.

The motion is white acceleration, constant over each step, beside a turn of the velocity that is given (see
`motion_basis`), so that the whole window's motion is a linear function of its first pose and of the accelerations (two
or three numbers a step, where poses and velocities would be twice as many and their prior singular). Without turns

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

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.window.smoother.attitude import marginalise
from rislam_rt.slam.window.smoother.cholesky import inverse, solution
from rislam_rt.slam.window.smoother.direction_priors import DirectionPriors, no_holds
from rislam_rt.slam.window.smoother.motion_basis import (
    HEAD,
    POSE,
    TURN,
    last_pose_matrix,
    pose_matrix,
    step_back,
    step_transition,
)
from rislam_rt.slam.window.smoother.rate_factor import RateFactor


class Quadratic(NamedTuple):
    """Quadratic cost `g (x - m) + (x - m)^T H (x - m) / 2` on D unknowns; leading axes are cycles."""

    hessian: Floats
    """(..., D, D) `H`."""
    gradient: Floats
    """(..., D) `g`, at the middle."""
    middle: Floats
    """(..., D) `m`, where it was linearised."""

    def slope(self, x: Floats) -> Floats:
        """Gradient (..., D) at x (..., D) of a cost in the window's Gaussian."""
        return self.gradient + (self.hessian @ (x - self.middle)[..., None])[..., 0]


class Window(NamedTuple):
    """Gaussian belief of the sliding window: the last K poses and F features, relative to the run's start."""

    head: Floats
    """(7 + 3F,) first position, its velocity, compass offset, and features."""
    accel: Floats
    """(K - 1, A) [m/s^2] over the steps between the poses, along the room's axes; of `TURN`, rates [rad/s]."""
    precision: Floats
    """(K - 1, A) [s^4/m^2] of each acceleration's prior (see `motion`), in the next solution..."""
    solved: Floats
    """(K - 1, A) [s^4/m^2] ...and in that of the covariance."""
    variance: Floats
    """(K - 1, A) [m^2/s^4] variance of each acceleration over the motion modes, 0 for that of its prior."""
    uneven: Floats
    """(K - 1,) [s^4/m^2] prior precisions of the vertical accelerations, were the floor uneven (see
    `motion_learning`)."""
    step: Floats
    """(K - 1,) [s] times between the poses."""
    velocity_turn: Floats
    """(K - 1,) [rad] by how much the velocity turns over each step, beside the acceleration."""
    prior: Quadratic
    """Quadratic on the head: what is known beforehand and from poses that left the window."""
    noise: Floats
    """(7 + 3F, 7 + 3F) variance of the slope of the head's prior that its Hessian leaves out, by steps that left the
    window."""
    slots: Quadratic
    """(K, 4 + 3F) quadratics of each cycle's measurements on its pose and the features."""
    covariance: Floats
    """(D, D) of head and accelerations, at the last solution."""
    holds: DirectionPriors
    """Direction priors of the walls."""
    heave: Floats
    """(K,) [m] estimated height of each pose above the floor's, which is what the motion gives (see `heave`)."""
    heave_variance: Floats
    """(K,) [m^2] prior variance of each heave, 0 where there is none."""
    rates: RateFactor | None = None
    """What tracks that no feature explains tell of the poses, until a pose comes or leaves."""

    @property
    def num_poses(self) -> int:
        """Number K of poses in the window."""
        return len(self.step) + 1

    @property
    def features(self) -> Floats:
        """Features (F, 3) [m] of the window: places of points, and for walls the mirror images of their anchors."""
        return self.head[HEAD:].reshape(-1, 3)

    @property
    def turns(self) -> bool:
        """Whether each step of the window has a rate of turn, the heading being estimated: A is then 4, and else 3."""
        return self.accel.shape[1] > TURN


def begin(position: Floats, velocity: Floats, std: Floats, *, turns: bool = False) -> Window:
    """Belief of the sliding window with one pose and no features; `std` (7,) of the head's numbers, 0 for what is held
    fixed."""
    head = np.concatenate([position, velocity, [0.0]])
    information = np.diag(np.maximum(std, 1e-6) ** -2.0)
    prior = Quadratic(information, np.zeros(HEAD), head)
    slots = Quadratic(np.zeros((1, POSE, POSE)), np.zeros((1, POSE)), np.concatenate([position, [0.0]])[None])
    none = np.zeros((0, 3 + turns))
    return Window(
        head, none, none, none, none, np.zeros(0), np.zeros(0), np.zeros(0), prior, np.zeros((HEAD, HEAD)), slots,
        np.diag(np.maximum(std, 1e-6) ** 2), no_holds(), np.zeros(1), np.zeros(1),
    )  # fmt: skip


def begin_with(
    position: Floats, velocity: Floats, std: Floats, features: Floats, covariance: Floats, *, turns: bool
) -> Window:
    """Belief of the sliding window with one pose, and features (3F,) known beforehand with a covariance (3F, 3F)."""
    alone, count = begin(position, velocity, std, turns=turns), len(features)
    spread = scipy.linalg.block_diag(alone.covariance, covariance)
    information = scipy.linalg.block_diag(alone.prior.hessian, inverse(covariance))
    head, size = np.concatenate([alone.head, features]), POSE + count
    pose = np.concatenate([alone.slots.middle[0], features])[None]
    slots = Quadratic(np.zeros((1, size, size)), np.zeros((1, size)), pose)
    prior, noise = Quadratic(information, np.zeros(len(head)), head), np.zeros(information.shape)
    return alone._replace(head=head, prior=prior, noise=noise, slots=slots, covariance=spread)


def pose_design(window: Window) -> Floats:
    """Matrix (K, A, 7 + (K - 1) A) that gives the window's poses from its unknowns but the features (see
    `motion_basis.pose_matrix`)."""
    return pose_matrix(window.step.tobytes(), window.velocity_turn.tobytes(), window.turns)


def poses(window: Window) -> Floats:
    """Positions [m] and compass offsets [rad] of the window's poses (K, 4), heave included."""
    found = floor_poses(window)
    found[:, 2] += window.heave
    return found


def floor_poses(window: Window) -> Floats:
    """Poses (K, 4) of the sliding window as `poses` returns them, as the motion gives them: without heave."""
    free = window.accel.shape[1]
    found = np.empty((window.num_poses, POSE))
    found[:, TURN] = window.head[6]
    found[:, :free] = pose_design(window) @ np.concatenate([window.head[:HEAD], window.accel.ravel()])
    return found


def mapped(design: Floats, rows: Floats) -> Floats:
    """Product (N, ...) of a design (N, 7 + (K - 1) A), which leaves out the window's features, with rows (D, ...) of
    all its unknowns."""
    return np.asarray(design[:, :HEAD] @ rows[:HEAD] + design[:, HEAD:] @ rows[len(rows) + HEAD - design.shape[1] :])


def _carried(window: Window, rows: Floats) -> Floats:
    """Last pose, velocity and compass offset (7, ...) of the sliding window, mapped linearly from rows (D, ...) of all
    its unknowns."""
    return mapped(last_pose_matrix(window.step.tobytes(), window.velocity_turn.tobytes(), window.turns), rows)


def mean_now(window: Window) -> Floats:
    """Mean (7 + 3F,) of the sliding window's last pose, its velocity, the compass offset, and the features."""
    unknowns = np.concatenate([window.head, window.accel.ravel()])
    found = np.concatenate([_carried(window, unknowns), window.head[HEAD:]])
    found[2] += window.heave[-1]
    return found


def now(window: Window) -> tuple[Floats, Floats]:
    """Mean (7 + 3F,) of the present as in `mean_now`, and its covariance."""
    return now_with_excess(window)[:2]


def now_with_excess(window: Window) -> tuple[Floats, Floats, Floats]:
    """Mean and covariance of the present as in `now`, and the excess covariance (6, 6) of position and velocity that
    the acceleration priors leave out.

    The estimate takes each acceleration by a precision p, that of the calmest motion mode that may be; its error hangs
    on the variance q that the acceleration truly has. The slope `p a` of its prior then has the variance `p^2 q`, of
    which the window's covariance C holds p: `C (p^2 q - p) C^T` over all steps is what is left out. That is the error
    of an estimator with a wrong model (Gelb 1974, chapter 7: suboptimal filter design and sensitivity analysis).
    """
    size, rows = len(window.head), _carried(window, window.covariance)
    covariance = window.covariance[:size, :size].copy()
    covariance[:HEAD, :HEAD], covariance[:HEAD, HEAD:] = _carried(window, rows.T), rows[:, HEAD:size]
    covariance[HEAD:, :HEAD] = rows[:, HEAD:size].T
    return mean_now(window), covariance, _excess(window, rows)


def excess_now(window: Window) -> Floats:
    """Excess covariance (6, 6) of the present's position and velocity (see `now_with_excess`)."""
    return _excess(window, _carried(window, window.covariance))


def _excess(window: Window, rows: Floats) -> Floats:
    """Excess covariance (6, 6) of the window's present pose and velocity, from its covariance (7, D) with all of the
    window's unknowns."""
    size = len(window.head)
    whole, late = rows[:6, :size], rows[:6, size:]
    pushed = late * np.sqrt(_surplus(window.solved, window.variance)).ravel()
    excess = whole @ window.noise @ whole.T
    return np.asarray(0.5 * (excess + excess.T) + pushed @ pushed.T)


def now_under(window: Window, precision: Floats, present: tuple[Floats, Floats] | None = None) -> tuple[Floats, Floats]:
    """Mean and covariance of the present as in `now`, had the last solution had other prior precisions (K - 1, A) of
    the accelerations in a few steps.

    `present` is `now`, where it is known. By Woodbury's identity, so that nothing is solved anew.
    """
    (mean, covariance), change = present or now(window), (precision - window.solved).ravel()
    at = change.nonzero()[0]
    own, change = len(window.head) + at, change[at, None]
    wide = window.covariance[own]
    across = np.concatenate([_carried(window, wide.T).T, wide[:, HEAD : len(window.head)]], axis=1)
    weight = np.linalg.solve(np.eye(len(at)) + change * wide[:, own], change * across)
    return mean - window.accel.ravel()[at] @ weight, covariance - across.T @ weight


def with_present(
    window: Window, left: Floats, jacobian: Floats, turned: Floats, nuisance: Floats, variance: Floats
) -> Window:
    """Sliding window with the last slot's quadratic made from the present cycle's innovations (N, 3), in standard
    deviations, and their jacobians (N, 3, 7 + 3F) by the present and `turned` (N, 3, Z) by attitude and heave, whose
    estimates are `nuisance` (Z,) and whose prior variances are (Z,); all at full weight."""
    spot = np.concatenate([floor_poses(window)[-1], window.head[HEAD:]])
    # what is seen does not hang on the velocity
    flat = np.concatenate([jacobian[..., :3], jacobian[..., 6:], turned, left[..., None]], axis=2)
    flat = flat.reshape(-1, flat.shape[-1])
    found = marginalise((flat.T @ flat)[None], nuisance[None], variance[None])
    hessian, gradient, middle = (field.copy() for field in window.slots)
    hessian[-1], gradient[-1], middle[-1] = found.hessian[0], -found.slope[0], spot
    return window._replace(slots=Quadratic(hessian, gradient, middle))


def _surplus(precision: Floats, variance: Floats) -> Floats:
    """Variance (..., A) of the slopes of acceleration priors beyond their precisions (..., A), where the accelerations
    have a variance (..., A) (see `now_with_excess`)."""
    return np.maximum(precision**2 * variance - precision, 0.0)


def extend(
    window: Window, dt: float, precision: Floats, variance: Floats | float = 0.0, velocity_turn: float = 0.0
) -> Window:
    """Append a pose to the sliding window, `dt` [s] after the last, with prior precisions (A,) of the step's
    acceleration, its `variance` (A,) and its `velocity_turn` [rad]."""
    free = len(precision)
    slots = Quadratic(*(np.concatenate([field, np.zeros((1, *field.shape[1:]))]) for field in window.slots))
    covariance = np.zeros((len(window.covariance) + free,) * 2)
    covariance[:-free, :-free] = window.covariance
    covariance[-free:, -free:] = np.diag(1.0 / precision)
    return window._replace(
        accel=np.concatenate([window.accel, np.zeros((1, free))]),
        precision=np.concatenate([window.precision, precision[None]]),
        solved=np.concatenate([window.solved, precision[None]]),
        variance=np.concatenate([window.variance, np.zeros((1, free)) + variance]),
        uneven=np.append(window.uneven, precision[2]),
        step=np.append(window.step, dt), velocity_turn=np.append(window.velocity_turn, velocity_turn), slots=slots,
        covariance=covariance, heave=np.append(window.heave, 0.0),
        heave_variance=np.append(window.heave_variance, 0.0), rates=None,
    )  # fmt: skip


def slide(window: Window) -> Window:
    """Marginalise the oldest pose of the sliding window at the present estimate."""
    size, free = len(window.head), window.accel.shape[1]
    first = np.append([0, 1, 2], np.arange(HEAD - 1, size))
    hessian, gradient = window.prior.hessian.copy(), window.prior.slope(window.head)
    oldest = Quadratic(*(field[0] for field in window.slots))
    hessian[first[:, None], first] += oldest.hessian
    gradient[first] += oldest.slope(window.head[first])
    # the next pose and the acceleration in between, instead of the oldest pose
    dt, angle, accel = float(window.step[0]), float(window.velocity_turn[0]), window.accel[0]
    change = np.eye(size, size + free)
    carry = step_transition(dt, angle, free)
    back = step_back(carry)
    change[:HEAD, :HEAD], change[:HEAD, size:] = back[:, :HEAD], back[:, HEAD:]
    wide, steep = change.T @ hessian @ change, change.T @ gradient
    wide[size:, size:] += np.diag(window.precision[0])
    steep[size:] += window.precision[0] * accel
    if window.rates:
        at = np.concatenate([[3, 4, 5], size + np.arange(3)])
        information, pull = window.rates.first_step(dt, angle, window.head[3:6], accel[:3])
        wide[np.ix_(at, at)] += information
        steep[at] += pull
    gain = np.asarray(np.linalg.solve(wide[size:, size:], wide[size:, :size])).T
    left = wide[:size, :size] - gain @ wide[size:, :size]
    shaken = change.T @ window.noise @ change
    shaken[size:, size:] += np.diag(_surplus(window.precision[0], window.variance[0]))
    head = window.head.copy()
    head[:HEAD] = carry @ np.concatenate([head[:HEAD], accel])
    prior = Quadratic(0.5 * (left + left.T), steep[:size] - gain @ steep[size:], head)
    moved = np.concatenate([np.arange(HEAD), np.arange(size, size + free)])
    covariance = window.covariance.copy()
    covariance[:HEAD] = carry @ covariance[moved]
    covariance[:, :HEAD] = covariance[:, moved] @ carry.T
    covariance = np.concatenate([covariance[:size], covariance[size + free :]])
    return window._replace(
        head=head, accel=window.accel[1:], precision=window.precision[1:], solved=window.solved[1:],
        variance=window.variance[1:], uneven=window.uneven[1:], step=window.step[1:],
        velocity_turn=window.velocity_turn[1:], prior=prior,
        noise=eliminated_noise(shaken, size, gain), slots=Quadratic(*(field[1:] for field in window.slots)),
        covariance=np.concatenate([covariance[:, :size], covariance[:, size + free :]], axis=1),
        heave=window.heave[1:], heave_variance=window.heave_variance[1:], rates=None,
    )  # fmt: skip


def eliminated_noise(noise: Floats, size: int, gain: Floats) -> Floats:
    """Covariance (size, size) of the cost's gradient that is left when the other unknowns are eliminated by `gain`."""
    lift = np.concatenate([np.eye(size), -gain], axis=1)
    return np.asarray(lift @ noise @ lift.T)


def solve(window: Window, *, spread: bool = True) -> Window:
    """One Gauss-Newton step of the sliding window on its present quadratics, and the covariance there (the old one,
    without `spread`)."""
    size = len(window.head)
    hessian, gradient = _normal(window)
    if spread:
        covariance, solved = inverse(hessian), window.precision
        change = -(covariance @ gradient)
    else:
        covariance, solved, change = window.covariance, window.solved, -solution(hessian, gradient)
    return window._replace(
        head=window.head + change[:size],
        accel=window.accel + change[size:].reshape(window.accel.shape),
        solved=solved,
        covariance=covariance,
    )


def _normal(window: Window) -> tuple[Floats, Floats]:
    """Hessian and gradient of the sliding window's whole cost (priors and measurements) by the head and the
    accelerations."""
    size, (steps, free), slots = len(window.head), window.accel.shape, window.slots.hessian
    spot = np.empty(slots.shape[:2])
    spot[:, :POSE], spot[:, POSE:] = floor_poses(window), window.head[HEAD:]
    slope, weight = window.slots.slope(spot), slots[:, :POSE, :POSE]
    if window.rates:
        weight = weight.copy()
        weight[:, :3, :3] += window.rates.single
        slope[:, :3] += window.rates.slope(spot[:, :3])
    hessian, gradient = np.zeros((size + steps * free,) * 2), np.zeros(size + steps * free)
    design, count = pose_design(window), (steps + 1) * free
    flat = design.reshape(count, -1)
    inner = flat.T @ (weight[:, :free, :free] @ design).reshape(count, -1)
    if window.rates:
        shared = flat.T @ window.rates.common.reshape(count, -1)
        inner -= shared @ shared.T
    cross = flat.T @ slots[:, :free, POSE:].reshape(count, -1)
    pull = slope[:, :free].ravel() @ flat
    # all but the features, as they stand in the window and in the design
    moving = ((slice(HEAD), slice(HEAD)), (slice(size, None), slice(HEAD, None)))
    for row, part in moving:
        hessian[row, HEAD:size], hessian[HEAD:size, row], gradient[row] = cross[part], cross[part].T, pull[part]
        for column, other in moving:
            hessian[row, column] = inner[part, other]
    hessian[HEAD:size, HEAD:size] = slots[:, POSE:, POSE:].sum(axis=0)
    gradient[HEAD:size] = slope[:, POSE:].sum(axis=0)
    hessian[:size, :size] += window.prior.hessian
    gradient[:size] += window.prior.slope(window.head)
    force, information = window.holds.pulls(window.features)
    own = _rows(window.holds)
    np.add.at(hessian, (own[:, :, None], own[:, None, :]), information)
    np.add.at(gradient, own, force)
    at = np.arange(size, len(hessian))
    hessian[at, at] += window.precision.ravel()
    gradient[at] += (window.precision * window.accel).ravel()
    return hessian, gradient


def step_covariances(window: Window, count: int) -> Floats:
    """Covariances (K, A, A) of the accelerations over the sliding window's first K steps."""
    free = window.accel.shape[1]
    at = len(window.head) + np.arange(count * free).reshape(count, free)
    return window.covariance[at[:, :, None], at[:, None, :]]


def weigh_holds(window: Window) -> Window:
    """Sliding window with each direction prior's posterior probability, from what all else tells of its wall."""
    holds = window.holds
    if not len(holds.feature):
        return window
    rows = _rows(holds)
    blocks = window.covariance[rows[:, :, None], rows[:, None, :]]
    return window._replace(holds=holds.weighed(window.features, blocks))


def _rows(holds: DirectionPriors) -> Integers:
    """Rows (N, 6) of the head at which stand the features that direction priors are about."""
    return np.asarray(HEAD + 3 * holds.pair[:, :, None] + np.arange(3)).reshape(-1, 6)
