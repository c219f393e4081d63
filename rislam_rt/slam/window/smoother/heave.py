"""Heave of the body in each cycle: its height above the floor it moves along, as whoever carries it bobs up and down.

A floor's height has its motion modes as any motion has, and none of them oscillates: for an agent that is carried they
leave a choice between a level floor and one that is lost. So each cycle has a height of its own beside the floor's,
white, of zero mean. It is a nuisance of its cycle as the attitude is, eliminated there beside it. Its deviation is
learnt: one of a ladder of levels, the first of which is none at all.
"""

import numpy as np
import scipy

from rislam_rt.arrays import Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.smoother import motion
from rislam_rt.slam.window.smoother.attitude import Attitude
from rislam_rt.slam.window.smoother.cholesky import log_evidences
from rislam_rt.slam.window.smoother.window_gaussian import Quadratic, Window
from rislam_rt.slam.window.solver_limits import BEGUN, HEAVES, STILL


def first_levels() -> Floats:
    """Initial probabilities (L,) of the levels of heave: none, and a third as much for each further one."""
    weight = 3.0 ** -np.arange(len(HEAVES), dtype=np.float64)
    return np.asarray(weight / weight.sum())


def expected_variance(probability: Floats) -> float:
    """Expected variance [m^2] of the heave from level probabilities (L,)."""
    return float(probability @ HEAVES**2)


def variance(probability: Floats) -> float:
    """Variance [m^2] by which the heave is estimated, from level probabilities (L,): as expected, or 0 as long as none
    at all is likelier."""
    return expected_variance(probability) if probability[0] <= 0.5 else 0.0


def at_start(up: float, std: float) -> tuple[float, float, Floats]:
    """Vertical velocity of the floor's path at the start and its deviation [m/s], where the body is told to rise by
    `up` within `std` [m/s]; and level probabilities (L,).

    Who is told to rise either does, or bobs above a level floor: what oscillates with a deviation s, accelerated by as
    much as the liveliest motion mode a, moves at sqrt(a s). If a bob is the likelier, the floor's velocity has the mean
    and the variance of both.
    """
    level = first_levels()
    spread = np.sqrt(std**2 + CONSTANTS.liveliest * HEAVES[1:])
    bobs = CONSTANTS.upright * level[1:] * _density(up, spread)
    climbs = (1.0 - CONSTANTS.upright) * level[0] * _density(up, np.hypot(std, CONSTANTS.walk))
    # an uneven floor's accelerations give as much in a second
    rests = CONSTANTS.upright * level[0] * _density(up, max(std, CONSTANTS.level))
    if max(climbs, rests) > bobs.sum():
        return up, std, level
    levels = np.append(climbs, bobs) / (climbs + bobs.sum())
    share = float(levels[0])
    return share * up, float(np.sqrt(std**2 + share * (1.0 - share) * up**2)), levels


def _density(value: float, std: Floats | float) -> Floats:
    """Density of a centred normal variable of deviations (L,) at a value, but for a common factor."""
    return np.asarray(np.exp(-0.5 * (value / std) ** 2) / std)


def window_levels(information: Floats, slope: Floats, rises: Floats) -> Floats:
    """Level probabilities (L,) of the heave over a whole window, by its marginal likelihood beside that of any floor.

    Of the vertical accelerations of the window's K steps an `information` matrix (K, K) and its product (K,) with them,
    `slope`, tell without their priors; `rises` (K, K) are the heights that they give to the poses after the first. The
    floor is level, or uneven by white accelerations of one of the motion modes' deviations; either that or the heave
    may have begun within the window, one of `BEGUN` steps ago.
    """
    count = len(slope)
    # a difference of large numbers: rounding may leave a little less than nothing
    value, vector = np.linalg.eigh(information)
    information = (vector * np.maximum(value, 0.0)) @ vector.T
    spans = np.array([count, *(ago for ago in BEGUN if ago < count)])
    late = np.arange(count) >= count - spans[:, None]
    modes = motion.ladder()[:, None, None] ** 2 * late
    floors = np.concatenate([np.zeros((1, count)), modes.reshape(-1, count)]) + STILL**2
    log_floor = np.log(1.0 - CONSTANTS.upright) + np.log(motion.first_motion_mode(0.0)) - np.log(len(spans))
    log_floor = np.append(np.log(CONSTANTS.upright), np.repeat(log_floor, len(spans)))
    # heights above the first pose, which has a heave as well if all have, as accelerations
    unit = np.linalg.solve(rises, np.column_stack([np.eye(count), np.ones(count)]))
    bobs = [(unit[:, :-1] * each) @ unit[:, :-1].T for each in late]
    bobs[0] = unit @ unit.T
    found = np.log(first_levels())
    for row, std in enumerate(HEAVES):
        some = std**2 * np.array(bobs if std else bobs[:1])
        prior = some[:, None] + floors[:, :, None] * np.eye(count)
        log_like = log_evidences(information, slope, prior.reshape(-1, count, count)).reshape(len(some), -1)
        found[row] += scipy.special.logsumexp(log_like + log_floor) - np.log(len(some))
    found = np.exp(found - found.max())
    return np.asarray(found / found.sum())


