"""Engine that weighs landmark particles in plain numpy, in blocks that fit the cache: reference and fallback."""

import numpy as np
import numpy.typing as npt

from rislam_rt.arrays import Floats, Integers
from rislam_rt.slam.nested.particles.landmark_cloud import (
    DEEPEST,
    HOPELESS,
    Cloud,
    CloudSums,
    Kernel,
    combine,
    restoring_map,
)
from rislam_rt.slam.nested.particles.sightline import Kinds, log_likelihood
from rislam_rt.slam.sampling import ancestors_at

Singles = npt.NDArray[np.float32]
"""Arrays of float32."""
CACHE = 16384
"""Number of landmark particles handled at a time."""


class NumpyEngine:
    """Engine of landmark particles in plain numpy, a few agent particles at a time."""

    name = "numpy"
    """Name of the engine."""

    def build(self, points: Floats, log_weight: Floats, block: Integers, row: Integers) -> Cloud:
        """Build a landmark's cloud in numpy, of blocks of points (B, M, 3) [m] and rows of log weights (R, M)."""
        flat = np.ascontiguousarray(np.swapaxes(points, 1, 2), dtype=np.float32)
        total = np.logaddexp.reduce(log_weight, axis=1)[row]
        return Cloud(flat, log_weight.astype(np.float32), block, row, total, points.shape[1])

    def read(self, cloud: Cloud) -> tuple[Floats, Floats]:
        """Offsets (N, M, 3) [m] and normalised log weights (N, M) of every agent particle, numpy's, for tests."""
        points = np.swapaxes(cloud.points[cloud.block], 1, 2)
        return points.astype(np.float64), cloud.log_weight[cloud.row] - cloud.log_total[:, None]

    def weigh(self, cloud: Cloud, kinds: Kinds, constants: Floats) -> tuple[Cloud, CloudSums]:
        """Multiply the weights of a cloud, in numpy, by the likelihood of returns, constants (K, N) float32."""
        count, size = len(cloud.block), cloud.size
        new = np.empty((count, size), dtype=np.float32)
        lanes = np.empty((12, count, 1))
        log_total = cloud.log_total.astype(np.float32)
        for rows in _chunks(count, size):
            own = constants[:, rows, None]
            x, y, z = np.swapaxes(cloud.points[cloud.block[rows]], 0, 1)
            new[rows] = cloud.log_weight[cloud.row[rows]] - log_total[rows, None]
            if kinds:
                with np.errstate(over="ignore", invalid="ignore"):
                    new[rows] += log_likelihood(kinds, own.__getitem__, x, y, z, lambda square: 1.0 / np.sqrt(square))
            np.copyto(new[rows], np.float32(HOPELESS), where=~(new[rows] > HOPELESS))
            lanes[:, rows, 0] = _sum_up(new[rows], x, y, z)
        sums = combine(lanes)
        return cloud._replace(log_weight=new, row=np.arange(count), log_total=sums.log_total), sums

    def resample(self, cloud: Cloud, covariance: Floats, size: int, kernel: Kernel) -> Cloud:
        """Resample a cloud, in numpy, to `size` equal particles per agent particle, mean 0, covariance (N, 3, 3)."""
        count = len(cloud.block)
        fresh = np.empty((count, 3, size), dtype=np.float32)
        child = np.arange(size)
        place, partner = child * kernel.stride % size, (child + kernel.offset) % size
        keep = np.float32(np.sqrt(1.0 - kernel.width**2))
        for rows in _chunks(count, size):
            log_weight = cloud.log_weight[cloud.row[rows]] - cloud.log_total[rows, None]
            ancestors = ancestors_at(np.exp(np.maximum(log_weight, -80.0)), size, kernel.comb[rows])
            points = np.empty((len(ancestors), 3, size), dtype=np.float32)
            points[:, :, place] = np.take_along_axis(cloud.points[cloud.block[rows]], ancestors[:, None], axis=2)
            points = keep * points + np.float32(kernel.width) * points[:, :, partner]
            points -= points.mean(axis=2, keepdims=True)
            found = np.einsum("nam,nbm->nab", points, points) / size
            fresh[rows] = restoring_map(covariance[rows], found).astype(np.float32) @ points
        uniform = np.full((1, size), -np.log(size), dtype=np.float32)
        return Cloud(fresh, uniform, np.arange(count), np.zeros(count, dtype=np.int64), np.zeros(count), size)

    def compact(self, cloud: Cloud) -> Cloud:
        """Copy a cloud, in numpy, without the blocks and rows that no agent particle points at."""
        used, block = np.unique(cloud.block, return_inverse=True)
        rows, row = np.unique(cloud.row, return_inverse=True)
        return cloud._replace(points=cloud.points[used], log_weight=cloud.log_weight[rows], block=block, row=row)


def _chunks(count: int, size: int) -> list[slice]:
    """Slices of the agent particles that numpy weighs together, of `size` landmark particles each."""
    step = max(1, CACHE // size)
    return [slice(start, min(start + step, count)) for start in range(0, count, step)]


def _sum_up(log_weight: Singles, x: Singles, y: Singles, z: Singles) -> Floats:
    """Sums (12, n) in numpy for `combine` over the landmark particles of each of n agent particles."""
    top = log_weight.max(axis=1)
    weight = np.exp(np.maximum(log_weight - top[:, None], np.float32(DEEPEST)))
    wx, wy, wz = weight * x, weight * y, weight * z
    pairs = [(weight, weight), (wx, x), (wy, y), (wz, z), (wx, y), (wx, z), (wy, z)]
    square, *second = (np.einsum("nm,nm->n", a, b) for a, b in pairs)
    return np.stack([top, weight.sum(axis=1), square, wx.sum(axis=1), wy.sum(axis=1), wz.sum(axis=1), *second])
