"""Learning how the agent moves: each step's motion-mode probabilities, and the prior of its acceleration that follows.

Axes are learnt in groups, a chain of motion modes each (see `smoother.motion`). The height is asked once more: each
step's likelihood is that of its own acceleration, the other steps' priors being what they are, and one datum that tells
of forty steps at once counts forty times. Next to nothing measures the height while no ceiling is known; noise of no
weight made an agent climb. So the vertical chain's priors stand against those of an uneven floor and of a level one, on
which the height does not change, by the marginal likelihood of all steps together.
"""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Floats
from rislam_rt.slam.config import SlamConfig
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.smoother import motion
from rislam_rt.slam.window.smoother.cholesky import inverse, log_evidence
from rislam_rt.slam.window.smoother.manoeuvre_segments import manoeuvring_share
from rislam_rt.slam.window.smoother.motion_basis import TURN
from rislam_rt.slam.window.smoother.window_gaussian import Window, step_covariances
from rislam_rt.slam.window.solver_limits import DAMPING, PRIORS, STILL
from rislam_rt.slam.window.state import WindowState

UP = 1
"""Index of the vertical axis's group among `GROUPS`."""
GROUPS = (np.array([0, 1]), np.array([2]), np.array([TURN]))
"""Axes that share one chain of motion modes: the two horizontal ones, the vertical one, and the rate of turn."""
COLUMNS = np.array([0, 0, 1, 2])
"""Index into `GROUPS` of each axis."""


class VerticalInformation(NamedTuple):
    """What is told of the vertical accelerations of a window's K steps without their priors."""

    information: Floats
    """(K, K) [s^4/m^2], and..."""
    slope: Floats
    """(K,) [s^2/m] ...its product with the accelerations that it tells of."""


def learn_motion(state: WindowState, lively: tuple[float, float] = (0.0, 0.0)) -> WindowState:
    """Re-estimate every step's motion-mode probabilities by forward-backward smoothing, and the prior precision of its
    acceleration from them; `lively` are the log odds of a manoeuvre in the last step, across and upwards, by which
    components were associated."""
    window = state.window
    if not len(window.accel) or state.config.motion == "told":
        return state
    told = vertical_information(window)
    likely = likelihoods(window, len(window.accel), told)
    likely[: UP + 1, -1, -1] += lively
    posterior, level = motion.smooth(state.motion_mode, likely, CONSTANTS.stay)
    share, still = manoeuvre_share(
        told, motion.expected_precision(posterior[UP]), was_level=state.is_level, lively=lively[UP]
    )
    nearer = nearer_floor(np.append(posterior[UP], level[UP, None], axis=0), share)
    posterior[UP], level[UP] = nearer[:-1], nearer[-1]
    joint = manoeuvring_share(window, motion.expected_precision(posterior[0]), state.motion_mode[0], lively[0])
    posterior[0] = livelier_by(posterior[0], joint)
    level[0] = livelier_by(level[0], joint[-1:])
    before = window.precision.copy()
    before[:, 2] = window.uneven
    # all steps at once, each as if the others were settled: damped, or they would take turns
    precision = np.exp((1.0 - DAMPING) * np.log(before) + DAMPING * np.log(precisions(posterior)))
    uneven = precision[:, 2].copy()
    if still > 0.5:
        precision[:, 2] *= (STILL**-2.0 / uneven) ** still
    variance = variances(posterior)
    variance[:, 2] *= 1.0 - still
    window = window._replace(precision=precision, variance=variance, uneven=uneven)
    return state._replace(window=window, level=level, is_level=still > 0.5)


def likelihoods(window: Window, count: int, told: VerticalInformation) -> Floats:
    """Log likelihoods (N, K, L) of the L motion modes in the window's first K steps, for N groups of axes; upwards,
    from what is told of all its steps, were the floor uneven, whether it is or not."""
    block = step_covariances(window, count)
    covariance = inverse(told.information + np.diag(window.uneven))
    mean, variance = (covariance @ told.slope)[:count, None], covariance.diagonal()[:count, None, None]
    found = np.stack([
        motion.log_likelihood(mean, variance, window.uneven[:count])
        if number == UP
        else motion.log_likelihood(
            window.accel[:count, group], block[:, group[:, None], group], window.solved[:count, group[0]]
        )
        for number, group in enumerate(GROUPS[: block.shape[1] - 1])
    ])  # fmt: skip
    found[0, :, motion.is_level_only()] = -np.inf
    return found


