"""Floor 5: scores. Errors, distances between maps, consistency, confidence intervals, association."""

from rislam_rt.evaluate.association import AssociationScore, association_fractions, association_score, label_switches
from rislam_rt.evaluate.confidence_intervals import (
    Interval,
    bootstrap,
    bootstrap_ratio,
    mean_over_runs,
    median_over_runs,
    rms_over_runs,
    share_interval,
)
from rislam_rt.evaluate.consistency import normalised_squares
from rislam_rt.evaluate.errors import align, position_errors, rmse, root_mean_square
from rislam_rt.evaluate.set_distances import Gospa, gospa, match_nearest, match_points

__all__ = [
    "AssociationScore",
    "Gospa",
    "Interval",
    "align",
    "association_fractions",
    "association_score",
    "bootstrap",
    "bootstrap_ratio",
    "gospa",
    "label_switches",
    "match_nearest",
    "match_points",
    "mean_over_runs",
    "median_over_runs",
    "normalised_squares",
    "position_errors",
    "rms_over_runs",
    "rmse",
    "root_mean_square",
    "share_interval",
]
