"""Reported pose and map of BP-SLAM with angles: the start's error put back in, points and walls."""

import numpy as np

from rislam_rt.arrays import Floats
from rislam_rt.model import MapEstimate
from rislam_rt.slam.schemes.bp_slam_aoa.gaussian_features import POINT, WALL, GaussianFeatures, spread_over
from rislam_rt.slam.schemes.shared.agent_trajectory import AgentTrajectory
from rislam_rt.slam.schemes.shared.report import position_errors
from rislam_rt.slam.start_prior import StartPrior


def start_variance(start: StartPrior) -> Floats:
    """Covariance (3, 3) [m^2] of the start that was told, which a report adds to the pose; its height is exact."""
    return start.position_std**2 * np.diag([1.0, 1.0, 0.0])


def pose_moments(course: AgentTrajectory, start: StartPrior, count: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Reported position (3,), velocity (3,), their covariance (6, 6), and `count` equally likely positions."""
    covariance = course.covariance[:6, :6].copy()
    covariance[:3, :3] += start_variance(start)
    covariance = 0.5 * (covariance + covariance.T)
    position, velocity = start.position + course.mean[:3], course.mean[3:6]
    return position, velocity, covariance, position + position_errors(covariance, count)


def known_map(features: GaussianFeatures, course: AgentTrajectory, start: StartPrior, threshold: float) -> MapEstimate:
    """Reported map of the features that exist, each by its likeliest Gaussian, as points and walls; no wanderers."""
    total = features.covariance + spread_over(features.slope, course)
    best = np.zeros(len(features.ident))
    np.maximum.at(best, features.owner, features.share)
    shown = (features.existence[features.owner] > threshold) & (features.share > 0.5)
    shown &= features.share >= best[features.owner]
    points, walls = (np.flatnonzero(shown & (features.kind == kind)) for kind in (POINT, WALL))
    image, spread = features.mean[walls], total[walls]
    size = np.linalg.norm(image, axis=1)
    normal = image / np.maximum(size, 1e-9)[:, None]
    along = np.einsum("wi,wij,wj->w", normal, spread, normal)
    across = np.maximum(np.einsum("wii->w", spread) - along, 0.0)
    std = np.stack([np.sqrt(0.5 * across) / np.maximum(size, 1e-9), 0.5 * np.sqrt(along)], axis=1)
    count = len(points)
    return MapEstimate(
        features.ident[features.owner[points]], start.position + features.mean[points],
        total[points] + start_variance(start), np.full(count, -1), np.zeros(count),
        np.exp(np.clip(features.strength[points], -30.0, 30.0)), normal, 0.5 * size + normal @ start.position, std,
    )  # fmt: skip
