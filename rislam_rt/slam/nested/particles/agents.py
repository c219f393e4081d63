"""Agent particles of the nested filter: motion and resampling that keep mean and covariance exactly.

What a room cannot tell (a shift or drift of everything together) no later measurement mends. An ordinary resampling
of N particles shifts the mean by a standard deviation over sqrt(N) and takes 1/N of the variance away; over hundreds
of resamplings such directions get lost. So whatever is drawn here is corrected to the exact first two moments.
"""

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.nested.particles.landmark_cloud import kernel_width
from rislam_rt.slam.sampling import systematic_ancestors

ROOM = 10
"""Number of agent particles per dimension that are needed to correct a covariance."""
ROUNDING = 1e-9
"""Relative spread below which a value counts as constant."""
DEEP = 30.0
"""Largest logarithm of the Poisson rate while a likelihood is fitted to weights."""
STEPS = 40
"""Largest number of Newton steps of a likelihood's fit to weights."""
TERM_ROOM = 2.5
"""Effective number of agent particles per coefficient that are needed to fit a likelihood to weights."""
KERNEL_DIMS = 4
"""Number of dimensions for the kernel's width: start position and velocity in the plane; the rest follows from them."""


def moments(weight: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Weighted mean (D,) and covariance (D, D) of agent particles (N, D)."""
    mean = weight @ values
    centred = values - mean
    return mean, (centred * weight[:, None]).T @ centred


def whiten(weight: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Weighted agent particles (N, D) in coordinates (N, K) of mean zero and unit covariance, null directions left out.

    Also their mean (D,), and the factor (D, K) back to them: `particle = mean + factor @ value`.
    """
    mean, covariance = moments(weight, values)
    # a constant's rounding errors must not become a direction of their own
    scale = np.maximum(np.sqrt(np.diag(covariance)), ROUNDING * (1.0 + np.abs(mean)))
    spread, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    keep = spread > 1e-10
    root = np.sqrt(spread[keep])
    kept = vectors[:, keep]
    return (values - mean) / scale @ kept / root, mean, scale[:, None] * kept * root


def standardise(weight: Floats, values: Floats) -> Floats:
    """Agent particles (N, K) moved least to weighted mean zero and, where N allows, unit covariance."""
    values = values - weight @ values
    if values.shape[1] == 0 or 1.0 / np.sum(weight**2) < ROOM * values.shape[1]:
        return values
    spread, vectors = np.linalg.eigh((values * weight[:, None]).T @ values)
    return values @ (vectors * np.maximum(spread, 1e-3) ** -0.5 @ vectors.T)


def exact_noise(values: Floats, dims: int, *, rng: np.random.Generator) -> Floats:
    """Motion noise (N, dims) for agent particles (N, D): uncorrelated with them, with exact moments in this sample.

    Weights do not count here: `posterior` corrects for what they do.
    """
    count = len(values)
    equal = np.full(count, 1.0 / count)
    noise = rng.standard_normal((count, dims))
    known, _, _ = whiten(equal, values)
    if count >= ROOM * max(known.shape[1], 1):
        noise = noise - equal @ noise
        noise = noise - known @ (known.T @ noise) / count
    return standardise(equal, noise)


def posterior(log_weight: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Mean (D,) and covariance (D, D) of weighted agent particles (N, D).

    The weighted sample's own moments err by a standard deviation over sqrt(N) even in directions that the weights do
    not depend on at all: the sample correlates by chance. Here the weights are taken for a Gaussian likelihood, plus
    noise: the one that gives the sample its own weighted moments. What it makes of equally weighted particles, were
    they Gaussian, is known exactly. Without enough particles, or if no Gaussian fits, the sample's own moments are
    returned.
    """
    weight, count = np.exp(log_weight), len(log_weight)
    standard, mean, factor = whiten(np.full(count, 1.0 / count), values)
    fitted = _likelihood(log_weight, standard) if standard.shape[1] else None
    if fitted is None:
        return moments(weight, values)
    slope, precision = fitted
    within = np.linalg.inv(precision)
    return mean + factor @ within @ slope, factor @ within @ factor.T


def _likelihood(log_weight: Floats, known: Floats) -> tuple[Floats, Floats] | None:
    """Gaussian fitted to agent particles' weights: slope b (K,), precision I + C of `exp(a + b y - y C y / 2)`."""
    # Poisson regression with a logarithmic link: its solution gives the sample the same mean and second moment as the
    # weights do, and noise on the weights only costs accuracy. None where it does not exist or is no Gaussian.
    count, dims = known.shape
    rows, cols = np.triu_indices(dims)
    size = 1 + dims + len(rows)
    if 1.0 / np.sum(np.exp(2.0 * log_weight)) < TERM_ROOM * size:
        return None
    terms = np.concatenate([np.ones((count, 1)), known, known[:, rows] * known[:, cols]], axis=1)
    target = count * np.exp(log_weight)
    found = np.zeros(size)
    for _ in range(STEPS):
        rate = np.exp(np.minimum(terms @ found, DEEP))
        hessian = (terms * rate[:, None]).T @ terms + 1e-6 * count * np.eye(size)
        step = np.linalg.solve(hessian, terms.T @ (target - rate))
        change = float(np.abs(terms @ step).max())
        found = found + step * min(1.0, 3.0 / max(change, 1e-12))
        if change < 1e-4:
            break
    else:
        return None
    curve = np.zeros((dims, dims))
    curve[rows, cols] = -found[1 + dims :]
    precision = np.eye(dims) + curve + curve.T
    return (found[1 : 1 + dims], precision) if np.linalg.eigvalsh(precision)[0] > 0.1 else None


def resample(log_weight: Floats, values: Floats, count: int, *, rng: np.random.Generator) -> tuple[Integers, Floats]:
    """Resampled agent particles: ancestors (count,), and the values (count, D) of their children, of equal weight.

    Systematic resampling and a smooth kernel about every survivor (Liu and West, 2001) on all of the values together,
    so that what they have in common stays in common; then the mean and covariance of `posterior` are given to them.
    """
    weight = np.exp(log_weight)
    mean, covariance = posterior(log_weight, values)
    standard, _, factor = whiten(weight, values)
    ancestors = systematic_ancestors(weight, count, rng=rng)
    width = kernel_width(count, min(max(standard.shape[1], 1), KERNEL_DIMS))
    chosen = standard[ancestors]
    moved = np.sqrt(1.0 - width**2) * chosen + width * rng.standard_normal(chosen.shape)
    moved = standardise(np.full(count, 1.0 / count), moved)
    return ancestors, mean + moved @ square_root(covariance, factor).T


def square_root(covariance: Floats, near: Floats) -> Floats:
    """Factor (D, K) of the agent particles' covariance, close to that (D, K) of one much like it."""
    back = np.linalg.pinv(near)
    values, vectors = np.linalg.eigh(back @ covariance @ back.T)
    return near @ (vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)
