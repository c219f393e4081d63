"""Consistency, whether a filter knows how wrong it is: normalised squared errors against chi-square bounds."""

from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError


def normalised_squares(errors: Floats, covariances: Floats) -> Floats:
    """Squares for consistency (NEES, NIS): `e^T P^-1 e` (...,) of errors (..., D), covariances (..., D, D).

    NEES of state errors, NIS of innovations; chi-square with D degrees of freedom when the filter is consistent.
    Infinite where a covariance is not positive definite.
    """
    errors, covariances = np.broadcast_arrays(np.asarray(errors)[..., None], np.asarray(covariances))
    errors = errors[..., :1]
    definite = np.linalg.eigvalsh(covariances)[..., 0] > 0.0
    safe = np.where(definite[..., None, None], covariances, np.eye(covariances.shape[-1]))
    squares = np.sum(errors * np.linalg.solve(safe, errors), axis=(-2, -1))
    return np.where(definite, squares, np.inf)


class Consistency(NamedTuple):
    """Average normalised squared error against the interval in which it should lie."""

    average: Floats
    """(...,) mean over the runs, divided by the degrees of freedom: 1 when consistent, above it when overconfident."""
    lower: float
    upper: float
    inside: float
    """Fraction of the averages within [lower, upper]."""


def consistency(squares: Floats, dof: int, *, level: float = 0.95) -> Consistency:
    """Score NEES or NIS values (R, ...) of R independent runs (Bar-Shalom, Li and Kirubarajan, 5.4).

    The sum over R runs is chi-square with R D degrees of freedom; the two-sided interval holds it with the given level.
    Averages over cycles of one run are not independent and deserve no such interval.
    """
    squares = np.asarray(squares, dtype=np.float64)
    lower, upper = chi_square_bounds(dof, len(squares), level=level)
    average = squares.mean(axis=0) / dof
    return Consistency(average, lower, upper, float(np.mean((average >= lower) & (average <= upper))))


def chi_square_bounds(dof: int, runs: int = 1, *, level: float = 0.95) -> tuple[float, float]:
    """Two-sided bounds on the average over `runs` of a normalised squared error per degree of freedom."""
    if dof < 1 or runs < 1 or not 0.0 < level < 1.0:
        raise ConfigError(
            f"dof, runs, level: {dof}, {runs}, {level} received; give 1 or more, 1 or more, within (0, 1)"
        )
    lower, upper = scipy.stats.chi2.interval(level, dof * runs)
    return float(lower) / (dof * runs), float(upper) / (dof * runs)
