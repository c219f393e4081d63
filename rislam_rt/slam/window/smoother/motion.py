"""Motion modes: a hidden Markov chain over levels of acceleration, by which the filter learns how strongly each step
manoeuvres.

Each step's acceleration has a standard deviation from a `ladder`; the level stays with a probability and else jumps
anywhere. What the measurements tell of a step's acceleration without its own prior (the cavity of expectation
propagation, Minka 2001) gives each level a likelihood; forward-backward gives its posterior, and the expected precision
is the step's prior in the next solution.
"""

from functools import lru_cache

import numpy as np

from rislam_rt.arrays import Booleans, Floats
from rislam_rt.slam.model_constants import CONSTANTS
from rislam_rt.slam.window.solver_limits import MODES


def ladder() -> Floats:
    """Standard deviations (L,) [m/s^2] of acceleration of the motion modes, in equal ratios."""
    return _ladder(CONSTANTS.level, CONSTANTS.liveliest)


@lru_cache(maxsize=4)
def _ladder(calmest: float, liveliest: float) -> Floats:
    """`ladder` of motion modes between given ends [m/s^2], cached."""
    return np.geomspace(calmest, liveliest, MODES)


def is_level_only() -> Booleans:
    """Which motion modes (L,) are for the height alone: a floor is level, but nothing that moves keeps its speed so
    well."""
    return ladder() < CONSTANTS.calmest


def first_motion_mode(sigma_a: float) -> Floats:
    """Initial probabilities (L,) of the motion modes: highest for the one nearest to the told acceleration `sigma_a`
    [m/s^2], a third as high for each mode farther off."""
    return _first(max(sigma_a, CONSTANTS.level), CONSTANTS.level, CONSTANTS.liveliest)


@lru_cache(maxsize=4)
def _first(sigma_a: float, calmest: float, liveliest: float) -> Floats:
    """`first_motion_mode` on the ladder between given ends [m/s^2], cached."""
    nearest = int(np.argmin(np.abs(np.log(_ladder(calmest, liveliest) / sigma_a))))
    weight = 3.0 ** -np.abs(np.arange(MODES) - nearest).astype(np.float64)
    return np.asarray(weight / weight.sum())


@lru_cache(maxsize=4)
def transition(stay: float) -> Floats:
    """Transition probabilities (L, L) between motion modes: one stays with probability `stay`, and else changes, more
    often by a little than by much."""
    count = MODES
    gap = np.abs(np.arange(count)[:, None] - np.arange(count))
    jump = np.where(gap > 0, 3.0**-gap, 0.0)
    return stay * np.eye(count) + (1.0 - stay) * jump / jump.sum(axis=1, keepdims=True)


@lru_cache(maxsize=4)
def transition_over(stay: float, steps: int) -> Floats:
    """Transition probabilities (L, L) between motion modes over so many steps."""
    return np.asarray(np.linalg.matrix_power(transition(stay), steps))


def log_likelihood(accel: Floats, spread: Floats, precision: Floats, shift: Floats | None = None) -> Floats:
    """Log likelihoods (..., K, L) of the motion modes in K steps, from posterior means (K, A) and covariances (K, A, A)
    of the accelerations and the prior precisions (K,) within these; or of accelerations that are larger than those by
    a `shift` (..., K, A)."""
    spread, vector = principal_axes(spread)
    along = (np.swapaxes(vector, 1, 2) @ accel[..., None])[..., 0] / spread
    # N(m; 0, C + s^2 I) through the cavity's information C^-1, which may be singular
    value = np.maximum(1.0 / spread - precision[:, None], 0.0)
    variance = ladder() ** 2
    total = 1.0 + value[:, None] * variance[:, None]
    if shift is None:
        gain = (along**2)[:, None] * variance[:, None] / total
        return np.asarray(0.5 * (gain - np.log(total)).sum(axis=-1))
    by = (np.swapaxes(vector, 1, 2) @ shift[..., None])[..., 0]
    gain = ((along + value * by) ** 2)[..., None, :] * variance[:, None] / total
    less = (by * (along + 0.5 * value * by)).sum(axis=-1)
    return np.asarray(0.5 * (gain - np.log(total)).sum(axis=-1) - less[..., None])