def vertical_information(window: Window) -> VerticalInformation:
    """Information on the window's vertical accelerations for `likelihoods` and `manoeuvre_share`."""
    size, free = len(window.head), window.accel.shape[1]
    inner = inverse(window.covariance[size + 2 :: free, size + 2 :: free])
    return VerticalInformation(inner - np.diag(window.solved[:, 2]), np.asarray(inner @ window.accel[:, 2]))


def manoeuvre_share(
    told: VerticalInformation, precision: Floats, *, was_level: bool, lively: float = 0.0
) -> tuple[float, float]:
    """Expected share, from 0 for an uneven floor to 1 for the vertical chain's prior precisions (K,), of a prior of the
    vertical accelerations between these two, and the probability that the floor is level and the height does not
    change at all, both by the marginal likelihood of all steps together.

    Floors are level as often as other surfaces are; from one that is not (`was_level`), it takes a rare event to come
    to one. Priors in between are `PRIORS` steps in equal ratios of the precision; a manoeuvre of any size is a rare
    event.
    """
    floor = float(motion.expected_precision(motion.first_motion_mode(0.0)))
    share = np.arange(PRIORS) / (PRIORS - 1.0)
    std = np.sqrt(floor ** (share[:, None] - 1.0) * precision ** -share[:, None])
    std = np.concatenate([std, np.full((1, len(precision)), STILL)])
    log_like = np.array([log_evidence(*told, each) for each in std])
    log_like[1:-1] += CONSTANTS.log_rare
    log_like[-2] += lively
    log_like[-1] += CONSTANTS.log_upright if was_level else CONSTANTS.log_rare
    weight = np.exp(log_like - log_like.max())
    weight /= weight.sum()
    moves = weight[:-1].sum()
    return float(weight[:-1] @ share / max(moves, 1e-9)), float(weight[-1])


def livelier_by(level: Floats, share: Floats) -> Floats:
    """Motion-mode probabilities (..., L) of steps that are in the liveliest mode besides by a `share` (...,)."""
    mixed = (1.0 - share)[..., None] * level
    mixed[..., -1] += share
    return mixed


def nearer_floor(level: Floats, share: float) -> Floats:
    """Vertical motion-mode probabilities (..., L), pooled with those of an uneven floor by `share` where they are
    livelier."""
    pooled = motion.pool(level, motion.first_motion_mode(0.0), share)
    calmer = motion.expected_variance(pooled) < motion.expected_variance(level)
    return np.where(calmer[..., None], pooled, level)


def precisions(levels: Floats) -> Floats:
    """Prior precisions (..., A) of accelerations along A axes, from motion-mode probabilities (N, ..., L) of N groups
    of axes."""
    each = [motion.prior_precision(level, group == 2) for group, level in enumerate(levels)]
    return np.stack([each[group] for group in COLUMNS[: len(levels) + 1]], axis=-1)


def variances(levels: Floats) -> Floats:
    """Variances (..., A) of accelerations along A axes, from motion-mode probabilities (N, ..., L) of N groups of axes
    (see `now_with_excess`)."""
    return np.stack([motion.expected_variance(levels[group]) for group in COLUMNS[: len(levels) + 1]], axis=-1)


def assumed_precision(config: SlamConfig, dt: float, turns: bool) -> Floats:
    """Prior precisions (A,) of one step's acceleration, and of its rate of turn where the heading is estimated, under
    told motion."""
    upwards = config.sigma_a if config.height == "estimated" else STILL
    # in no time nothing turns, at any rate
    rates = (config.turn_std / np.sqrt(dt or 1.0),) if turns else ()
    return np.array([config.sigma_a, config.sigma_a, upwards, *rates]) ** -2.0


def log_manoeuvre(state: WindowState) -> float:
    """Log odds that the last step belongs to a manoeuvre of the liveliest motion mode: as it is learnt or, if that is
    likelier, as rare as one is and by what the map's returns tell of that step's horizontal acceleration."""
    level, window, free = np.maximum(state.level[0], 1e-12), state.window, state.window.accel.shape[1]
    learnt, rare = float(scipy.special.logit(min(level[-1], 1.0 - 1e-12))), float(scipy.special.logit(CONSTANTS.rare))
    if not len(window.accel):
        return max(learnt, rare)
    block = window.covariance[-free:, -free:][:2, :2]
    told = motion.log_likelihood(window.accel[-1:, :2], block[None], window.solved[-1:, 0])[0]
    calm = np.logaddexp.reduce(np.log(level[:-1] / level[:-1].sum()) + told[:-1])
    return max(learnt, rare + float(told[-1] - calm))
