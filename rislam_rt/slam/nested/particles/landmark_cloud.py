"""The cloud of one landmark's particles for all agent particles: M points about a centre, shared through indices.

Points are stored as offsets from a centre in float64, in single precision (numpy) or as numbers of 21 bits (Dr.Jit,
`drjit_engine.py`), which costs nothing: an offset of 0.1 m is exact to 1e-7 m. An agent particle finds its points in
block `block[i]` and its weights in row `row[i]`. When agent particles are resampled only the indices are: nothing is
copied until weights change, and points are written anew only when landmark particles are resampled themselves.
"""

from typing import Any, NamedTuple, Protocol

import numpy as np

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.nested.particles.sightline import Kinds

HOPELESS = -1e30
"""Least log weight: as good as impossible, but still a number."""
DEEPEST = -30.0
"""Least exponent, against the largest of the same agent particle, at which a weight is summed up: less would only
make denormal numbers, which are slow."""
LEAST_STD = 1e-4
"""Least standard deviation [m] of a cloud that is resampled: a collapsed one must not stay so."""
LARGEST_WIDTH = 0.9
"""Largest kernel width of resampling, in standard deviations."""
SECOND = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])
"""Index (3, 3) of the second moments xx, xy, ... among sums in the order xx, yy, zz, xy, xz, yz."""


class Cloud(NamedTuple):
    """Particles of one landmark for all N agent particles. The arrays belong to the engine, numpy's or Dr.Jit's."""

    points: Any
    """B blocks of M points, offsets from the centre [m]."""
    log_weight: Any
    """R rows of M, float32, not normalised."""
    block: Integers
    """Block (N,) of each agent particle's points."""
    row: Integers
    """Row (N,) of each agent particle's weights."""
    log_total: Floats
    """Logarithm (N,) of the sum of each agent particle's weights."""
    size: int
    """Number M of landmark particles of each agent particle."""


class CloudSums(NamedTuple):
    """Weights and moments of a landmark's cloud for each of N agent particles, from one pass over its particles."""

    log_total: Floats
    """Logarithm (N,) of the sum of the new weights."""
    ess: Floats
    """Effective sample size (N,) of the landmark particles, 1 to M."""
    mean: Floats
    """Weighted mean (N, 3) [m] of the offsets."""
    covariance: Floats
    """Weighted covariance (N, 3, 3) [m^2] of the offsets."""


class Kernel(NamedTuple):
    """Random numbers and smoothing with which a cloud is resampled, drawn by the caller so that engines agree."""

    comb: Floats
    """Starts (N,) in [0, 1) of systematic resampling for each agent particle."""
    stride: int
    """Multiplier, coprime to M, of the permutation that takes children of one parent apart."""
    offset: int
    """Multiple of 4: by how many places the partner of a particle is away."""
    width: float
    """Kernel width h in standard deviations of the cloud."""


class CloudEngine(Protocol):
    """Protocol of the engines that weigh and resample clouds of landmark particles, on CPU or GPU."""

    name: str
    """Name of the engine: `numpy`, or Dr.Jit's `llvm` or `cuda`."""

    def build(self, points: Floats, log_weight: Floats, block: Integers, row: Integers) -> Cloud:
        """Build a landmark's cloud of blocks of points (B, M, 3) [m] and rows of log weights (R, M)."""

    def read(self, cloud: Cloud) -> tuple[Floats, Floats]:
        """Offsets (N, M, 3) and normalised log weights (N, M) of every agent particle, for tests and pictures."""

    def weigh(self, cloud: Cloud, kinds: Kinds, constants: Floats) -> tuple[Cloud, CloudSums]:
        """What an engine does with a landmark's cloud: multiply its weights by the likelihood of some returns,
        constants (K, N) float32."""

    def resample(self, cloud: Cloud, covariance: Floats, size: int, kernel: Kernel) -> Cloud:
        """What an engine does with a landmark's cloud: resample it to `size` equally weighted particles per agent
        particle, of mean 0, covariance (N, 3, 3)."""

    def compact(self, cloud: Cloud) -> Cloud:
        """Copy a cloud without the blocks and rows that no agent particle points at."""


def combine(lanes: Floats) -> CloudSums:
    """Weights and moments of a cloud for each of N agent particles, from sums over C parts of its particles.

    Parameters
    ----------
    lanes
        (12, N, C): the largest log weight of each part, and sums of w, w^2, wx, wy, wz, wxx, wyy, wzz, wxy, wxz, wyz
        with weights relative to it.
    """
    lanes = lanes.astype(np.float64)
    top = lanes[0].max(axis=1)
    scale = np.exp(np.maximum(lanes[0] - top[:, None], 2.0 * DEEPEST))
    total, square = np.sum(lanes[1] * scale, axis=1), np.sum(lanes[2] * scale**2, axis=1)
    sums = np.einsum("knc,nc->kn", lanes[3:], scale) / total
    mean = sums[:3].T
    covariance = sums[3:][SECOND].transpose(2, 0, 1) - mean[:, :, None] * mean[:, None, :]
    return CloudSums(top + np.log(total), total**2 / square, mean, covariance)


def restoring_map(wanted: Floats, found: Floats) -> Floats:
    """Linear maps (N, 3, 3) that give clouds' offsets of covariance `found` the covariance `wanted`.

    Of all such maps that which moves particles least, if the two covariances are alike. A cloud that has collapsed is
    opened to `LEAST_STD`.
    """
    values, vectors = np.linalg.eigh(0.5 * (wanted + np.swapaxes(wanted, 1, 2)))
    root = np.sqrt(np.maximum(values, LEAST_STD**2))[:, None]
    turned = np.swapaxes(vectors, 1, 2)
    forth, back = vectors * root @ turned, vectors / root @ turned
    white = back @ found @ back
    values, vectors = np.linalg.eigh(0.5 * (white + np.swapaxes(white, 1, 2)))
    stretch = vectors * (np.maximum(values, 1e-4) ** -0.5)[:, None] @ np.swapaxes(vectors, 1, 2)
    return np.asarray(forth @ stretch @ back)


def kernel_width(size: int, dims: int) -> float:
    """Silverman's kernel width for a cloud of `size` Gaussian samples in `dims` dimensions, in deviations."""
    width = (4.0 / (dims + 2.0)) ** (1.0 / (dims + 4.0)) * size ** (-1.0 / (dims + 4.0))
    return float(min(width, LARGEST_WIDTH))