def principal_axes(spread: Floats) -> tuple[Floats, Floats]:
    """Variances (K, A) along the principal axes, and these axes (K, A, A) as columns, of covariances (K, A, A) of one
    or two numbers."""
    if spread.shape[-1] == 1:
        return spread[..., 0], np.ones(spread.shape)
    one, two, both = spread[..., 0, 0], spread[..., 1, 1], spread[..., 0, 1]
    angle = 0.5 * np.arctan2(2.0 * both, one - two)
    large = 0.5 * (one + two) + np.hypot(0.5 * (one - two), both)
    cos, sin = np.cos(angle), np.sin(angle)
    found, vector = np.empty((*one.shape, 2)), np.empty(spread.shape)
    found[..., 0], found[..., 1] = large, (one * two - both**2) / large
    vector[..., 0, 0] = vector[..., 1, 1] = cos
    vector[..., 0, 1], vector[..., 1, 0] = -sin, sin
    return found, vector


def forward(before: Floats, log_like: Floats, stay: float) -> Floats:
    """Filtered probabilities (N, L) of the motion modes of N chains after one more step with log likelihoods (N, L),
    from those before it."""
    message = (before @ transition(stay)) * np.exp(log_like - log_like.max(axis=1, keepdims=True))
    return np.asarray(message / message.sum(axis=1, keepdims=True))


def log_evidence(before: Floats, log_like: Floats, stay: float) -> Floats:
    """Log marginal likelihoods (N,) of N chains of K steps by log likelihoods (N, K, L) of the motion modes, from one
    set of probabilities (L,) before them."""
    top = log_like.max(axis=2)
    like, move = np.exp(log_like - top[:, :, None]).swapaxes(0, 1), transition(stay)
    message, found, coming = np.tile(before, (len(top), 1)), top.sum(axis=1), np.empty(like[0].shape)
    for row, own in enumerate(like):
        np.dot(message, move, out=coming)
        message = coming * own
        if row % 16 == 15 or row == len(like) - 1:  # nothing can vanish in fewer steps
            total = message.sum(axis=1)
            message, found = message / total[:, None], found + np.log(total)
    return np.asarray(found)


def smooth(before: Floats, log_like: Floats, stay: float) -> tuple[Floats, Floats]:
    """Smoothed probabilities (N, K, L) of the motion modes of N chains by forward-backward recursion, and the last
    step's filtered ones (N, L)."""
    move, (chains, count, levels) = transition(stay), log_like.shape
    like = np.exp(log_like - log_like.max(axis=2, keepdims=True)).swapaxes(0, 1)
    # forward and backward at once, side by side: what comes in, and what goes on with each step's own likelihood
    ways = np.zeros((2 * levels, 2 * levels))
    ways[:levels, :levels], ways[levels:, levels:] = move, move.T
    both = np.concatenate([like, like[::-1]], axis=2)
    coming, message = np.empty(both.shape), np.ones((chains, 2 * levels))
    message[:, :levels] = before
    for row, (into, own) in enumerate(zip(coming, both, strict=True)):
        np.dot(message, ways, out=into)
        np.multiply(into, own, out=message)
        if row % 16 == 15 or row == count - 1:
            each = message.reshape(chains, 2, levels)
            each /= each.sum(axis=2, keepdims=True)
    posterior = np.swapaxes(coming[..., :levels] * like * coming[::-1, :, levels:], 0, 1)
    return posterior / posterior.sum(axis=2, keepdims=True), message[:, :levels].copy()


def expected_precision(posterior: Floats) -> Floats:
    """Expected precision (...,) [s^4/m^2] of a step's acceleration, from motion-mode probabilities (..., L)."""
    return np.asarray(posterior @ ladder() ** -2.0)


def prior_precision(posterior: Floats, is_turn: bool) -> Floats:
    """Prior precision (...,) of a step's acceleration, from motion-mode probabilities (..., L): the expected precision;
    of the rate of turn, which is told nothing beforehand, one over the expected variance."""
    return 1.0 / expected_variance(posterior) if is_turn else expected_precision(posterior)


def expected_variance(posterior: Floats) -> Floats:
    """Expected variance (...,) [m^2/s^4] of a step's acceleration, from motion-mode probabilities (..., L)."""
    return np.asarray(posterior @ ladder() ** 2)


def pool(one: Floats, other: Floats, share: float) -> Floats:
    """Logarithmic pool of motion-mode probabilities (..., L), `one` to the power `share` (Genest and Zidek 1986)."""
    found = np.maximum(one, 1e-300) ** share * np.maximum(other, 1e-300) ** (1.0 - share)
    return np.asarray(found / found.sum(axis=-1, keepdims=True))