def begins(probability: Floats) -> tuple[float, float]:
    """Log probability, from level probabilities (L,) of the cycle before, that there is a heave in this one, and its
    expected variance [m^2] then."""
    ahead = foreseen(probability)
    any_at_all = float(ahead[1:].sum())
    return float(np.log(any_at_all)), expected_variance(ahead) / any_at_all


def with_heave(window: Window, variance: float, start: Floats | None = None) -> Window:
    """Sliding window with a heave of prior `variance` [m^2] in all its poses.

    If the window still begins at the run's start, whose height [m] was told with a deviation, `start` (2,), that height
    is the body's: of the floor's nothing is known beforehand any more (see `relinearise`).
    """
    if start is not None and variance:
        hessian, gradient, middle = (field.copy() for field in window.prior)
        less = max(hessian[2, 2] - CONSTANTS.walk**-2.0, 0.0)
        hessian[2, 2] -= less
        gradient[2] -= less * (middle[2] - start[0])
        window = window._replace(prior=Quadratic(hessian, gradient, middle))
    return window._replace(heave_variance=np.full(window.num_poses, variance))


def foreseen(before: Floats) -> Floats:
    """Level probabilities (L,) of the heave one cycle on, before it is heard: it stays, or anything is as likely as at
    first."""
    return CONSTANTS.stay * before + CONSTANTS.rare * first_levels()


def next_levels(before: Floats, told: Attitude, rotation: Floats) -> Floats:
    """Level probabilities (L,) of the heave after one more cycle, of which `told` (K = 1) knows the rotation, whose
    prior variances are (A,), and the heave.

    The marginal likelihood of a level is that of N(0, its variance) under the cycle's likelihood; no cycle tells more
    than that a rare event of another kind took place in it.
    """
    own = alone(told, rotation)
    information, slope = float(own.information[0, 0, 0]), float(own.slope[0, 0])
    spread = 1.0 + information * HEAVES**2
    log_like = 0.5 * (slope * HEAVES) ** 2 / spread - 0.5 * np.log(spread)
    found = foreseen(before)
    found *= np.exp(np.maximum(log_like - log_like.max(), -CONSTANTS.max_log_ratio))
    return np.asarray(found / found.sum())


def alone(told: Attitude, rotation: Floats) -> Attitude:
    """What is `told` of the heave (K = 1) with the rotation, whose prior variances are (A,), eliminated."""
    return _eliminated(told, slice(-1, None), slice(-1), 1.0 / rotation)


def without(told: Attitude, heave: float) -> Attitude:
    """What is `told` of the rotation (K = 1) with the heave, whose prior variance [m^2] is `heave`, eliminated."""
    if heave == 0.0:
        return restricted(told, told.slope.shape[1] - 1)
    return _eliminated(told, slice(-1), slice(-1, None), np.array([1.0 / heave]))


def restricted(told: Attitude, count: int) -> Attitude:
    """What is `told` of the first `count` of a cycle's nuisances (K = 1), with no others."""
    return Attitude(told.information[:, :count, :count], told.slope[:, :count])


def _eliminated(told: Attitude, keep: slice, out: slice, prior: Floats) -> Attitude:
    """What is `told` of the nuisances `keep`, rotation or heave, with the others, `out`, of these prior precisions,
    eliminated."""
    cross = told.information[:, keep, out]
    gain = cross @ np.linalg.inv(told.information[:, out, out] + np.diag(prior))
    information = told.information[:, keep, keep] - gain @ np.swapaxes(cross, 1, 2)
    return Attitude(information, told.slope[:, keep] - (gain @ told.slope[:, out, None])[..., 0])
