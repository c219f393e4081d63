"""Path certificate: two channels of one room compared path by path, every difference proved from the geometry, every
error judged by what precision explains."""

from rislam_rt.channel.compare.both_channels import Validation, compare_channels, validate_rooms
from rislam_rt.channel.compare.comparison_report import OneSidedPath, PathReport
from rislam_rt.channel.compare.path_matching import compare_paths
from rislam_rt.channel.compare.poses import random_poses

__all__ = [
    "OneSidedPath",
    "PathReport",
    "Validation",
    "compare_channels",
    "compare_paths",
    "random_poses",
    "validate_rooms",
]
