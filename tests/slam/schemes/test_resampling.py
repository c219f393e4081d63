"""Resampling draws without bias, and the kernel keeps what it must."""

import numpy as np

from rislam_rt.slam.schemes.shared.resampling import (
    cell_levels,
    cell_order,
    effective_fraction,
    kernel_width,
    normalised_rows,
    resample_systematic,
    smooth,
    systematic_rows,
)


def test_systematic_resampling_is_unbiased() -> None:
    """A particle is drawn `floor(N w)` or one more times, and `N w` times on average."""
    rng = np.random.default_rng(1)
    weight = rng.random((1, 8)) ** 3
    weight /= weight.sum()
    draws = 4000
    rows = np.concatenate([systematic_rows(weight, rng=rng) for _ in range(draws)])
    counts = np.stack([(rows == particle).sum(axis=1) for particle in range(8)], axis=1)
    wanted = 8 * weight[0]
    assert np.all(counts >= np.floor(wanted))
    assert np.all(counts <= np.floor(wanted) + 1)
    # A count is one of two neighbours: its standard deviation is at most 1/2, that of the mean 1/2 / sqrt(4000).
    assert np.all(np.abs(counts.mean(axis=0) - wanted) < 5.0 * 0.5 / np.sqrt(draws))


def test_effective_fraction_between_one_particle_and_all() -> None:
    """1 for equal weights, 1/N when one particle has it all."""
    assert np.allclose(effective_fraction(np.stack([np.full(4, 0.25), np.array([1.0, 0.0, 0.0, 0.0])])), [1.0, 0.25])


def test_hopeless_weights_become_equal_ones() -> None:
    """No row holds a NaN, whatever its logarithms."""
    rows = normalised_rows(np.array([[-np.inf, -np.inf], [-1e4, -1e4 - np.log(3.0)]]))
    assert np.allclose(rows, [[0.5, 0.5], [0.75, 0.25]], rtol=1e-11)


def test_cells_halve_the_cloud_at_the_median() -> None:
    """Points on a line: the cells are its pieces, in order within each other."""
    cloud = np.random.default_rng(2).permutation(np.arange(64.0))[None, :, None] * np.array([1.0, 0.0])
    assert cell_levels(64) == 2
    order = cell_order(cloud, 2)
    cells = np.sort(cloud[0, order[0], 0].reshape(4, 16), axis=1)
    assert np.array_equal(np.sort(cells[:, 0]), [0.0, 16.0, 32.0, 48.0])
    assert np.allclose(np.ptp(cells, axis=1), 15.0)


def test_kernel_keeps_mean_and_covariance_of_cells() -> None:
    """Exactly the mean; the covariance on average over kernels, to four standard errors of the sample."""
    rng = np.random.default_rng(3)
    cloud = rng.standard_normal((1, 64, 2)) * np.array([1.0, 5.0]) + 10.0
    moved = np.concatenate([smooth(cloud, np.array([0.7]), 1, rng=rng) for _ in range(2000)])
    cells, after = cloud.reshape(2, 32, 2), moved.reshape(2000, 2, 32, 2)
    assert np.allclose(after.mean(axis=2), cells.mean(axis=1), rtol=0.0, atol=1e-10)
    variance = after.var(axis=2)
    error = variance.std(axis=0) / np.sqrt(2000)
    # Two permutations share a member once in 32: that pair adds nothing, so the mean falls short by width^2 / 32.
    short = 1.0 - 0.7**2 / 32
    assert np.all(variance.mean(axis=0) < cells.var(axis=1) + 4.0 * error)
    assert np.all(variance.mean(axis=0) > short * cells.var(axis=1) - 4.0 * error - 0.05 * cells.var(axis=1))


def test_kernel_stands_still_when_nothing_was_lost() -> None:
    """Full effective size: width zero."""
    assert np.array_equal(kernel_width(100, 2, np.array([1.0])), [0.0])


def test_partial_resampling_keeps_expectations() -> None:
    """The weighted mean after thinning out is the one before, to four standard errors of the draws."""
    rng = np.random.default_rng(4)
    cloud, log_weight = rng.standard_normal((1, 256, 2)), np.log(rng.random((1, 256)))
    before = normalised_rows(log_weight)[0] @ cloud[0]
    means = []
    for _ in range(400):
        thinned, left = resample_systematic(cloud, log_weight, 0.7, rng=rng)
        means.append(normalised_rows(left)[0] @ thinned[0])
    error = np.std(means, axis=0) / np.sqrt(400)
    # The ratio of two sums is biased by about 1/N of the spread, besides.
    assert np.all(np.abs(np.mean(means, axis=0) - before) < 4.0 * error + 1.0 / 256)
