"""Path certificate: two channels of one room compared path by path, every difference proved from the geometry, every
error judged by what precision explains."""

from rislam_rt.channel.compare.channels import Validation, compare_channels, validate_rooms
from rislam_rt.channel.compare.match import compare_paths
from rislam_rt.channel.compare.poses import random_poses
from rislam_rt.channel.compare.report import LimitViolation, OneSidedPath, PathReport

__all__ = [
    "LimitViolation",
    "OneSidedPath",
    "PathReport",
    "Validation",
    "compare_channels",
    "compare_paths",
    "random_poses",
    "validate_rooms",
]
