"""Path certificate: two channels of one room compared path by path, every difference proved from the geometry, every
error judged by what precision explains."""

from rislam_rt.channel.compare.channels import compare_channels, validate_rooms
from rislam_rt.channel.compare.match import compare_paths
from rislam_rt.channel.compare.poses import random_poses
from rislam_rt.channel.compare.report import LimitViolation, OneSidedPath, PathReport
from rislam_rt.channel.compare.table import Validation, validation_page, validation_table

__all__ = [
    "LimitViolation",
    "OneSidedPath",
    "PathReport",
    "Validation",
    "compare_channels",
    "compare_paths",
    "random_poses",
    "validate_rooms",
    "validation_page",
    "validation_table",
]
