"""Scores of estimates against the truth (floor 5): errors, map distances, consistency, association, intervals."""

from rislam_rt.evaluate.association import AssociationScore, association_fractions, association_score
from rislam_rt.evaluate.confidence_intervals import (
    Interval,
    bootstrap,
    median_over_runs,
    rms_over_runs,
    share_interval,
)
from rislam_rt.evaluate.estimation_errors import align, normalised_squares, position_errors, rmse, root_mean_square
from rislam_rt.evaluate.plane_matching import (
    NEAR_ANGLE,
    NEAR_WALL,
    Surfaces,
    ghost_planes,
    match_planes,
    plane_angle,
    plane_distance,
)
from rislam_rt.evaluate.set_distances import gospa, match_points

__all__ = [
    "NEAR_ANGLE", "NEAR_WALL", "AssociationScore", "Interval", "Surfaces", "align", "association_fractions",
    "association_score", "bootstrap", "ghost_planes", "gospa", "match_planes", "match_points",
    "median_over_runs", "normalised_squares", "plane_angle", "plane_distance", "position_errors", "rms_over_runs",
    "rmse", "root_mean_square", "share_interval",
]  # fmt: skip
