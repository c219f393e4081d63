"""Mean and covariance of what a filter believes: all that the front end (association, births, map) asks of it."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy

from rislam_rt.arrays import Floats, Integers
from rislam_rt.model import Body
from rislam_rt.slam.returns import Poses

POSE = 7
"""Numbers of the pose: position, velocity, heading. The features, three numbers each, follow them."""


class Moments(NamedTuple):
    """The belief's first two moments over pose and F features."""

    mean: Floats
    """(7 + 3F,) position [m], velocity [m/s], heading [rad], features [m]."""
    covariance: Floats
    """(7 + 3F, 7 + 3F)."""

    @property
    def position(self) -> Floats:
        """(3,) [m]."""
        return self.mean[:3]

    @property
    def velocity(self) -> Floats:
        """(3,) [m/s]."""
        return self.mean[3:6]

    @property
    def heading(self) -> float:
        """[rad]."""
        return float(self.mean[6])

    @property
    def features(self) -> Floats:
        """(F, 3) [m]."""
        return self.mean[POSE:].reshape(-1, 3)

    def block(self, feature: int) -> Floats:
        """(3, 3) [m^2] covariance of one feature."""
        return self.covariance[where(feature), where(feature)]

    def columns(self, features: Integers) -> Integers:
        """Columns (3P,) of some features."""
        return np.asarray((POSE + 3 * np.asarray(features, dtype=np.int64)[:, None] + np.arange(3)).ravel())


def where(feature: int) -> slice:
    """Columns of one feature in the moments."""
    return slice(POSE + 3 * feature, POSE + 3 * feature + 3)


def poses_of(position: Floats, heading: Floats, body: Body) -> Poses:
    """Ends of agents at positions (..., 3) with headings that broadcast against the leading axes."""
    return Poses(*body.ends(position, heading), np.asarray(heading))


def normalised(log_weight: Floats) -> tuple[Floats, float]:
    """Log weights that sum to one, and the logarithm of what they summed to; hopeless weights become equal ones."""
    top = float(np.max(log_weight))
    if not np.isfinite(top):
        return np.full(len(log_weight), -np.log(len(log_weight))), -np.inf
    total = top + float(np.log(np.sum(np.exp(log_weight - top))))
    return log_weight - total, total


def square_root(covariance: Floats) -> Floats:
    """A factor (D, K) with `factor @ factor.T = covariance`, null directions left out."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-30))
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    keep = values > 1e-12
    return scale[:, None] * vectors[:, keep] * np.sqrt(values[keep])


@lru_cache(maxsize=16)
def even_draws(count: int, dims: int) -> Floats:
    """(count, dims) equally likely draws of a standard normal without a random number: mean 0, covariance 1.

    Halton's sequence through the normal quantile.
    """
    if not dims:
        return np.zeros((count, 0))
    from scipy.stats.qmc import Halton  # half a second of import: only once there is something to sample

    draws = scipy.special.ndtri(Halton(dims, scramble=False).random(count + 1)[1:])
    if count <= dims + 1:
        return np.zeros((count, dims)) if count == 1 else np.asarray(draws - draws.mean(axis=0))
    draws -= draws.mean(axis=0)
    return np.asarray(np.linalg.solve(np.linalg.cholesky(draws.T @ draws / count), draws.T).T)
