"""Confidence intervals of scores over independent runs (seeds): the bootstrap, and Wilson's for shares."""

import warnings
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError

Statistic = Callable[[Floats], Floats]
"""Statistic of samples (R, B, ...) that works along the first axis, the runs, and gives values (B,)."""


class Interval(NamedTuple):
    """A value and its confidence interval."""

    value: float
    lower: float
    upper: float


def mean_over_runs(samples: Floats) -> Floats:
    """Mean over the first axis, as a statistic for confidence intervals."""
    return np.asarray(np.mean(samples, axis=0))


def rms_over_runs(samples: Floats) -> Floats:
    """Root mean square over the first axis, as a statistic for confidence intervals: RMSE over seeds."""
    return np.asarray(np.sqrt(np.mean(np.asarray(samples) ** 2, axis=0)))


def median_over_runs(samples: Floats) -> Floats:
    """Median over the first axis, as a statistic for confidence intervals."""
    return np.asarray(np.median(samples, axis=0))


def share_interval(count: int, runs: int) -> Interval:
    """Share `count / runs` with its 95 % confidence interval by Wilson (1927), which holds at shares of 0 and 1 too."""
    if not 0 <= count <= runs or runs < 1:
        raise ConfigError(f"count, runs: {count} of {runs} received; give a part of at least one run")
    z, share = float(scipy.special.ndtri(0.975)), count / runs
    middle = (share + z**2 / (2 * runs)) / (1.0 + z**2 / runs)
    half = z / (1.0 + z**2 / runs) * float(np.sqrt(share * (1.0 - share) / runs + z**2 / (4.0 * runs**2)))
    return Interval(share, min(share, max(0.0, middle - half)), max(share, min(1.0, middle + half)))


def bootstrap(
    samples: Floats, *, rng: np.random.Generator, statistic: Statistic = mean_over_runs, level: float = 0.95,
    resamples: int = 2000,
) -> Interval:  # fmt: skip
    """Bias-corrected and accelerated bootstrap interval (Efron 1987) of a statistic of samples (R, ...) from R
    independent runs.

    Where that is not defined, because leaving out any one run changes nothing, the interval of quantiles alone.

    Parameters
    ----------
    statistic
        From samples (R, B, ...) to values (B,): it works along the first axis.
    """
    samples = np.asarray(samples, dtype=np.float64)
    if len(samples) < 2:
        raise ConfigError(f"samples: {len(samples)} received; an interval needs at least 2 runs")
    value = float(statistic(samples[:, None])[0])
    columns = samples.reshape(len(samples), -1).T

    def of_columns(*drawn: Floats, axis: int) -> Floats:
        runs = np.stack([np.moveaxis(one, axis, 0) for one in drawn], axis=-1)
        return statistic(runs.reshape(*runs.shape[:-1], *samples.shape[1:]))

    again = partial(
        scipy.stats.bootstrap, tuple(columns), of_columns, confidence_level=level, paired=True, vectorized=True, rng=rng
    )  # fmt: skip
    with warnings.catch_warnings(), np.errstate(divide="ignore", invalid="ignore"):
        warnings.simplefilter("ignore", scipy.stats.DegenerateDataWarning)
        found = again(method="BCa", n_resamples=resamples)
        if not np.isfinite(found.confidence_interval).all():  # no spread without any one run: a median, or all alike
            found = again(method="percentile", n_resamples=0, bootstrap_result=found)
    return Interval(value, *(float(end) for end in found.confidence_interval))
