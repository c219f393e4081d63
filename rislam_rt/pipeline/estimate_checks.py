"""Checks of the poses and maps that a user's own or an external estimator returns, before they are scored."""

from typing import Any

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import ConfigError, expect
from rislam_rt.model import MapEstimate, SlamEstimate

ROUNDING = 1e-6
"""Largest ratio of a covariance's negative to its largest eigenvalue that counts as rounding in single precision; by so
much, too, a probability may exceed 1 and a normal's length differ from it."""
FARTHEST = 1e12
"""[m] Largest coordinate that a user's own filter may return, so that scores, which square it, stay finite."""


def check_estimate(found: Any, what: str) -> SlamEstimate:
    """Return the estimate of a user's own or an external estimator if it can be one; `what` says whose it is.

    Raises
    ------
    ConfigError
        It is none, or a position, heading, covariance or map that cannot be; the line begins with `what`.
    """
    expect(what, found, SlamEstimate)
    far = float(np.abs(found.position).max())
    if far > FARTHEST:
        raise ConfigError(f"{what}: a position of {far:g} m returned; give one up to {FARTHEST:g} m")
    heading = np.asarray(found.heading)
    if heading.ndim or heading.dtype.kind not in "iuf" or not np.isfinite(heading):
        raise ConfigError(f"{what}: a heading of {found.heading} returned; give a finite number of radians")
    _check_covariances(found.covariance[None], what)
    check_map(found.map, what)
    return found


def check_map(found: Any, what: str) -> MapEstimate:
    """Return the map of a user's own or an external estimator if it can be one; `what` says whose it is.

    Raises
    ------
    ConfigError
        It is none, or numbers, parents, probabilities or normals that cannot be; the line begins with `what`.
    """
    expect(f"{what}: map", found, MapEstimate)
    count = len(found.ident)
    length = np.linalg.norm(found.wall_normal, axis=-1)
    for name, right, wanted in (
        ("ident", (found.ident >= 0).all() and len(np.unique(found.ident)) == count, "each its own number from 0 on"),
        (
            "parent",
            ((found.parent >= -1) & (found.parent < count) & (found.parent != np.arange(count))).all(),
            f"rows of the map, below {count}, other than its own, or -1",
        ),
        ("ris_probability", (np.abs(found.ris_probability - 0.5) <= 0.5 + ROUNDING).all(), "numbers from 0 to 1"),
        ("wall_normal", (np.abs(length - 1.0) <= ROUNDING).all(), "unit vectors"),
    ):
        if not right:
            shown = " ".join(np.array2string(getattr(found, name), precision=4, threshold=6).split())
            raise ConfigError(f"{what}: map: {name} {shown[:80]} returned; give {wanted}")
    _check_covariances(found.covariance, f"{what}: map")
    return found


def _check_covariances(found: Floats, what: str) -> None:
    """Raise an error for covariances (N, D, D) of which one has an eigenvalue below 0 by more than rounding."""
    values = np.linalg.eigvalsh(0.5 * (found + np.swapaxes(found, 1, 2)))
    wrong = values[values[:, 0] < -ROUNDING * np.maximum(values[:, -1], 0.0), 0]
    if len(wrong):
        raise ConfigError(f"{what}: a covariance with an eigenvalue of {wrong[0]:g} returned; give none below 0")
