"""Errors of positions, trajectories and walls. Plain arrays in, plain values out."""

from typing import NamedTuple

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.errors import GeometryError
from rislam_rt.geometry.angles import wrap


def position_errors(estimate: Floats, truth: Floats) -> Floats:
    """Position errors (...,) [m], distances between positions (..., D)."""
    return np.asarray(np.linalg.norm(np.asarray(estimate) - np.asarray(truth), axis=-1))


def rmse(estimate: Floats, truth: Floats) -> float:
    """Root mean squared error [m] over all positions (..., D)."""
    return root_mean_square(position_errors(estimate, truth))


def root_mean_square(errors: Floats) -> float:
    """Root of the mean square of errors of any shape.

    Raises
    ------
    GeometryError
        There is nothing to average.
    """
    errors = np.asarray(errors, dtype=np.float64)
    if not errors.size:
        raise GeometryError("errors: none received; give at least one")
    return float(np.sqrt(np.mean(errors**2)))


class TrajectoryError(NamedTuple):
    """Errors of a trajectory, in metres and radians."""

    rmse: float
    """Absolute, without alignment: SLAM with a known start has no free frame."""
    rmse_aligned: float
    """Absolute, after the best rotation about z and translation: the shape alone."""
    median: float
    largest: float
    final: float
    drift: float
    """RMS error of the displacement over `step` cycles."""
    heading: float
    """RMS error of the heading; 0 where none was given."""


def trajectory_error(
    estimate: Floats,
    truth: Floats,
    *,
    heading: Floats | None = None,
    true_heading: Floats | None = None,
    step: int = 1,
) -> TrajectoryError:
    """Errors of estimated positions (K, 3), and headings (K,) if given, against the true ones.

    Raises
    ------
    GeometryError
        The shapes differ, or there are not more than `step` poses.
    """
    estimate, truth = np.asarray(estimate, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    if estimate.shape != truth.shape or len(truth) <= step:
        raise GeometryError(f"trajectories {estimate.shape} and {truth.shape}: give the same (K, 3), K above {step}")
    errors = position_errors(estimate, truth)
    moved = position_errors(estimate[step:] - estimate[:-step], truth[step:] - truth[:-step])
    turned = 0.0
    if heading is not None and true_heading is not None:
        turned = root_mean_square(wrap(np.asarray(heading) - np.asarray(true_heading)))
    return TrajectoryError(
        root_mean_square(errors),
        rmse(align(estimate, truth), truth),
        float(np.median(errors)),
        float(errors.max()),
        float(errors[-1]),
        root_mean_square(moved),
        turned,
    )


def align(estimate: Floats, truth: Floats) -> Floats:
    """Estimated positions (K, 3) aligned: turned about z and shifted so that they fit the true ones best (least
    squares)."""
    centred, target = estimate - estimate.mean(axis=0), truth - truth.mean(axis=0)
    # The angle that maximises sum target . R centred, with complex numbers for the plane.
    overlap = np.sum(np.conj(centred[:, 0] + 1j * centred[:, 1]) * (target[:, 0] + 1j * target[:, 1]))
    angle = np.angle(overlap) if overlap != 0.0 else 0.0
    c, s = np.cos(angle), np.sin(angle)
    return centred @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + truth.mean(axis=0)
